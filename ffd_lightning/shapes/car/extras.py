"""What is added to cars: wheels, loads on the roof, spoilers, beds and what is on them."""

import numpy as np

from ffd_lightning.shapes.car.bodies import walls
from ffd_lightning.shapes.car.cabins import Cabin
from ffd_lightning.shapes.car.plan import BLACK, CHROME, Plan
from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, nothing, pick_material
from ffd_lightning.shapes.kit.boards import beam
from ffd_lightning.shapes.kit.paths import bend
from ffd_lightning.shapes.kit.vectors import about_z, lean, vec


def wheels(b: Builder, rng: Rng, p: Plan, counts: range) -> None:
    """Add two wheels to every axle, all alike, with one of `counts` of spokes, or discs for 0."""
    spokes = int(rng.integers(counts.start, counts.stop))
    w, radius, rim = p.radius * rng.uniform(0.25, 0.4), p.radius, p.radius * rng.uniform(0.5, 0.76)
    metal = CHROME if rng.random() < 0.6 else pick_material(rng, "metal")
    tyre = [(rim, -w), (0.93 * radius, -w), (radius, -0.6 * w), (radius, 0.6 * w)]
    tyre += [(0.93 * radius, w), (rim, 0.9 * w), (0.97 * rim, 0.4 * w)]
    plate = np.array([(0.97, 0.4), (0.97, 0.51), (0.45, 0.7), (0.1, 0.75)]) * (rim, w)
    cap = np.array([(0.22, 0.45), (0.2, 0.95), (0.05, 1.05)]) * (rim, w)
    for axle in p.axles:
        for side in (-1, 1):
            turn = about_z(-90 * side)
            x = (p.half(axle) - 0.02 if p.arch else p.track / 2) - w
            hub = vec(side * x, radius, axle)
            b.lathe("wheel", Material((0.09,) * 3), tyre, hub, segments=18, turn=turn)
            b.lathe("wheel", BLACK if spokes else metal, plate, hub, segments=14, turn=turn)
            b.lathe("wheel", metal, cap, hub, segments=8, turn=turn)
            for i in range(spokes):
                spin, size = lean(360 * i / spokes), (0.2 * w, rim, min(1.1 / spokes, 0.3) * rim)
                arm = hub + spin @ vec(0.75 * w * side, 0.5 * rim, 0)
                b.box("wheel", metal, arm, size, turn=spin)


