"""The embedded dataset: shapes computed from (category, index, seed) alone.

A package per category has `CATEGORY`, a `Product`: slots, the components that fill them, and rules
for what goes together. `kit` holds what several categories are built of. Categories are imported
when they are first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ffd_lightning.errors import DataError

if TYPE_CHECKING:
    from ffd_lightning.geometry.mesh import Mesh
    from ffd_lightning.shapes.kit import Product

GENERATOR_VERSION = 2
"""Goes up when generators change what they draw, so that prepared data is built anew."""
_CATEGORIES = (
    "plane", "bench", "cabinet", "car", "cellphone", "chair", "monitor", "lamp", "speaker",
    "firearm", "sofa", "table", "watercraft",
)  # fmt: skip


def categories() -> tuple[str, ...]:
    """Return the categories that have generators: the paper's."""
    return _CATEGORIES


def product(category: str) -> Product:
    """Return what a category's shapes are made of: slots, components, parts.

    Raises:
        DataError: no generator for the category.
    """
    import importlib

    if category not in _CATEGORIES:
        raise DataError(f"no procedural shapes of {category!r}, only of: {', '.join(_CATEGORIES)}")
    package = importlib.import_module(f"ffd_lightning.shapes.{category}")
    found: Product = package.CATEGORY
    return found


def build(category: str, index: int, seed: int = 0) -> tuple[Mesh, str]:
    """Build one shape; return its mesh, parts in the category's order, and its family.

    It depends on nothing but the arguments. The unit of length is the category's own.

    Raises:
        DataError: no generator for the category.
    """
    import hashlib

    import numpy as np

    key = hashlib.sha256(f"{category}/{index}/{seed}".encode()).digest()
    return product(category).draw(np.random.default_rng(list(key)))
