"""The embedded dataset: shapes computed from (category, index, seed) alone.

A package per category has `PARTS`, the names of its parts, and `FAMILIES`, its structural families
by name: functions from a random generator to a `Builder`. `kit` holds what several categories are
built of. Categories are imported when they are first asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from ffd_lightning.errors import DataError

if TYPE_CHECKING:
    from types import ModuleType

    from ffd_lightning.geometry.mesh import Mesh

GENERATOR_VERSION = 1
"""Goes up when generators change what they draw, so that prepared data is built anew."""
_CATEGORIES = (
    "plane", "bench", "cabinet", "car", "cellphone", "chair", "monitor", "lamp", "speaker",
    "firearm", "sofa", "table", "watercraft",
)  # fmt: skip


def categories() -> tuple[str, ...]:
    """Return the categories that have generators: the paper's."""
    return _CATEGORIES


def families(category: str) -> tuple[str, ...]:
    """Return the structural families of a category.

    Raises:
        DataError: no generator for the category.
    """
    return tuple(_package(category).FAMILIES)


def build(category: str, index: int, seed: int = 0) -> tuple[Mesh, str]:
    """Build one shape; return its mesh, parts in the category's order, and its family.

    It depends on nothing but the arguments. The unit of length is the category's own.

    Raises:
        DataError: no generator for the category.
    """
    import hashlib
    from dataclasses import replace

    import numpy as np

    package = _package(category)
    key = hashlib.sha256(f"{category}/{index}/{seed}".encode()).digest()
    rng = np.random.default_rng(list(key))
    if hasattr(package, "CATEGORY"):
        return package.CATEGORY.draw(rng)
    names = list(package.FAMILIES)
    family = names[int(rng.integers(len(names)))]
    mesh = package.FAMILIES[family](rng).mesh()
    order = np.array([package.PARTS.index(name) for name in mesh.part_names], np.uint8)
    ordered = replace(mesh, face_parts=order[mesh.face_parts], part_names=tuple(package.PARTS))
    return ordered, family


def _package(category: str) -> ModuleType:
    """Import a category's package."""
    import importlib

    if category not in _CATEGORIES:
        raise DataError(f"no procedural shapes of {category!r}, only of: {', '.join(_CATEGORIES)}")
    return importlib.import_module(f"ffd_lightning.shapes.{category}")