def rails(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add two rails along the roof, with or without cross-bars."""
    front, rear, y, half = c.roof[0] + 0.12, c.roof[1] - 0.1, c.height + 0.07, c.wide(p)
    for side in (-half, half):
        beam(b, "trim", BLACK, (side, y, front), (side, y, rear), width=0.035, height=0.035)
        for z in (front + 0.03, rear - 0.03):
            b.box("trim", BLACK, (side, y - 0.07, z), (0.035, 0.16, 0.06))
    for t in np.linspace(0.2, 0.8, int(rng.integers(0, 5))):
        z = front + t * (rear - front)
        beam(b, "trim", BLACK, (-half, y, z), (half, y, z), width=0.05, height=0.025)


def carrier(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add two bars across the roof and on them a rounded box or a crate."""
    half, y, middle = c.wide(p), c.height + 0.05, sum(c.roof) / 2
    long = c.roof[1] - c.roof[0]
    for z in (middle - 0.25 * long, middle + 0.25 * long):
        beam(b, "trim", BLACK, (-half, y, z), (half, y, z), width=0.05, height=0.03)
        for x in (-0.95 * half, 0.95 * half):
            b.box("trim", BLACK, (x, y - 0.07, z), (0.05, 0.18, 0.05))
    size = (half * rng.uniform(0.8, 1.9), rng.uniform(0.15, 0.45), max(1.0, 0.9 * long))
    material = BLACK if rng.random() < 0.5 else pick_material(rng, "leather")
    center = (0, y + 0.01 + size[1] / 2, middle)
    b.rounded_box("trim", material, center, size, rng.uniform(0.04, 0.2))


def sign(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add a taxi's sign or a bar of blue lights."""
    wide, z = c.wide(p) * rng.uniform(0.4, 1.7), 0.7 * c.roof[0] + 0.3 * c.roof[1]
    color = (0.95, 0.8, 0.2) if wide < 0.9 * c.wide(p) else (0.1, 0.2, 0.9)
    b.rounded_box("light", Material(color), (0, c.height + 0.05, z), (wide, 0.16, 0.22), 0.05)


def spoiler(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add a wing on two struts over the tail."""
    z = p.length / 2 - rng.uniform(0.14, 0.24)
    y, rise, half = p.top(z), rng.uniform(0.08, 0.32), 0.9 * p.half(z)
    size = (2 * half, 0.045, rng.uniform(0.18, 0.34))
    b.rounded_box("trim", p.second, (0, y + rise, z + 0.04), size, radius=0.06, edge=0.02)
    for side in (-0.7, 0.7):
        foot, head = (side * half, y - 0.05, z), (side * half, y + rise, z + 0.03)
        beam(b, "trim", p.second, foot, head, width=0.04, height=0.12)


def lip(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add a spoiler that continues the roof over the rear window."""
    size = (1.68 * p.half(c.roof[1]) * (1 - c.tumble), 0.05, rng.uniform(0.25, 0.45))
    center = (0, c.height - c.drop - 0.01, c.roof[1] + 0.05)
    b.rounded_box("trim", p.roof, center, size, radius=0.06, edge=0.02, turn=lean(5))


def spare(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Hang a spare wheel on the tail."""
    profile = [(0.3, -0.1), (0.9, -0.1), (1, -0.04), (1, 0.06), (0.9, 0.14), (0.55, 0.15)]
    rows = np.array([*profile, (0.05, 0.16)]) * (0.86 * p.radius, 1)
    center = (0, max(0.62 * p.belt, p.clearance + 0.95 * p.radius), p.length / 2 + 0.06)
    b.lathe("wheel", BLACK, rows, center, segments=24, turn=lean(90))


def bed(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add the walls of an open bed, sometimes a hoop or a cover."""
    ends = (c.feet[1] + 0.03, p.length / 2 - 0.01)
    walls(b, p, ends, (p.least - 0.2, p.belt), thick=0.07, closed=True)
    kind, z, high = rng.random(), ends[0] + 0.2, p.belt + rng.uniform(0.3, 0.6)
    x = 0.9 * p.half(z)
    if kind < 0.3:
        hoop = [(-x, p.belt - 0.05, z), (-0.85 * x, high, z), (0.85 * x, high, z)]
        b.tube("trim", CHROME, bend([*hoop, (x, p.belt - 0.05, z)], 0.12, 3), 0.03, segments=8)
    elif kind < 0.5:
        size = (1.9 * x, high - p.belt + 0.1, ends[1] - ends[0] - 0.04)
        b.rounded_box("body", p.second, (0, (high + p.belt) / 2 - 0.05, sum(ends) / 2), size, 0.1)


def crate(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add a closed box."""
    start, end = c.feet[1] + 0.06, p.length / 2
    size = (p.width, max(rng.uniform(0.8, 1.4) * (c.height - p.least), 0.9), end - start)
    middle = (0, p.least + size[1] / 2, (start + end) / 2)
    b.rounded_box("body", p.second, middle, size, rng.uniform(0.03, 0.12))


def flatbed(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add a platform between low fences."""
    start, end = c.feet[1] + 0.08, p.length / 2
    y, long, wide, tall = p.least + 0.05, end - start, 1.04 * p.width, rng.uniform(0.2, 0.9)
    b.box("body", p.second, (0, y, (start + end) / 2), (wide, 0.1, long))
    size = (wide, 0.7 * (c.height - y), 0.06)
    b.box("body", p.second, (0, y + size[1] / 2, start + 0.03), size)
    for side in (-0.49 * wide, 0.49 * wide):
        for z in np.linspace(start + 0.1, end - 0.05, 5):
            b.box("trim", BLACK, (side, y + tall / 2, z), (0.06, tall, 0.06))
        for level in np.array([0.3, 0.6, 0.9]) * tall:
            b.box("trim", p.second, (side, y + level, (start + end) / 2), (0.03, 0.1, long))


def tank(b: Builder, rng: Rng, p: Plan, c: Cabin) -> None:
    """Add a tank on saddles."""
    start, long, r = c.feet[1] + 0.15, p.length / 2 - c.feet[1] - 0.2, 0.4 * p.width
    rows = [(0.7 * r, 0), (r, 0.15), (r, long - 0.15), (0.7 * r, long)]
    y = p.least + 0.1 + r
    b.lathe("body", p.second, rows, (0, y, start), segments=28, turn=lean(90))
    for z in np.linspace(start + 0.4, start + long - 0.4, 3):
        b.box("body", BLACK, (0, y - 0.8 * r, z), (1.3 * r, r, 0.3))


WHEELS = (
    Component.of("spokes", 2, wheels, counts=range(5, 9)),
    Component.of("wire", 0.6, wheels, counts=range(14, 15)),
    Component.of("disc", 0.9, wheels, counts=range(1)),
)
_ROOFED = ("notchback", "hatch", "estate", "minivan", "box")
ROOFS = (
    Component("bare", 8, nothing),
    Component("rails", 1.5, rails, {"cabin": ("windows", *_ROOFED[1:])}),
    Component("carrier", 0.9, carrier, {"cabin": _ROOFED}),
    Component("sign", 0.4, sign, {"cabin": _ROOFED}),
)
_DECKED, _FLAT = ("boot", "drop", "duck"), {"tail": ("flat",)}
REARS = (
    Component("plain", 3, nothing, {"tail": (*_DECKED, "hatch", "wing")}),
    Component("spoiler", 1, spoiler, {"tail": _DECKED, "use": ("compact", "family", "sports")}),
    Component("lip", 1, lip, {"cabin": ("hatch", "minivan")}),
    Component("spare", 2, spare, {"cabin": ("box",)}),
    Component("bed", 2.5, bed, {**_FLAT, "use": ("pickup", "vintage")}),
    Component("crate", 1, crate, _FLAT),
    Component("flatbed", 0.7, flatbed, _FLAT),
    Component("tank", 0.5, tank, {"use": ("lorry",)}),
)
