"""Components of one's own for ffd_lightning: importing this registers them."""

from own_components import (
    augmentation,
    boxes,
    callback,
    encoder,
    extents,
    objective,
    schedule,
    templates,
)

__all__ = [
    "augmentation",
    "boxes",
    "callback",
    "encoder",
    "extents",
    "objective",
    "schedule",
    "templates",
]
