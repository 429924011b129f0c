"""The embedded dataset: models computed from (category, index, seed) alone."""

from __future__ import annotations

import dataclasses
import hashlib
import importlib
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from ffd_lightning.data.categories import PAPER_CATEGORIES
from ffd_lightning.data.sources.base import SourceModel, Survey
from ffd_lightning.errors import DataError, RejectedModelError
from ffd_lightning.geometry.mesh import Mesh

GENERATOR_VERSION = 1
"""Goes up when generators change what they draw, so that prepared data is built anew."""


@dataclass(frozen=True)
class ProceduralSource:
    """Parametric models of the paper's 13 categories.

    A model depends on (category, index, seed) and never on how many are asked for.

    Args:
        num_models: per category.
        seed: draws another set.
    """

    num_models: int
    seed: int = 0

    def categories(self) -> list[str]:
        """Return the paper's categories."""
        return sorted(PAPER_CATEGORIES)

    def model_ids(self, category: str) -> list[str]:
        """Return `table-000000` and so on.

        Raises:
            DataError: no generator for the category.
        """
        _generator(category)
        return [f"{category}-{i:06d}" for i in range(self.num_models)]

    def load(self, category: str, model_id: str) -> SourceModel:
        """Build one model; its part names are the category's, in the category's order.

        Raises:
            RejectedModelError: an id that is not of this category.
        """
        prefix, _, digits = model_id.rpartition("-")
        if prefix != category or not digits.isdecimal():
            raise RejectedModelError(f"{model_id} is no id of a procedural {category}")
        generator = _generator(category)
        key = hashlib.sha256(f"{category}/{int(digits)}/{self.seed}".encode()).digest()
        rng = np.random.default_rng(list(key))
        families = list(generator.FAMILIES)
        family = families[int(rng.integers(len(families)))]
        return SourceModel(_in_order(generator.FAMILIES[family](rng).mesh(), generator), family)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return what decides the models."""
        return {
            "source": "procedural",
            "num_models": self.num_models,
            "seed": self.seed,
            "generator_version": GENERATOR_VERSION,
        }

    def survey(self, category: str) -> Survey:
        """Return that models are computed."""
        return Survey("computed")

    def split(self, category: str) -> dict[str, str]:
        """Return {}: there is no split of its own."""
        return {}


def families(category: str) -> tuple[str, ...]:
    """Return the structural families of a category.

    Raises:
        DataError: no generator for the category.
    """
    return tuple(_generator(category).FAMILIES)


def _generator(category: str) -> ModuleType:
    """Import a category's module: it has PARTS and FAMILIES."""
    if category not in PAPER_CATEGORIES:
        raise DataError(
            f"no procedural models of {category!r}, only of: {', '.join(PAPER_CATEGORIES)}"
        )
    return importlib.import_module(f"ffd_lightning.shapes.{category}")


def _in_order(mesh: Mesh, generator: ModuleType) -> Mesh:
    """Number a mesh's parts as the category does."""
    assert mesh.face_parts is not None
    order = np.array([generator.PARTS.index(name) for name in mesh.part_names], np.uint8)
    return dataclasses.replace(
        mesh, face_parts=order[mesh.face_parts], part_names=tuple(generator.PARTS)
    )
