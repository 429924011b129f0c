"""Tables on trestles."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.legs import add_leg, square_post
from ffd_lightning.shapes.table.tops import draw_materials, draw_size, rectangular_top


def trestle(rng: Rng) -> Builder:
    """Build a long top on two X, A, H or T trestles joined by a beam."""
    b = Builder()
    width, depth, height = draw_size(rng, "dining", "coffee", "bar")
    top, base = draw_materials(rng)
    thickness = rng.uniform(0.025, 0.06)
    rectangular_top(b, rng, top, (width, depth, height), thickness, rounding=0.45)
    under = height - thickness + 0.002
    kind = draw(rng, ["x", "a", "h", "t"])
    reach = width / 2 * rng.uniform(0.55, 0.82)
    spread = depth / 2 * rng.uniform(0.65, 0.85)
    side = rng.uniform(0.05, 0.09)
    for x in (-reach, reach):
        _trestle_end(b, base, kind, x, spread, under, side)
    level = {"x": 0.5, "a": 0.3, "h": rng.uniform(0.2, 0.4), "t": rng.uniform(0.2, 0.5)}[kind]
    y = level * under
    beam(b, "support", base, (-reach, y, 0), (reach, y, 0), width=0.5 * side, height=side)
    if rng.random() < 0.3:
        for x in (-reach, reach):
            end = (0.25 * x, under - 0.01, 0)
            beam(b, "support", base, (x, y, 0), end, width=0.5 * side, height=0.5 * side)
    return b


def _trestle_end(
    b: Builder, material: Material, kind: str, x: float, spread: float, top: float, side: float
) -> None:
    """Add one trestle at `x`: its feet and head reach +-`spread` along z."""
    post = square_post(side)
    ends = {"x": (-1.0, 1.0), "a": (0.3, 1.0), "h": (0.7, 0.7), "t": (0.0, 0.0)}[kind]
    for sign in (-1, 1) if kind != "t" else (1,):
        high = (x, top - 0.5 * side, sign * ends[0] * spread)
        low = (x, 0.0, sign * ends[1] * spread)
        add_leg(b, "leg", material, post, high, low, (0.8, 2.0 if kind == "t" else 1.0))
    head = (0.9 * side, side, 2 * spread + side)
    b.rounded_box("support", material, (x, top - side / 2, 0), head, 0.01)
    if kind in ("h", "t"):
        b.rounded_box("leg", material, (x, side / 2, 0), head, 0.2 * side)
    if kind == "a":
        start = (x, 0.3 * top, -0.75 * spread)
        end = (x, 0.3 * top, 0.75 * spread)
        beam(b, "support", material, start, end, width=0.5 * side, height=0.7 * side)
