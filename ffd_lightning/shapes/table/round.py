"""Round and oval tables on legs."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Rng, draw
from ffd_lightning.shapes.kit.boards import beam, rails
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style
from ffd_lightning.shapes.kit.paths import circle
from ffd_lightning.shapes.kit.vectors import UP, vec
from ffd_lightning.shapes.table.tops import SIZES, draw_materials, round_top


def round_table(rng: Rng) -> Builder:
    """Build a round or oval top on three to five legs, or a drum."""
    b = Builder()
    top, base = draw_materials(rng)
    height = rng.uniform(*SIZES[draw(rng, ["dining", "bar", "side", "coffee"])].height)
    radius = rng.uniform(0.22, 0.4) if rng.random() < 0.5 or height > 0.8 else rng.uniform(0.4, 0.7)
    squash = rng.uniform(0.6, 0.85) if rng.random() < 0.25 else 1.0
    thickness = rng.uniform(0.02, 0.05)
    round_top(b, top, radius, height, thickness, squash)
    under, oval = height - thickness + 0.002, vec(1, 1, squash)
    if rng.random() < 0.12:
        waist = radius * rng.uniform(0.45, 0.95)
        rows = [(0.85 * radius, 0), (waist, under / 2), (0.85 * radius, under)]
        b.lathe("leg", base, rows, segments=40, squash=squash)
        return b
    style = draw_leg_style(rng, (0.035, 0.06))
    count = int(rng.integers(3, 6))
    turn = 90.0 + 180.0 / count
    tops = circle(count, radius * rng.uniform(0.55, 0.8), under, turn) * oval
    feet = circle(count, radius * rng.uniform(0.7, 1.05), height=0, degrees=turn) * oval
    add_legs(b, "leg", base, style, tops, feet)
    kind = draw(rng, ["none", "shelf", "apron", "spokes"], [0.25, 0.3, 0.3, 0.15])
    level = rng.uniform(0.2, 0.4)
    points = feet + level * (tops - feet)
    if kind == "shelf":
        reach = float(np.linalg.norm((points / oval)[0, [0, 2]]))
        low = level * under
        round_top(b, base, 1.02 * reach, low, thickness=0.02, squash=squash, part="shelf")
    elif kind == "apron" and style.plain:
        rails(b, "support", base, feet + 0.94 * (tops - feet), width=0.02, height=0.11 * under)
    elif kind == "spokes" and style.plain:
        hub = vec(0, level * under, 0)
        for point in points:
            beam(b, "support", base, point, hub, width=0.025, height=0.025)
        b.cylinder("support", base, hub - 0.02 * UP, hub + 0.02 * UP, 0.045)
    return b
