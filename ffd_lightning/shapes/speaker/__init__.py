"""Speakers of the living room, the stage and the desk."""

from __future__ import annotations

from ffd_lightning.shapes.kit.builder import Family
from ffd_lightning.shapes.speaker.hifi import bookshelf, soundbar, stand, tower
from ffd_lightning.shapes.speaker.horn import horn
from ffd_lightning.shapes.speaker.pod import pod
from ffd_lightning.shapes.speaker.portable import portable
from ffd_lightning.shapes.speaker.speaker_set import speaker_set
from ffd_lightning.shapes.speaker.stage import amplifier, stage
from ffd_lightning.shapes.speaker.subwoofer import subwoofer

PARTS = ("body", "driver", "port", "grille", "panel", "handle", "stand")
FAMILIES: dict[str, Family] = {
    "bookshelf": bookshelf, "tower": tower, "stand": stand, "subwoofer": subwoofer,
    "soundbar": soundbar, "stage": stage, "amplifier": amplifier, "pod": pod, "portable": portable,
    "horn": horn, "set": speaker_set,
}  # fmt: skip
