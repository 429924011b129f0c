"""Seats of chairs, and shells that are seat and back in one."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.chair.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.boards import beam, slats
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.sections import eased_disc
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.upholstery import Seating, add_seat_cushions
from ffd_lightning.shapes.kit.vectors import Array, vec


def board(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a flat board with more or less rounded corners."""
    size, middle = (p.width, p.thick, p.depth), (0, p.seat - p.thick / 2, 0)
    b.rounded_box("seat", p.frame, middle, size, rng.uniform(0.01, 0.12), edge=0.4 * p.thick)


def cushion(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a board and a cushion on it."""
    board(b, rng, p)
    soft = rng.uniform(0.025, 0.06)
    size = (0.96 * p.width, soft, 0.94 * p.depth)
    b.rounded_box("seat", p.cover, (0, p.seat + 0.3 * soft, -0.01), size, rng.uniform(0.04, 0.1))


def pad(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a thick padded seat."""
    soft = rng.uniform(0.05, 0.11)
    middle = (0, p.seat - p.thick + soft / 2, 0)
    b.rounded_box("seat", p.cover, middle, (p.width, soft, p.depth), rng.uniform(0.03, 0.16))


def boards(b: Builder, rng: Rng, p: Plan) -> None:
    """Add boards or narrow slats across two rails."""
    count = int(rng.integers(4, 9))
    gap = p.depth / count
    first, last = (vec(0, p.seat - 0.01, s * (p.depth - gap) / 2) for s in (-1, 1))
    slats(b, "seat", p.frame, first, last, (p.width, 0.02, rng.uniform(0.6, 0.9) * gap), count)
    for x in (-0.42, 0.42):
        ends = vec(x * p.width, p.under, -p.depth / 2), vec(x * p.width, p.under, p.depth / 2)
        beam(b, "seat", p.frame, *ends, width=0.025, height=0.04)


def disc(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a round seat, a board or a cushion."""
    half = p.width / 2
    soft, material = (0.03, p.frame) if rng.random() < 0.5 else (rng.uniform(0.05, 0.1), p.cover)
    low = p.seat - p.thick
    rows = eased_disc(half, low, low + soft, 0.4 * soft)
    b.lathe("seat", material, [*rows, (0.4 * half, low + soft + 0.004)], segments=36)


def cushions(b: Builder, rng: Rng, s: Seating) -> None:
    """Add a loose cushion between padded arms."""
    add_seat_cushions(b, s, front=rng.uniform(0.0, 0.03))


def shell(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a moulded seat and back, curled up at the sides, sometimes into arms."""
    front = -p.depth / 2
    path = [vec(0, p.seat - 0.01, front - 0.03), vec(0, p.seat + 0.015, front + 0.05)]
    path += [vec(0, p.under + 0.005, 0.4 * p.depth), p.back(0, p.rise)]
    flat = _resample(bend(path, 0.16, 7), 30)
    s = np.linspace(0, 1, len(flat))
    normal = np.cross(np.gradient(flat, axis=0), (1, 0, 0))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    normal *= np.sign(normal[:, 1].mean())
    curl, arms = rng.uniform(0.01, 0.07), rng.uniform(0.1, 0.19) * (rng.random() < 0.4)
    lift = (curl + arms * np.exp(-(((s - 0.6) / 0.25) ** 2))) * (1 - 0.8 * np.clip(s - 0.85, 0, 1))
    taper = (1 - rng.uniform(-0.1, 0.35) * np.clip(s - 0.5, 0, 1)) * _rounded_ends(s)
    u = np.linspace(-1, 1, 17)
    power = rng.uniform(2, 4)
    grid = flat[:, None] + lift[:, None, None] * normal[:, None] * (np.abs(u) ** power)[:, None]
    grid[:, :, 0] = p.width / 2 * taper[:, None] * np.sin(1.3 * u) / np.sin(1.3)
    thickness, row = rng.uniform(0.01, 0.03), len(flat) // 2
    sheet(b, "seat", p.cover, grid[: row + 1], thickness)
    sheet(b, "back", p.cover, grid[row:], thickness)


def _resample(path: Array, count: int) -> Array:
    """Return `count` points evenly spaced along a polyline (p, 3)."""
    lengths = np.insert(np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1)), 0, 0)
    at = np.linspace(0, lengths[-1], count)
    return np.stack([np.interp(at, lengths, path[:, i]) for i in range(3)], 1)


def _rounded_ends(s: Array) -> Array:
    """Return the relative width along a sheet, s in [0, 1], that rounds its front and its top."""
    front, top = np.clip(1 - s / 0.12, 0, 1), np.clip((s - 0.78) / 0.22, 0, 1)
    return np.sqrt(1 - 0.35 * front**2) * np.sqrt(1 - 0.85 * top**2)


_PLAIN = ("legs", "tripod", "sled", "column", "rockers", "scissors", "sides")
SEATS = (
    Component("board", 3, board, {"base": _PLAIN}),
    Component("cushion", 2.5, cushion, {"base": (*_PLAIN, "cantilever")}),
    Component("pad", 2.5, pad, {"base": (*_PLAIN, "cantilever", "star")}),
    Component("boards", 1, boards, {"base": ("legs", "sled", "rockers", "scissors", "sides")}),
    Component("disc", 4, disc, {"base": ("tripod", "column"), "use": ("bar",)}),
    Component("shell", 1.2, shell, {"base": ("legs", "sled", "column", "star", "rockers")}),
    Component("cushions", 1, cushions, {"base": ("plinth",)}),
)
