"""Benches: park, plank, picnic, upholstered, settle, stone, curved, spindle-backed."""

from __future__ import annotations

from ffd_lightning.shapes.bench.backed import settle, spindle
from ffd_lightning.shapes.bench.curved import curved
from ffd_lightning.shapes.bench.park import park
from ffd_lightning.shapes.bench.plank import picnic, plank
from ffd_lightning.shapes.bench.stone import stone
from ffd_lightning.shapes.bench.upholstered import upholstered
from ffd_lightning.shapes.kit.builder import Family

PARTS = ("seat", "back", "arm", "leg", "table")
FAMILIES: dict[str, Family] = {
    "park": park, "plank": plank, "picnic": picnic, "upholstered": upholstered, "settle": settle,
    "stone": stone, "curved": curved, "spindle": spindle,
}  # fmt: skip
