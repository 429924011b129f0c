"""What hangs from the ceiling: roses, cords and shades at their ends."""

from __future__ import annotations

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.vectors import UP, Array
from ffd_lightning.shapes.lamp.shades import FLIP, Shade, add_bulb, add_shade

HANGING = {"dome": 0.3, "cone": 0.15, "empire": 0.15, "bell": 0.15, "bowl": 0.15, "drum": 0.1}


def add_rose(b: Builder, metal: Material, radius: float, at: Array) -> None:
    """Add the round plate at the ceiling, its top at `at`."""
    rows = [(0.015, -0.03), (0.7 * radius, -0.025), (radius, -0.008), (radius, 0)]
    b.lathe("base", metal, rows, at, segments=24)


def add_cord(b: Builder, metal: Material, top: Array, length: float) -> None:
    """Add a cord that hangs down from `top`."""
    b.cylinder("pole", metal, top - 0.005 * UP, top - (length + 0.005) * UP, 0.007, segments=8)


def hang_shade(b: Builder, shade: Shade, metal: Material, top: Array, bulb: float) -> None:
    """Add a shade below the end of a cord, and the bulb inside it."""
    add_shade(b, shade, metal, top)
    add_bulb(b, metal, top + 0.005 * UP, min(bulb, 0.85 * shade.height), FLIP)
