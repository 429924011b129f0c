"""Sofas: straight, chesterfield, camelback, sectional, chaise, daybed, curved."""

from __future__ import annotations

from ffd_lightning.shapes.kit.builder import Family
from ffd_lightning.shapes.sofa.camelback import camelback, chaise
from ffd_lightning.shapes.sofa.curved import curved
from ffd_lightning.shapes.sofa.daybed import daybed
from ffd_lightning.shapes.sofa.sectional import sectional
from ffd_lightning.shapes.sofa.straight import chesterfield, straight

PARTS = ("seat", "back", "arm", "leg")
FAMILIES: dict[str, Family] = {
    "straight": straight, "chesterfield": chesterfield, "camelback": camelback,
    "sectional": sectional, "chaise": chaise, "daybed": daybed, "curved": curved,
}  # fmt: skip
