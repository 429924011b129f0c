"""Benches: what they are for, a seat, what carries it, a back, arms, what is below."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from ffd_lightning.shapes.bench import backs, seats
from ffd_lightning.shapes.bench.plan import USES
from ffd_lightning.shapes.kit import Builder, Chosen, Component, Material, Product, Rng, nothing


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a bench of its components."""
    b, plan = Builder(), chosen["use"].build(rng, chosen["seat"].name)
    if chosen["seat"].name == "slab":
        grey = rng.uniform(0.45, 0.85)
        color = (grey, grey * rng.uniform(0.93, 1.0), grey * rng.uniform(0.82, 0.98))
        stone = Material(color, "speckle", 3.0, seed=int(rng.integers(1 << 30)))
        plan = replace(plan, wood=stone, frame=stone, cover=stone)
    for slot in _SLOTS:
        chosen[slot].build(b, rng, plan)
    return b


_BOARDED = {"use": ("garden", "hall", "row", "stool")}
_LEVEL = {"seat": ("boards", "board", "pad")}
_WOODEN = {"seat": ("boards", "board")}
_ROUND = {"use": ("round",)}
_SEATS = (
    Component("boards", 4, seats.boards, _BOARDED),
    Component("board", 3, seats.board, _BOARDED),
    Component("pad", 4, seats.pad, {"use": ("hall", "bed", "stool")}),
    Component("slab", 1, partial(seats.board, soft=0.0), {"use": ("stone",)}),
    Component("bows", 1, nothing, _ROUND),
    Component("pair", 1, nothing, {"use": ("picnic",)}),
)
_BASES = (
    Component("legs", 4, seats.legs, _LEVEL),
    Component("slabs", 1.5, seats.slabs, _WOODEN),
    Component("trestles", 1.5, seats.trestles, _LEVEL),
    Component("loops", 1.5, seats.loops, _LEVEL),
    Component("iron", 2, seats.iron, {"use": ("garden",), **_WOODEN}),
    Component("chest", 2.5, seats.chest, {"use": ("hall", "bed"), "seat": ("board", "pad")}),
    Component("blocks", 1, seats.blocks, {"seat": ("slab",)}),
    Component("bows", 1, seats.bows, _ROUND),
    Component("backed bows", 1, partial(seats.bows, backed=True), _ROUND),
    Component("picnic", 1, seats.picnic, {"use": ("picnic",)}),
)
_SAT = {"use": ("garden", "hall"), **_WOODEN}
_BACKS = (
    Component("open", 2, nothing),
    Component("slats", 2.5, backs.slats, _SAT),
    Component("bars", 2.5, backs.bars, _SAT),
    Component("cross", 1, backs.cross, _SAT),
    Component("panel", 1.5, backs.panel, _SAT),
    Component("padded", 2, backs.padded, {"use": ("hall", "bed"), "seat": ("pad",)}),
    Component("slab", 1.2, backs.padded, {"seat": ("slab",)}),
)
_POSTS = ("slats", "bars", "cross", "panel")
_ARMS = (
    Component("none", 2, nothing),
    Component("rests", 3, backs.rests, {"back": _POSTS}),
    Component("posts", 1, partial(backs.rests, backed=False), {**_SAT, "back": ("open",)}),
    Component("hoops", 1, backs.hoops, {"back": _POSTS, "base": ("iron", "loops")}),
    Component("ends", 1.5, backs.ends, {"use": ("hall",), "back": _POSTS}),
    Component("scrolls", 2, backs.scrolls, {"seat": ("pad",)}),
)
_BELOW = (
    Component("nothing", 1, nothing),
    Component("shelf", 1, seats.shelf, {"use": ("hall",), "base": ("legs", "slabs", "loops")}),
)
_SLOTS = {"seat": _SEATS, "base": _BASES, "back": _BACKS, "arms": _ARMS, "below": _BELOW}
CATEGORY = Product(
    parts=("seat", "back", "arm", "leg", "table"),
    slots={"use": USES, **_SLOTS},
    family=("base", "back"),
    assemble=assemble,
)
