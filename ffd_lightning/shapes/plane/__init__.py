"""Aeroplanes: airliner, turboprop, light, biplane, glider, warbird, fighter, flying wing."""

from __future__ import annotations

from ffd_lightning.shapes.kit.builder import Family
from ffd_lightning.shapes.plane.fighter import fighter
from ffd_lightning.shapes.plane.flying_wing import flying_wing
from ffd_lightning.shapes.plane.glider import glider
from ffd_lightning.shapes.plane.light import biplane, light_plane
from ffd_lightning.shapes.plane.transport import airliner, turboprop
from ffd_lightning.shapes.plane.warbird import warbird

PARTS = ("body", "wing", "tail", "engine", "window", "gear")
FAMILIES: dict[str, Family] = {
    "airliner": airliner, "turboprop": turboprop, "light_plane": light_plane, "biplane": biplane,
    "glider": glider, "warbird": warbird, "fighter": fighter, "flying_wing": flying_wing,
}  # fmt: skip
