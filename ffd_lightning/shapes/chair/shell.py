"""Chairs moulded in one piece."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style, stretchers
from ffd_lightning.shapes.kit.paths import bend, corners
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import UP, Array


def _resample(path: Array, count: int) -> Array:
    """Return `count` points evenly spaced along a polyline (p, 3)."""
    lengths = np.insert(np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)), 0, 0)
    at = np.linspace(0, lengths[-1], count)
    return np.stack([np.interp(at, lengths, path[:, i]) for i in range(3)], 1)


def _rounded_ends(s: Array) -> Array:
    """Return the relative width along a sheet, s in [0, 1], that rounds its front and its top."""
    front, top = np.clip(1 - s / 0.12, 0, 1), np.clip((s - 0.78) / 0.22, 0, 1)
    return np.sqrt(1 - 0.35 * front**2) * np.sqrt(1 - 0.85 * top**2)


def _moulded_seat(b: Builder, rng: Rng, material: Material, seat: float, half: float) -> None:
    """Add a one-piece seat and back, curled up at the sides, its lowest point near `seat`."""
    depth, rise, tip = rng.uniform(0.4, 0.48), rng.uniform(0.3, 0.5), rng.uniform(0.05, 0.14)
    path = [(seat + 0.01, -0.5 * depth - 0.03), (seat + 0.03, -0.42 * depth)]
    path += [(seat, 0.4 * depth), (seat + rise, 0.4 * depth + tip)]
    flat = _resample(bend([(0, y, z) for y, z in path], 0.16, 7), 30)
    s = np.linspace(0, 1, len(flat))
    normal = np.cross(np.gradient(flat, axis=0), (1, 0, 0))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.sign(normal[:, 1].mean())
    curl, arms = rng.uniform(0.02, 0.07), rng.uniform(0.1, 0.17) * (rng.random() < 0.45)
    lift = curl + arms * np.exp(-(((s - 0.6) / 0.25) ** 2))
    lift *= 1 - 0.8 * np.clip(s - 0.85, 0, 1) / 0.15
    taper = (1 - rng.uniform(0.0, 0.3) * np.clip(s - 0.5, 0, 1)) * _rounded_ends(s)
    u = np.linspace(-1, 1, 17)
    grid = flat[:, None] + lift[:, None, None] * normal[:, None] * (np.abs(u) ** 3)[None, :, None]
    grid[:, :, 0] = half * taper[:, None] * np.sin(1.3 * u) / np.sin(1.3)
    thickness, bend_row = rng.uniform(0.01, 0.02), len(flat) // 2
    sheet(b, "seat", material, grid[: bend_row + 1], thickness)
    sheet(b, "back", material, grid[bend_row:], thickness)


def shell(rng: Rng) -> Builder:
    """Build a moulded shell on splayed legs, a sled, rockers or one column."""
    b = Builder()
    shell = pick_material(rng, draw(rng, ["plastic", "paint", "wood"], [0.5, 0.3, 0.2]))
    base = pick_material(rng, draw(rng, ["metal", "wood"]))
    seat, half = rng.uniform(0.4, 0.47), rng.uniform(0.2, 0.27)
    _moulded_seat(b, rng, shell, seat, half)
    _shell_base(b, rng, base, seat, half)
    return b


def _shell_base(b: Builder, rng: Rng, base: Material, seat: float, half: float) -> None:
    """Add four legs, a sled, rockers or one column below a moulded seat of half width `half`."""
    kind = draw(rng, ["legs", "sled", "rockers", "column"], [0.4, 0.25, 0.15, 0.2])
    if kind == "column":
        foot = rng.uniform(0.2, 0.27)
        rows = [(foot, 0), (foot, 0.01), (0.08, 0.03), (0.025, 0.12), (0.025, seat - 0.05)]
        b.lathe("leg", base, [*rows, (0.1, seat + 0.002)], segments=32)
        return
    mount = corners(1.1 * half, 0.2, seat + 0.006)
    if kind == "sled":
        for x in (-1, 1):
            wide = x * (half - 0.01)
            path = [(x * 0.5 * half, seat + 0.01, -0.12), (wide, 0.01, -0.24)]
            path += [(wide, 0.01, 0.22), (x * 0.5 * half, seat, 0.1)]
            b.tube("leg", base, bend(path, 0.05), 0.009, segments=8)
        for point in (mount[:2], mount[2:]):
            b.cylinder("leg", base, point[0] - 0.01 * UP, point[1] - 0.01 * UP, 0.008, segments=8)
        return
    style = draw_leg_style(rng, (0.028, 0.042), hairpin=0.0)
    lift = 0.05 if kind == "rockers" else 0.0
    feet = corners(2 * half * rng.uniform(0.85, 1.05), rng.uniform(0.36, 0.46), lift)
    add_legs(b, "leg", base, style, mount, feet)
    if rng.random() < 0.6 or kind == "rockers":
        points, joint = feet + 0.55 * (mount - feet), draw(rng, ["box", "x", "h"])
        stretchers(b, "leg", base, points, 0.014, joint)
    if kind == "rockers":
        z = np.linspace(-0.36, 0.42, 13)
        for x in feet[:2, 0]:
            rocker = np.column_stack([np.full(13, x), 0.02 + 0.55 * z**2, z])
            b.tube("leg", base, rocker, 0.016, segments=8)
