"""Speakers of the living room, the stage and the desk."""

from ffd_lightning.shapes.kit import Builder, Chosen, Component, Product, Rng
from ffd_lightning.shapes.speaker.hifi import bookshelf, soundbar, stand, subwoofer, tower
from ffd_lightning.shapes.speaker.small import pod, portable, speaker_set
from ffd_lightning.shapes.speaker.stage import amplifier, horn, stage


def assemble(rng: Rng, chosen: Chosen) -> Builder:
    """Build a speaker; each kind draws all of its own."""
    b = Builder()
    chosen["kind"].build(b, rng)
    return b


KINDS = (
    Component("bookshelf", 2, bookshelf),
    Component("tower", 2, tower),
    Component("stand", 1, stand),
    Component("subwoofer", 1, subwoofer),
    Component("soundbar", 1, soundbar),
    Component("stage", 1, stage),
    Component("amplifier", 1, amplifier),
    Component("pod", 1, pod),
    Component("portable", 1, portable),
    Component("horn", 1, horn),
    Component("set", 1, speaker_set),
)
CATEGORY = Product(
    parts=("body", "driver", "port", "grille", "panel", "handle", "stand"),
    slots={"kind": KINDS},
    family=("kind",),
    assemble=assemble,
)
