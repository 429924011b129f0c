"""The forms of telephones: in one piece, hinged, sliding."""

from __future__ import annotations

from functools import partial

import numpy as np

from ffd_lightning.shapes.cellphone.plan import Body, Finish, Plan
from ffd_lightning.shapes.kit import Builder, Component, Rng
from ffd_lightning.shapes.kit.vectors import about_y, about_z, lean, vec

Pair = tuple[float, float]


def upright(width: float, height: float, depth: float) -> Body:
    """Return a body that stands on the ground, facing -z."""
    return Body(vec(0, height / 2, 0), width, height, depth, np.eye(3))


def whole(b: Builder, rng: Rng, f: Finish, width: Pair, depth: Pair, tip: Pair = (0, 0)) -> Plan:
    """Return a body in one piece, tipped back; `depth` is over its width."""
    del b
    wide, turn = rng.uniform(*width), lean(rng.uniform(*tip))
    deep = wide * rng.uniform(*depth)
    body = Body(turn @ vec(0, 0.55, 0), wide, 1.0, deep, turn)
    return Plan(body, None, body, wide * rng.uniform(0.03, 0.28), f)


def clamshell(b: Builder, rng: Rng, f: Finish, width: Pair, tall: Pair, shut: float) -> Plan:
    """Return two bodies on a barrel hinge, open by 100 to 178 degrees or shut."""
    wide, high, depth = rng.uniform(*width), rng.uniform(*tall), rng.uniform(0.05, 0.14)
    fold = 180.0 if rng.random() < shut else 180 - rng.uniform(100, 178)
    # The lid bends towards the viewer; the keys lean back so that the screen can be seen.
    pose = lean(0.0 if fold == 180 else fold * rng.uniform(0.5, 1.0))
    main = Body(pose @ vec(0, high / 2, 0), wide, high, depth, pose)
    tip, hinge = pose @ lean(-fold), main.at(0, 0.5)
    rise, deep = high * rng.uniform(0.85, 1.0), depth * rng.uniform(0.7, 1.0)
    lid = Body(hinge + tip @ vec(0, rise / 2, deep / 2), wide, rise, deep, tip)
    for x, material in ((-0.36, f.body), (0.0, f.trim), (0.36, f.body)):
        reach, middle = vec((0.2 if x == 0 else 0.1) * wide, 0, 0), hinge + vec(x * wide, 0, 0)
        b.cylinder("body", material, middle - reach, middle + reach, 0.5 * depth)
    return Plan(main, lid, main.strip(0, -0.48, 0.42), wide * rng.uniform(0.05, 0.3), f)


def slider(b: Builder, rng: Rng, f: Finish, way: str) -> Plan:
    """Return two bodies, the upper one slid up, slid aside, or swivelled across."""
    del b
    wide, tall, depth = rng.uniform(0.4, 0.62), rng.uniform(0.8, 0.95), rng.uniform(0.045, 0.12)
    slide, turn = rng.uniform(0.3, 0.46), about_z(90 if way == "swivel" else 0)
    main = upright(wide, tall, depth)
    if way == "aside":
        shift = vec(1.2 * slide * wide, 0, 0)
        keys = main.strip(0.6 * slide - 0.5, -0.48, 0.48, 1.2 * slide)
    elif way == "up":
        shift, keys = vec(0, slide * tall, 0), main.strip(0, -0.48, slide - 0.52)
    else:
        shift, keys = (
            vec(0, tall / 2 - 0.3 * wide, 0),
            main.strip(0, -0.48, 0.46 - 0.8 * wide / tall),
        )
    lid = Body(main.center + shift - vec(0, 0, 0.98 * depth), wide, tall, depth, turn)
    return Plan(main, lid, keys, wide * rng.uniform(0.04, 0.25), f)


def book(b: Builder, rng: Rng, f: Finish) -> Plan:
    """Return two bodies on an upright hinge, open like a book."""
    wide, tall, depth = rng.uniform(0.36, 0.62), rng.uniform(0.8, 1.0), rng.uniform(0.035, 0.09)
    half = rng.uniform(0, 40)
    main, lid = (
        Body(
            about_y(s * half) @ vec(s * wide / 2, tall / 2, depth / 2),
            wide,
            tall,
            depth,
            about_y(s * half),
        )
        for s in (-1, 1)
    )
    middle = vec(0, 0, depth / 2)
    top = middle + vec(0, 0.98 * tall, 0)
    b.cylinder("body", f.trim, middle + vec(0, 0.02 * tall, 0), top, 0.5 * depth)
    return Plan(main, lid, main, wide * rng.uniform(0.04, 0.14), f)


FORMS = (
    Component("slab", 7, partial(whole, width=(0.42, 0.9), depth=(0.08, 0.22))),
    Component("bar", 2.5, partial(whole, width=(0.28, 0.56), depth=(0.24, 0.6))),
    Component("brick", 2, partial(whole, width=(0.26, 0.48), depth=(0.6, 1.2))),
    Component("clamshell", 3, partial(clamshell, width=(0.38, 0.66), tall=(0.48, 0.64), shut=0.2)),
    Component("organiser", 1, partial(clamshell, width=(0.9, 1.3), tall=(0.44, 0.6), shut=0.1)),
    Component("up", 1.5, partial(slider, way="up")),
    Component("aside", 1.2, partial(slider, way="aside")),
    Component("swivel", 0.7, partial(slider, way="swivel")),
    Component("book", 1, book),
)
