"""Chairs: dining, swivel, cantilever, armchair, stool, shell, slatted lounge."""

from __future__ import annotations

from ffd_lightning.shapes.chair.armchair import armchair
from ffd_lightning.shapes.chair.cantilever import cantilever
from ffd_lightning.shapes.chair.dining import dining
from ffd_lightning.shapes.chair.shell import shell
from ffd_lightning.shapes.chair.slatted import slatted
from ffd_lightning.shapes.chair.stool import stool
from ffd_lightning.shapes.chair.swivel import swivel
from ffd_lightning.shapes.kit import Family

PARTS = ("seat", "back", "arm", "leg")
FAMILIES: dict[str, Family] = {
    "dining": dining, "swivel": swivel, "cantilever": cantilever, "armchair": armchair,
    "stool": stool, "shell": shell, "slatted": slatted,
}  # fmt: skip
