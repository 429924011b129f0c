"""Firearms: pistol, revolver, and the long guns."""

from __future__ import annotations

from ffd_lightning.shapes.firearm.machine_gun import machine_gun, submachine_gun
from ffd_lightning.shapes.firearm.pistol import pistol
from ffd_lightning.shapes.firearm.revolver import revolver
from ffd_lightning.shapes.firearm.rifle import assault_rifle, hunting_rifle
from ffd_lightning.shapes.firearm.shotgun import shotgun
from ffd_lightning.shapes.kit.builder import Family

PARTS = ("barrel", "body", "grip", "trigger", "magazine", "stock", "sight")
FAMILIES: dict[str, Family] = {
    "pistol": pistol, "revolver": revolver, "assault_rifle": assault_rifle,
    "hunting_rifle": hunting_rifle, "shotgun": shotgun, "submachine_gun": submachine_gun,
    "machine_gun": machine_gun,
}  # fmt: skip
