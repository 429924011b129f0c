"""Masts, sails and ropes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import UP, Array, vec
from ffd_lightning.shapes.watercraft.hull import Hull, tint

_LINE = 0.0035  # radius of ropes
_ALLOY = Material((0.55, 0.57, 0.6))


def add_rope(b: Builder, start: ArrayLike, end: ArrayLike) -> None:
    """Add a stay."""
    b.cylinder("mast", Material((0.25, 0.22, 0.2)), start, end, _LINE, segments=5)


def add_sail(
    b: Builder, cloth: Material, corners: ArrayLike, belly: ArrayLike, rows: int = 9, cols: int = 7
) -> None:
    """Add a sail between four corners (4, 3): foot's fore and aft end, head's fore and aft end.

    `belly` (3,) is how far its middle is blown out.
    """
    tack, clew, head, peak = np.asarray(corners, float)
    u = np.linspace(0, 1, rows)[:, None, None]
    v = np.linspace(0, 1, cols)[None, :, None]
    flat = (1 - u) * ((1 - v) * tack + v * clew) + u * ((1 - v) * head + v * peak)
    full = np.sin(np.pi * v**0.8) * np.sin(np.pi * (0.1 + 0.9 * u) ** 0.7)
    sheet(b, "sail", cloth, flat + full * np.asarray(belly, float), 0.006)


def draw_cloth(rng: Rng) -> Material:
    """Draw a sail's cloth: mostly white, sometimes tanned, coloured or striped."""
    plain = tint(rng, "white", "white", "white", "cream", "red", "orange", "blue")
    return replace(plain, pattern="stripes", scale=1.2) if rng.random() < 0.2 else plain


def add_rig(
    b: Builder, rng: Rng, spar: Material, cloth: Material, foot: Array, height: float, boom: float
) -> None:
    """Add a mast, a boom and its mainsail: pointed, gaff-headed, or furled on the boom."""
    top = foot + height * UP
    b.cylinder("mast", spar, foot, top, radius=0.014, radius_end=0.009, segments=10)
    low = foot + (rng.uniform(0.1, 0.14) + 0.05 * height) * UP
    swing = rng.uniform(-0.25, 0.25)
    away = vec(np.sin(swing), 0.02, np.cos(swing)) * boom
    b.cylinder("mast", spar, low, low + away, 0.011, segments=8)
    belly = vec(np.sign(swing) * 0.08 * boom, 0, 0)
    kind = draw(rng, ["pointed", "gaff", "furled"], [0.65, 0.2, 0.15])
    mid, up = low + vec(0, 0.02, 0.012), height - (low - foot)[1] - 0.04
    if kind == "pointed":
        head = mid + up * UP
        roach = rng.uniform(0.03, 0.16) * away
        add_sail(b, cloth, (mid, mid + 0.97 * away, head, head + roach), belly + 0.1 * away)
    elif kind == "gaff":
        throat = mid + 0.6 * up * UP
        peak = throat + 0.62 * away + 0.36 * up * UP
        b.cylinder("mast", spar, throat, peak, 0.009, segments=8)
        add_sail(b, cloth, (mid, mid + 0.97 * away, throat, peak), belly)
    else:
        path = [mid + t * away + 0.012 * UP for t in (0.02, 0.1, 0.5, 0.9, 0.98)]
        b.tube("sail", cloth, path, (0.02, 0.035, 0.032, 0.024, 0.012), segments=10)


def add_stays(b: Builder, hull: Hull, foot: Array, height: float, t: float) -> None:
    """Add the shrouds and the backstay of a mast at station `t`, with spreaders."""
    top, half = foot + 0.97 * height * UP, hull.half(t) + abs(hull.x)
    for side in (-1, 1):
        spreader = foot + vec(side * 0.45 * half, 0.55 * height, 0)
        start = foot + 0.55 * height * UP
        b.cylinder("mast", _ALLOY, start, spreader, 0.006, segments=6)
        chain = (side * 0.95 * half, hull.top(t), foot[2] + 0.02)
        add_rope(b, chain, spreader)
        add_rope(b, spreader, top)


def add_jibs(b: Builder, rng: Rng, cloth: Material, bow: Array, foot: Array, height: float) -> None:
    """Add a forestay and one or two headsails from `bow` to the mast, or a furled one."""
    head = foot + vec(0, rng.uniform(0.75, 0.95) * height, -0.02)
    add_rope(b, bow, head)
    if rng.random() < 0.2:
        path = [bow + t * (head - bow) for t in (0.04, 0.2, 0.9)]
        b.tube("sail", cloth, path, (0.01, 0.018, 0.01), segments=8)
        return
    side = rng.choice([-1.0, 1.0])
    overlap, count = rng.uniform(-0.1, 0.25), 1 if rng.random() < 0.75 else 2
    for i in range(count):
        start = bow + 0.35 * i * (foot - bow) * vec(1, 0, 1)
        tack, peak = start + 0.05 * (head - start), start + (0.92 - 0.12 * i) * (head - start)
        reach = (1 + overlap) * (foot - start) if count == 1 else 0.62 * (foot - start)
        clew = start + reach * vec(1, 0, 1) + vec(side * 0.08, 0.08, 0)
        add_sail(b, cloth, (tack, clew, peak, peak + vec(0, 0, 0.012)), (side * 0.05, 0, 0.02))
