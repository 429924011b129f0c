"""What a cabinet stands on."""

from __future__ import annotations

import numpy as np

from ffd_lightning.shapes.cabinet.joinery import plank
from ffd_lightning.shapes.cabinet.plan import Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng, nothing, pick_material
from ffd_lightning.shapes.kit.boards import rails
from ffd_lightning.shapes.kit.legs import add_legs, draw_leg_style, square_post
from ffd_lightning.shapes.kit.paths import corners
from ffd_lightning.shapes.kit.vectors import UP, vec


def plinth(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a box, flush with the front or set back."""
    low = (-0.49 * p.width, 0, -0.5 * p.depth + rng.uniform(0.0, 0.06))
    plank(b, "leg", p.style.body, low, (0.49 * p.width, p.foot + 0.003, 0.5 * p.depth))


def legs(b: Builder, rng: Rng, p: Plan, splay: float = 0.0) -> None:
    """Add four legs, straight or splayed, and two more below what is long."""
    style = draw_leg_style(rng, (0.03, 0.065), hairpin=0.15 if p.foot > 0.12 else 0.0)
    margin = 1.3 * style.thickness + splay
    tops = corners(p.width - margin, p.depth - margin, p.foot + 0.003)
    feet = tops * vec(1, 0, 1) + 0.4 * splay * np.sign(tops) * vec(1, 0, 1)
    if p.width > 1.6:
        tops = np.concatenate([tops, tops[[0, 2]] * vec(0, 1, 1)])
        feet = np.concatenate([feet, feet[[0, 2]] * vec(0, 1, 1)])
    add_legs(b, "leg", p.style.body, style, tops, feet)


def splayed(b: Builder, rng: Rng, p: Plan) -> None:
    """Add splayed legs."""
    legs(b, rng, p, splay=rng.uniform(0.06, 0.12))


def bracket(b: Builder, rng: Rng, p: Plan) -> None:
    """Add two short boards at each corner."""
    for foot in corners(p.width - 0.07, p.depth - 0.07, p.foot / 2):
        inward = np.sign(foot) * vec(1, 0, 1)
        b.box("leg", p.style.body, foot + inward * vec(-0.03, 0, 0.02), (0.13, p.foot, 0.025))
        b.box("leg", p.style.body, foot + inward * vec(0.02, 0, -0.03), (0.025, p.foot, 0.13))


def sled(b: Builder, rng: Rng, p: Plan) -> None:
    """Add a frame of bars."""
    side = rng.uniform(0.015, 0.035)
    metal = pick_material(rng, "metal") if rng.random() < 0.6 else p.style.body
    feet = corners(0.9 * p.width, 0.85 * p.depth, side / 2)
    for level in (0.0, p.foot - side):
        rails(b, "leg", metal, feet + level * UP, width=side, height=side)
    flat = feet * vec(1, 0, 1)
    add_legs(b, "leg", metal, square_post(side), flat + p.foot * UP, flat)


def casters(b: Builder, rng: Rng, p: Plan) -> None:
    """Add four wheels on forks."""
    metal, rubber = pick_material(rng, "metal"), pick_material(rng, "rubber")
    radius = p.foot / 2.3
    for x, _, z in corners(p.width - 0.09, p.depth - 0.09, 0):
        for side in (-0.012, 0.012):
            hub = vec(x + side, radius, z)
            b.cylinder("leg", rubber, hub - vec(0.007, 0, 0), hub + vec(0.007, 0, 0), radius)
        b.cylinder("leg", metal, (x, radius, z), (x, p.foot + 0.003, z), 0.012, segments=10)


_FIRM = ("drawers", "doors", "both", "sliding", "columns", "shelves")
_LIGHT = {"layout": _FIRM, "use": ("night", "chest", "low", "sideboard")}
STANDS = (
    Component("none", 1, nothing),
    Component("plinth", 1.3, plinth, {"layout": (*_FIRM, "files", "lockers")}),
    Component("legs", 3, legs, {"layout": (*_FIRM, "lockers")} | {"use": (*_LIGHT["use"], "tall")}),
    Component("splayed", 1.5, splayed, _LIGHT),
    Component("bracket", 1, bracket, {"layout": _FIRM}),
    Component("sled", 1.5, sled, _LIGHT),
    Component(
        "casters", 0.7, casters, {"layout": ("drawers", "files"), "use": ("night", "office")}
    ),
)
