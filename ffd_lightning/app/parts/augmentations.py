"""What changes training images."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ffd_lightning.imaging.photo_variation import PhotoVariation
from ffd_lightning.registry import register


@dataclass
class Unchanged:
    """Training images as they were prepared."""


@register("augmentation", "none", Unchanged)
def none(settings: Unchanged) -> None:
    """Return nothing: images are then used without their coverage, which is not even kept."""


@register("augmentation", "photo", PhotoVariation)
def photo(settings: PhotoVariation) -> Any:
    """Build the augmentation."""
    from ffd_lightning.imaging.augmentation import PhotoAugmentation

    return PhotoAugmentation(settings)
