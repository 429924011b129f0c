"""Cars: saloon, estate, off-roader, van, bus, pickup, roadster, vintage, formula."""

from __future__ import annotations

from ffd_lightning.shapes.car.formula import formula
from ffd_lightning.shapes.car.passenger import estate, off_roader, saloon
from ffd_lightning.shapes.car.roadster import roadster
from ffd_lightning.shapes.car.utility import bus, pickup, van
from ffd_lightning.shapes.car.vintage import vintage
from ffd_lightning.shapes.kit.builder import Family

PARTS = ("body", "roof", "hood", "window", "wheel", "light", "trim", "seat")
FAMILIES: dict[str, Family] = {
    "saloon": saloon, "estate": estate, "off_roader": off_roader, "van": van, "bus": bus,
    "pickup": pickup, "roadster": roadster, "vintage": vintage, "formula": formula,
}  # fmt: skip
