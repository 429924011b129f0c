"""What the components of a telephone share: materials, bodies, where screens and keys go."""

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, pick_material
from ffd_lightning.shapes.kit.materials import draw_housing
from ffd_lightning.shapes.kit.vectors import Array, Triple, lean, vec


@dataclass(frozen=True)
class Body:
    """A box-like housing: its middle (3,), size, and rotation (3, 3) about the middle."""

    center: Array
    width: float
    height: float
    depth: float
    turn: Array

    def at(self, x: float, y: float, out: float = 0.0) -> Array:
        """Return the point `out` before the front, at x and y from -0.5 to 0.5 of the size."""
        local = vec(x * self.width, y * self.height, -self.depth / 2 - out)
        return np.asarray(self.turn @ local + self.center)

    def behind(self, x: float, y: float, out: float = 0.0) -> Array:
        """Return the point `out` behind the back, at x and y from -0.5 to 0.5 of the size."""
        return self.at(x, y, -self.depth - out)

    def strip(self, x: float, low: float, high: float, share: float = 1.0) -> "Body":
        """Return the part of it from `low` to `high`, `share` wide, about `x`."""
        center = self.at(x, (low + high) / 2, -self.depth / 2)
        return Body(center, share * self.width, (high - low) * self.height, self.depth, self.turn)


@dataclass(frozen=True)
class Finish:
    """The materials of one telephone."""

    body: Material
    back: Material
    trim: Material
    keys: Material
    screen: Material


@dataclass(frozen=True)
class Plan:
    """A telephone's bodies and materials."""

    main: Body  # has the keys, the buttons and the aerial
    lid: Body | None  # has the screen, where there are two
    keys: Body  # the part of the main body's front that the lid leaves free
    radius: float  # of the corners, as seen from the front
    finish: Finish


def draw_finish(rng: Rng) -> Finish:
    """Draw the materials: any housing, a contrasting or equal back, dark or lit screen."""

    def shell() -> Material:
        return pick_material(rng, "plastic") if rng.random() < 0.3 else draw_housing(rng)

    body = shell()
    back = body if rng.random() < 0.5 else shell()
    shade = rng.uniform(0.05, 0.2) if np.mean(body.color) > 0.5 else rng.uniform(0.65, 0.9)
    keys = Material((shade, shade, shade)) if rng.random() < 0.7 else pick_material(rng, "paint")
    hue = pick_material(rng, "paint").color
    screen = hue if rng.random() < 0.5 else (0.03, 0.03, rng.uniform(0.04, 0.1))
    return Finish(body, back, pick_material(rng, "metal"), keys, Material(screen))


def tile(
    b: Builder, part: str, material: Material, body: Body, center: Array, size: Triple,
    radius: float, edge: float | None = None, segments: int = 3,
) -> None:  # fmt: skip
    """Add a plate of `size` (width, height, depth), rounded by `radius` as seen from the front."""
    wide, tall, deep = size
    turn = body.turn @ lean(90)  # rounded_box rounds the edges along its y: this turns y to z
    box = (wide, deep, tall)
    b.rounded_box(part, material, center, box, radius, edge=edge, turn=turn, segments=segments)
