"""Monitors and televisions: desktop, television, tube, all-in-one, multiple, curved, projection."""

from __future__ import annotations

from ffd_lightning.shapes.kit.builder import Family
from ffd_lightning.shapes.monitor.all_in_one import all_in_one
from ffd_lightning.shapes.monitor.curved import curved
from ffd_lightning.shapes.monitor.desktop import desktop, multiple
from ffd_lightning.shapes.monitor.projection import projection
from ffd_lightning.shapes.monitor.television import television
from ffd_lightning.shapes.monitor.tube import tube

PARTS = ("screen", "frame", "back", "stand", "base", "speaker", "button")
FAMILIES: dict[str, Family] = {
    "desktop": desktop, "television": television, "tube": tube, "all_in_one": all_in_one,
    "multiple": multiple, "curved": curved, "projection": projection,
}  # fmt: skip
