"""Watercraft: from rowing boats, speedboats, yachts and tugs to ships, under sail or power."""

from __future__ import annotations

from ffd_lightning.shapes.kit.builder import Family
from ffd_lightning.shapes.watercraft.freighter import freighter
from ffd_lightning.shapes.watercraft.liner import liner
from ffd_lightning.shapes.watercraft.motorboats import motor_yacht, speedboat
from ffd_lightning.shapes.watercraft.rowboat import rowboat
from ffd_lightning.shapes.watercraft.sailboat import catamaran, sailboat
from ffd_lightning.shapes.watercraft.submarine import submarine
from ffd_lightning.shapes.watercraft.tall_ship import tall_ship
from ffd_lightning.shapes.watercraft.warship import carrier, warship
from ffd_lightning.shapes.watercraft.workboat import workboat

PARTS = (
    "hull", "deck", "cabin", "mast", "sail", "keel", "funnel", "engine", "cargo", "gun", "seat",
    "oar", "rail",
)  # fmt: skip
FAMILIES: dict[str, Family] = {
    "rowboat": rowboat, "speedboat": speedboat, "motor_yacht": motor_yacht, "workboat": workboat,
    "sailboat": sailboat, "catamaran": catamaran, "tall_ship": tall_ship, "freighter": freighter,
    "warship": warship, "carrier": carrier, "liner": liner, "submarine": submarine,
}  # fmt: skip
