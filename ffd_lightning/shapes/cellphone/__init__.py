"""Telephones: smartphones, candy bars, flips, sliders, keyboards, bricks, docked handsets."""

from __future__ import annotations

from ffd_lightning.shapes.cellphone.bar import candybar, keyboard
from ffd_lightning.shapes.cellphone.brick import brick
from ffd_lightning.shapes.cellphone.docked import docked
from ffd_lightning.shapes.cellphone.folding import flip, slider
from ffd_lightning.shapes.cellphone.smartphone import smartphone
from ffd_lightning.shapes.kit.builder import Family

PARTS = ("body", "screen", "key", "button", "camera", "speaker", "antenna", "stand")
FAMILIES: dict[str, Family] = {
    "smartphone": smartphone, "candybar": candybar, "flip": flip, "slider": slider,
    "keyboard": keyboard, "brick": brick, "docked": docked,
}  # fmt: skip
