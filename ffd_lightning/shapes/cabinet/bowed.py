"""Cabinets whose plan is no rectangle: bow fronts, half rounds, drums and corner cupboards."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ffd_lightning.shapes.cabinet.joinery import BOARD, Joinery, draw_joinery
from ffd_lightning.shapes.kit import Builder, Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, vec


def bowed(rng: Rng) -> Builder:
    """Build a cabinet on a bowed, half-round, round, quarter-round or five-cornered plan."""
    b = Builder()
    style = draw_joinery(rng)
    kind = draw(rng, ["bow", "demilune", "drum", "quarter", "corner"])
    size = rng.uniform(0.35, 0.6) if kind == "drum" else rng.uniform(0.55, 1.2)
    path, rear = _plan(rng, kind, size)
    tall = kind in ("quarter", "corner") and rng.random() < 0.6
    height = rng.uniform(1.2, 1.9) if tall else rng.uniform(0.45, 0.9)
    base = _feet(b, rng, style, np.concatenate([path, rear]), kind == "drum")
    plan = np.concatenate([path, rear])
    _prism(b, "body", style.body, plan, (base, base + height), 1.0)
    top = style.body if rng.random() < 0.5 else pick_material(rng, "wood")
    _prism(b, "top", top, plan, (base + height - 0.002, base + height + 0.03), rng.uniform(1, 1.06))
    split = rng.uniform(0.55, 0.8)
    rows = {"doors": (("door", 0.0, 1.0),), "drawers": _drawer_rows(rng)}
    rows["both"] = (("door", 0.0, split), ("drawer", split, 1.0))
    rows["pair"] = (("door", 0.0, 1 - split), ("door", 1 - split, 1.0))
    layout = draw(rng, ["doors", "drawers", "both"]) if not tall else draw(rng, ["pair", "both"])
    for part, low, high in rows[layout]:
        columns = 2 if part == "door" and size > 0.5 else 1
        levels = (base + 0.03 + low * (height - 0.06), base + 0.03 + high * (height - 0.06))
        for i in range(columns):
            span = ((i + 0.02) / columns, (i + 0.98) / columns)
            _curved_front(b, style, part, path, span, levels, -1 if i else 1)
    return b


def _drawer_rows(rng: Rng) -> tuple[tuple[str, float, float], ...]:
    """Draw two to five equal drawers, from 0 to 1."""
    ends = np.linspace(0, 1, int(rng.integers(3, 7)))
    return tuple(("drawer", a, c) for a, c in pairwise(ends))


def _plan(rng: Rng, kind: str, size: float) -> tuple[Array, Array]:
    """Return the front (n, 2) from -x to +x that takes doors, and the rest of the plan, as x, z."""
    t = np.linspace(0, 1, 13)
    half, depth = size / 2, rng.uniform(0.35, 0.5) * max(size, 0.6)
    x = size * (t - 0.5)
    if kind == "bow":
        bulge = rng.uniform(0.06, 0.16) * size
        front = np.stack([x, -depth / 2 - bulge * np.sin(np.pi * t)], 1)
        return front, np.array([(half, depth / 2), (-half, depth / 2)])
    if kind == "demilune":
        angle = np.pi * np.linspace(0.06, 0.94, 13)
        front = np.stack([-half * np.cos(angle), depth * (0.5 - np.sin(angle))], 1)
        return front, np.array([(half, depth / 2), (-half, depth / 2)])
    if kind == "drum":
        angle = np.pi * np.linspace(0.1, 1.9, 33)
        ring = half * np.stack([np.sin(angle), np.cos(angle)], 1)
        return ring[9:24][::-1], np.concatenate([ring[:9][::-1], ring[24:][::-1]])
    side = rng.uniform(0.2, 0.35) * half  # how far the sides of a corner cupboard stand out
    if kind == "corner":
        front = np.stack([0.62 * x, np.full(13, -half)], 1)
        wing = half - 0.38 * half
        rear = [(half, wing - half), (0, half * 0.85), (-half, wing - half)]
        return front, np.array(rear)
    bulge = rng.uniform(0.25, 0.45) * size
    front = np.stack([x, -bulge * np.sin(np.pi * t) ** 0.8 - side / 2], 1)
    return front, np.array([(half, 0.05), (0, half + 0.05), (-half, 0.05)])


def _prism(
    b: Builder, part: str, material: Material, plan: Array, levels: Pair, grow: float
) -> None:
    """Add the plan (n, 2) scaled by `grow` between two `levels`."""
    center = np.array([plan[:, 0].mean(), (plan[:, 1].min() + plan[:, 1].max()) / 2])
    flat = (plan - center) * grow + center
    b.loft(part, material, [np.insert(flat, 1, y, axis=1) for y in levels])


def _feet(b: Builder, rng: Rng, style: Joinery, plan: Array, round_plan: bool) -> float:
    """Add legs under the plan's corners or a plinth; return their height."""
    if rng.random() < 0.35:
        _prism(b, "leg", style.body, plan, (0.0, 0.062), 0.93)
        return 0.06
    rise = rng.uniform(0.08, 0.3)
    leg = draw_leg_style(rng, (0.03, 0.05), hairpin=0.1)
    low, high = plan.min(0), plan.max(0)
    middle = (low + high) / 2
    picks = np.linspace(0, len(plan), 4 if round_plan else 5)[:-1].astype(int)
    if not round_plan:
        picks = np.array([2, 10, *range(13, len(plan))])
    tops = np.insert((plan[picks] - middle) * 0.82 + middle, 1, rise + 0.003, axis=1)
    add_legs(b, "leg", style.body, leg, tops, tops * vec(1, 0, 1))
    return rise


