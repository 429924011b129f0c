"""What the components of a monitor share: sizes and materials. The unit is the frame's width."""

from dataclasses import dataclass

import numpy as np

from ffd_lightning.shapes.kit import Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.materials import draw_housing
from ffd_lightning.shapes.kit.vectors import Array, Triple, about_y, lean, vec


@dataclass(frozen=True)
class Plan:
    """A monitor's sizes and materials."""

    width: float  # of the frame, 1 but for several screens together
    height: float  # of the frame
    thick: float  # of the frame, front to back
    deep: float  # of the housing behind the frame
    bezel: float  # width of the frame around the screen
    chin: float  # what the frame is wider by below the screen
    side: float  # what the frame is wider by at the left and at the right
    center: Triple  # the frame's middle
    turn: Array  # (3, 3) rotation about it
    frame: Material
    back: Material  # of the housing
    stand: Material
    screen: Material
    accent: Material  # of buttons and loudspeakers

    @property
    def low(self) -> float:
        """Height of the frame's lower edge, if it is upright."""
        return self.center[1] - self.height / 2

    @property
    def flat(self) -> Array:
        """Rotation of a box whose upright edges are to run from the frame's front to its back."""
        return self.turn @ lean(90)

    def at(self, x: float, y: float, z: float) -> Array:
        """Return the point at `x` and `y`, -0.5 to 0.5 across the frame, `z` behind its middle."""
        return self.turn @ vec(x * self.width, y * self.height, z) + np.array(self.center)


_RANGES = {  # of height, frame's thickness, housing's depth, bezel
    "panel": ((0.48, 0.88), (0.02, 0.1), (0.01, 0.12), (0.01, 0.07)),
    "curved": ((0.3, 0.65), (0.025, 0.05), (0.03, 0.07), (0.008, 0.03)),
    "array": ((0.26, 0.36), (0.02, 0.04), (0.01, 0.04), (0.01, 0.02)),
    "tube": ((0.68, 1.0), (0.08, 0.2), (0.35, 1.05), (0.04, 0.1)),
    "projection": ((0.55, 0.85), (0.06, 0.1), (0.3, 0.55), (0.03, 0.07)),
    "console": ((0.55, 0.9), (0.3, 0.55), (0.02, 0.05), (0.05, 0.08)),
}
_LOW = {  # by what it stands on: the frame's height above the ground, greatest tilt
    "plate": (0.05, 0.5, 18), "disc": (0.05, 0.5, 18), "v": (0.06, 0.5, 18),
    "floor": (0.6, 1.3, 12), "feet": (0.03, 0.22, 3), "arm": (0.05, 0.05, 15),
    "rails": (0.05, 0.05, 6), "sheet": (0.06, 0.4, 20), "hoop": (0.06, 0.4, 20),
    "easel": (0.3, 1.1, 0), "legs": (0.2, 0.7, 0), "swivel": (0.06, 0.14, 0),
    "pads": (0.02, 0.05, 0), "computer": (0.12, 0.26, 0), "pedestal": (0.12, 0.7, 0),
}  # fmt: skip


def draw_plan(rng: Rng, body: str, foot: str) -> Plan:
    """Draw the sizes and materials of a monitor with a body on a foot."""
    height, thick, deep, bezel = (float(rng.uniform(*span)) for span in _RANGES[body])
    chin = bezel * rng.uniform(0.3, 2.5) if rng.random() < 0.5 else 0.0
    if body == "panel" and rng.random() < 0.25:
        height = rng.uniform(0.28, 0.48) if rng.random() < 0.5 else rng.uniform(1.2, 1.8)
    if foot in ("sheet", "hoop"):  # a computer is in the frame
        chin = rng.uniform(0.02, 0.24)
    side = rng.uniform(0.08, 0.14) if body == "tube" and rng.random() < 0.4 else 0.0
    height -= 1.6 * side
    first, last, tilt = _LOW[foot]
    frame = draw_housing(rng)
    wood = body == "console" or (foot == "legs" and rng.random() < 0.5)
    screen = Material((0.04, 0.05, rng.uniform(0.05, 0.12)))
    if rng.random() < 0.4:
        hue = pick_material(rng, "paint").color
        screen = Material(hue, "checker", 1.0) if rng.random() < 0.3 else Material(hue)
    frame = pick_material(rng, "wood") if wood else frame
    return Plan(
        width=0.6 if body == "array" else 1.0,
        height=height + chin,
        thick=thick,
        deep=deep,
        bezel=bezel,
        chin=chin,
        side=side,
        center=(0.0, rng.uniform(first, last) + (height + chin) / 2, 0.0),
        turn=about_y(rng.uniform(-35, 35) * (foot == "arm")) @ lean(rng.uniform(0, tilt)),
        frame=frame,
        back=frame if rng.random() < 0.6 else draw_housing(rng),
        stand=frame if rng.random() < 0.5 else pick_material(rng, "metal"),
        screen=screen,
        accent=pick_material(rng, draw(rng, ["metal", "paint"])),
    )
