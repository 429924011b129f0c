"""What drives a watercraft, if it shows: oars, outboard motors, paddle wheels, sails."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Component, Material, Rng, nothing
from ffd_lightning.shapes.kit.sheets import sheet
from ffd_lightning.shapes.kit.vectors import UP, Array, Pair, about_y, about_z, vec
from ffd_lightning.shapes.watercraft.plan import Plan, tint


def oars(b: Builder, rng: Rng, p: Plan) -> None:
    """Add pairs of oars in their locks, swung out."""
    swing, dip, pairs = rng.uniform(-25, 60), rng.uniform(-0.25, 0.0), int(rng.integers(1, 5))
    for t in np.linspace(0.4, 0.7, pairs) if pairs > 1 else [0.5]:
        for side in (-1, 1):
            lock, a = p.hull.edge(t, side, up=0.02), np.radians(swing)
            way = vec(side * np.cos(a), dip, np.sin(a))
            end, turn = lock + 0.3 * way, about_y(-side * swing) @ about_z(side * np.degrees(dip))
            b.cylinder("oar", p.deck, lock - 0.6 * p.hull.half(t) * way, end, 0.01, segments=8)
            b.rounded_box("oar", p.deck, end + 0.06 * way, (0.15, 0.012, 0.05), 0.02, turn=turn)


def outboards(b: Builder, rng: Rng, p: Plan) -> None:
    """Add one to four outboard motors behind the stern."""
    cowl, dark = tint(rng, "black", "white", "dark", "blue"), tint(rng, "dark")
    s, most = rng.uniform(0.7, 1.0), max(1, int(20 * p.hull.half(1)))
    count = int(rng.integers(1, min(4, most) + 1))
    for x in (np.arange(count) - (count - 1) / 2) * 0.1 * s:
        top = vec(x, p.hull.top(1) + 0.01, p.hull.z(1))
        low = top + s * vec(0, -0.17, 0.06)
        b.rounded_box("engine", cowl, top + s * vec(0, 0.06, 0.05), s * vec(0.08, 0.1, 0.12), 0.03)
        b.box("engine", dark, top + s * vec(0, -0.06, 0.05), s * vec(0.035, 0.24, 0.06))
        b.ellipsoid("engine", dark, low, s * vec(0.022, 0.022, 0.07), segments=10)
        for degrees in (0, 120, 240):
            turn, radii = about_z(degrees) @ about_y(35), 0.001 * s * vec(14, 30, 4)
            center = low + s * (turn @ vec(0, 0.025, 0) + vec(0, 0, 0.07))
            b.ellipsoid("engine", dark, center, radii, segments=8, turn=turn)


def _rope(b: Builder, start: ArrayLike, end: ArrayLike) -> None:
    """Add a stay."""
    b.cylinder("mast", Material((0.25, 0.22, 0.2)), start, end, 0.003, segments=5)


def _sail(b: Builder, cloth: Material, corners: ArrayLike, belly: ArrayLike) -> None:
    """Add a sail between four corners (4, 3): foot's fore and aft end, head's fore and aft end.

    `belly` (3,) is how far its middle is blown out.
    """
    tack, clew, head, peak = np.asarray(corners, float)
    u, v = np.linspace(0, 1, 8)[:, None, None], np.linspace(0, 1, 7)[None, :, None]
    flat = (1 - u) * ((1 - v) * tack + v * clew) + u * ((1 - v) * head + v * peak)
    full = np.sin(np.pi * v**0.8) * np.sin(np.pi * (0.1 + 0.9 * u) ** 0.7)
    sheet(b, "sail", cloth, flat + full * np.asarray(belly, float), 0.005)


def boomed(
    b: Builder, rng: Rng, p: Plan, cloth: Material, foot: Array, size: Pair, kind: str
) -> None:
    """Add a boom of `size`[1] and a "pointed", "gaff" or battened "junk" sail, or it furled."""
    (high, boom), swing = size, rng.uniform(-0.3, 0.3)
    away = boom * vec(np.sin(swing), 0.02, np.cos(swing))
    mid = vec(foot[0], max(foot[1] + 0.12 * high, p.roof + 0.03), foot[2] + 0.01)
    up, belly = (high + foot[1] - mid[1] - 0.03) * UP, vec(np.sign(swing) * 0.1 * boom, 0, 0)
    b.cylinder("mast", p.spar, mid - 0.012 * UP, mid + away - 0.012 * UP, 0.009, segments=8)
    throat, end = mid + rng.uniform(0.5, 0.7) * up, mid + 0.97 * away
    if rng.random() < 0.08:
        path = [mid + t * away for t in (0.02, 0.1, 0.5, 0.9, 0.98)]
        b.tube("sail", cloth, path, (0.016, 0.03, 0.028, 0.02, 0.01), segments=10)
    elif kind == "pointed":
        peak = mid + up + rng.uniform(0.03, 0.2) * away
        _sail(b, cloth, (mid, end, mid + up, peak), belly + 0.1 * away)
    elif kind == "gaff":
        peak = throat + 0.62 * away + 0.36 * up
        b.cylinder("mast", p.spar, throat, peak, 0.008, segments=8)
        _sail(b, cloth, (mid, end, throat, peak), belly)
    else:
        low = np.array([mid - 0.25 * away, end])
        top = np.array([mid + 0.88 * up - 0.2 * away, mid + up + 0.45 * away])
        _sail(b, cloth, [*low, *top], 0 * belly)
        for t in np.linspace(0, 1, int(rng.integers(4, 8))):
            left, right = low + t * (top - low)
            b.cylinder("mast", p.spar, left, right, 0.006, segments=6)


def lateen(b: Builder, rng: Rng, p: Plan, cloth: Material, foot: Array, size: Pair) -> None:
    """Add a slanted yard across a mast, and the three-cornered sail below it."""
    high, long = size[0], 1.1 * size[1]
    low = vec(0.01, max(foot[1] + 0.25 * high, p.roof + 0.05), foot[2] - 0.45 * long)
    peak = foot + vec(0.01, rng.uniform(1.0, 1.25) * high, 0.5 * long)
    b.cylinder("mast", p.spar, low, peak, 0.01, radius_end=0.006, segments=8)
    clew = vec(rng.uniform(-0.1, 0.1), max(foot[1] + 0.1 * high, p.roof + 0.03), peak[2])
    _sail(b, cloth, (low, clew, peak - 0.02 * UP, peak), (rng.uniform(-0.1, 0.1), 0, 0))


def square(b: Builder, rng: Rng, p: Plan, cloth: Material, foot: Array, size: Pair) -> None:
    """Add yards and square sails on a mast, each narrower than the one below."""
    tiers, start = int(rng.integers(1, 5)), max(0.16, (p.roof + 0.02 - foot[1]) / size[0])
    levels = np.linspace(start, 0.95, tiers + 1) * size[0]
    halves = rng.uniform(0.5, 0.75) * p.hull.beam * np.linspace(1.1, 0.55, tiers + 1)
    for i in range(tiers):
        low, high = (foot + vec(0, y, -0.02) for y in (levels[i] + 0.01, levels[i + 1]))
        bottom, top = vec(0.95 * halves[i], 0, 0), vec(halves[i + 1], 0, 0)
        b.cylinder("mast", p.spar, high - 1.08 * top, high + 1.08 * top, 0.007, segments=6)
        ends = (low - bottom, low + bottom, high - top, high + top)
        _sail(b, cloth, ends, (0, 0, -rng.uniform(0.03, 0.07)))


def _jibs(b: Builder, rng: Rng, p: Plan, cloth: Material, foot: Array, high: float) -> None:
    """Add a bowsprit or none, a forestay, and one to three headsails."""
    bow = p.hull.edge(0.02, 0, up=0.02)
    if rng.random() < 0.4 or p.hull.fineness < 0.2:
        start, bow = bow + vec(0, -0.02, 0.14), bow - vec(0, -0.04, rng.uniform(0.08, 0.24))
        b.cylinder("mast", p.spar, start, bow, 0.01, segments=8)
    head = foot + vec(0, rng.uniform(0.7, 0.95) * high, -0.02)
    _rope(b, bow, head)
    side, count = rng.choice([-0.07, 0.07]), int(rng.integers(1, 4))
    for i in range(count):
        start = bow + 0.25 * i * (foot - bow) * vec(1, 0, 1)
        tack, peak = start + 0.05 * (head - start), start + (0.92 - 0.12 * i) * (head - start)
        reach = (rng.uniform(0.8, 1.25) if count == 1 else 0.62) * (foot - start) * vec(1, 0, 1)
        clew = start + reach + vec(side, 0.07, 0)
        _sail(b, cloth, (tack, clew, peak, peak + vec(0, 0, 0.012)), (0.7 * side, 0, 0.02))


def sails(b: Builder, rng: Rng, p: Plan, masts: tuple[int, int], kind: str, jibs: float) -> None:
    """Add a number of masts with stays, sails of a kind, and headsails as often as `jibs`."""
    plain = tint(rng, "white", "white", "white", "cream", "red", "orange", "blue")
    cloth = replace(plain, pattern="stripes", scale=1.2) if rng.random() < 0.2 else plain
    count = int(rng.integers(masts[0], masts[1] + 1))
    places = np.linspace(0.2, 0.76, count) if count > 1 else np.array([rng.uniform(0.32, 0.46)])
    high = rng.uniform(0.75, 1.4) if count == 1 else rng.uniform(0.5, 0.95)
    slope = rng.uniform(-0.25, 0.3) if count == 2 else 0.0
    for i, t in enumerate(places):
        foot, tall = p.hull.edge(t, 0, up=-0.02), high * (1.0, 1.12, 0.95, 0.8)[i] * (1 - slope * i)
        b.cylinder("mast", p.spar, foot, foot + tall * UP, 0.013, radius_end=0.007, segments=10)
        last, add = i == count - 1, {"lateen": lateen, "square": square}.get(kind)
        size = (tall, 0.88 * ((0.96 if last else places[i + 1]) - t))
        if add and (kind == "lateen" or count == 1 or not last):
            add(b, rng, p, cloth, foot, size)
        else:  # the hindmost of square-rigged masts has a boom
            boomed(b, rng, p, cloth, foot, size, "gaff" if kind == "square" else kind)
        for side in (-1, 1):
            _rope(b, p.hull.edge(t, side, 0.01), foot + rng.uniform(0.6, 0.9) * tall * UP)
    if rng.random() < jibs:
        _jibs(b, rng, p, cloth, p.hull.edge(places[0], 0), high)


def _rig(
    name: str, weight: float, masts: tuple[int, int], kind: str, jibs: float, *hulls: str
) -> Component:
    """Return sails of a kind on a number of masts that go with some hulls."""
    houses = ("open", "coachroof", "wheelhouse", "castle")
    needs = {"hull": hulls, "house": houses, "top": ("bare",)}
    return Component.of(name, weight, sails, needs, masts=masts, kind=kind, jibs=jibs)


_ENGINED = ("planing", "tub", "freighter", "liner", "navy", "barge", "submarine")
RIGS = (
    Component("engine", 3, nothing, {"hull": _ENGINED}),
    Component("engine", 2, nothing, {"hull": ("catamaran",), "house": ("decks",)}),
    Component("engine", 2, nothing, {"hull": ("catamaran",), "top": ("canopy", "pole")}),
    Component("oars", 3, oars, {"hull": ("skiff", "canoe")}),
    Component("outboards", 2, outboards, {"hull": ("skiff",)}),
    Component("outboards", 3, outboards, {"house": ("cockpit",)}),
    _rig("sloop", 3, (1, 1), "pointed", 0.9, "yacht", "catamaran", "skiff", "tub"),
    _rig("gaff", 1, (1, 1), "gaff", 0.8, "yacht", "catamaran", "skiff", "tub"),
    _rig("ketch", 1, (2, 2), "pointed", 1, "yacht", "tub"),
    _rig("schooner", 1, (2, 4), "gaff", 1, "yacht", "galleon"),
    _rig("junk", 0.6, (1, 3), "junk", 0, "yacht", "galleon", "skiff"),
    _rig("lateen", 0.7, (1, 2), "lateen", 0, "galleon", "skiff", "canoe"),
    _rig("square", 3, (1, 4), "square", 0.9, "galleon"),
)
