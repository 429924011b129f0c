"""Tables: four-legged, pedestal, trestle, drawer desk, round, nested, two-tier, slab-sided."""

from __future__ import annotations

from ffd_lightning.shapes.kit.builder import Family
from ffd_lightning.shapes.table.desk import desk
from ffd_lightning.shapes.table.four_legged import four_legged
from ffd_lightning.shapes.table.low import nested, two_tier
from ffd_lightning.shapes.table.pedestal import pedestal
from ffd_lightning.shapes.table.round import round_table
from ffd_lightning.shapes.table.slab import slab
from ffd_lightning.shapes.table.trestle import trestle

PARTS = ("top", "leg", "support", "shelf", "drawer")
FAMILIES: dict[str, Family] = {
    "four_legged": four_legged, "pedestal": pedestal, "trestle": trestle, "desk": desk,
    "round": round_table, "nested": nested, "two_tier": two_tier, "slab": slab,
}  # fmt: skip