def _curved_front(
    b: Builder, style: Joinery, part: str, path: Array, span: Pair, levels: Pair, side: int
) -> None:
    """Add a door or drawer on the stretch `span` (0 to 1) of the front, its handle at `side`."""
    t = np.linspace(0, 1, len(path))
    along = np.linspace(*span, 13)
    flat = np.stack([np.interp(along, t, path[:, i]) for i in (0, 1)], 1)
    run = np.gradient(flat, axis=0)
    normal = np.stack([run[:, 1], -run[:, 0]], 1) / np.linalg.norm(run, axis=1, keepdims=True)
    gap = 0.008
    heights = np.array([levels[0] + gap, levels[1] - gap])
    place = flat + 0.5 * BOARD * normal
    grid = [np.insert(place, 1, y, axis=1) for y in heights]
    sheet(b, part, style.front, np.array(grid), BOARD)
    if style.panel != "flat":
        inset = 0.15 * (heights[1] - heights[0]) * np.array([1, -1])
        inner = (place + 0.5 * BOARD * normal)[1:-1]
        raised = [np.insert(inner, 1, y, axis=1) for y in heights + np.clip(inset, -0.06, 0.06)]
        sheet(b, part, style.front, np.array(raised), 0.012)
    spot = (11 if side > 0 else 1) if part == "door" else 6
    start = np.insert(flat[spot] + BOARD * normal[spot], 1, heights.mean())
    across = np.insert(run[spot] / np.linalg.norm(run[spot]), 1, 0.0)
    _handle(b, style, start, np.insert(normal[spot], 1, 0.0), UP if part == "door" else across)


def _handle(b: Builder, style: Joinery, start: Array, out: Array, along: Array) -> None:
    """Add a knob, or a bar `along`, that stands `out` from `start`."""
    if style.grip in ("knob", "bow", "none"):
        path = start + np.outer((-0.005, 0.014, 0.018, 0.026, 0.034), out)
        b.tube("handle", style.handle, path, (0.006, 0.006, 0.015, 0.017, 0.006), segments=10)
        return
    ends = start + 0.02 * out - 0.07 * along, start + 0.02 * out + 0.07 * along
    b.cylinder("handle", style.handle, *ends, 0.009, segments=8)
    for t in (-0.05, 0.05):
        foot = start + t * along
        b.cylinder("handle", style.handle, foot - 0.01 * out, foot + 0.02 * out, 0.006, segments=6)
