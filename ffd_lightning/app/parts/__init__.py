"""The parts that this package brings: what can be chosen by name, and what each can be told.

They use the same door as those of other packages (`docs/extending.md`): importing this registers
them, in the order in which `--help` lists them.
"""

from ffd_lightning.app.parts import (
    augmentations,
    encoders,
    objective,
    protocols,
    sources,
    splits,
    template_strategies,
)

__all__ = [
    "augmentations",
    "encoders",
    "objective",
    "protocols",
    "sources",
    "splits",
    "template_strategies",
]
