"""Cabinets: dressers, wardrobes, sideboards, bookcases, hutches, filing, bowed, kitchen units."""

from __future__ import annotations

from ffd_lightning.shapes.cabinet.bookcase import bookcase
from ffd_lightning.shapes.cabinet.bowed import bowed
from ffd_lightning.shapes.cabinet.dresser import dresser
from ffd_lightning.shapes.cabinet.filing import filing
from ffd_lightning.shapes.cabinet.hutch import hutch
from ffd_lightning.shapes.cabinet.kitchen import kitchen
from ffd_lightning.shapes.cabinet.sideboard import sideboard
from ffd_lightning.shapes.cabinet.wardrobe import wardrobe
from ffd_lightning.shapes.kit.builder import Family

PARTS = ("body", "top", "door", "drawer", "shelf", "handle", "leg")
FAMILIES: dict[str, Family] = {
    "dresser": dresser, "wardrobe": wardrobe, "sideboard": sideboard, "bookcase": bookcase,
    "hutch": hutch, "filing": filing, "kitchen": kitchen, "bowed": bowed,
}  # fmt: skip
