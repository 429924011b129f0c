"""Lamps: table, floor, arc, desk, pendant, chandelier, sconce, lantern."""

from __future__ import annotations

from ffd_lightning.shapes.kit.builder import Family
from ffd_lightning.shapes.lamp.arc import arc
from ffd_lightning.shapes.lamp.chandelier import chandelier
from ffd_lightning.shapes.lamp.desk import desk
from ffd_lightning.shapes.lamp.floor import floor
from ffd_lightning.shapes.lamp.lantern import lantern
from ffd_lightning.shapes.lamp.pendant import pendant
from ffd_lightning.shapes.lamp.sconce import sconce
from ffd_lightning.shapes.lamp.table import table

PARTS = ("base", "pole", "arm", "shade", "bulb")
FAMILIES: dict[str, Family] = {
    "table": table, "floor": floor, "arc": arc, "desk": desk, "pendant": pendant,
    "chandelier": chandelier, "sconce": sconce, "lantern": lantern,
}  # fmt: skip
