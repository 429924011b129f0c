"""The embedded dataset as a source; `ffd_lightning.shapes` computes the models."""

from __future__ import annotations

from dataclasses import dataclass

from ffd_lightning import shapes
from ffd_lightning.data.sources.base import SourceModel, Survey
from ffd_lightning.errors import RejectedModelError


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
        return sorted(shapes.categories())

    def model_ids(self, category: str) -> list[str]:
        """Return `table-000000` and so on.

        Raises:
            DataError: no generator for the category.
        """
        shapes.families(category)
        return [f"{category}-{i:06d}" for i in range(self.num_models)]

    def load(self, category: str, model_id: str) -> SourceModel:
        """Build one model; its part names are the category's, in the category's order.

        Raises:
            RejectedModelError: an id that is not of this category.
        """
        prefix, _, digits = model_id.rpartition("-")
        if prefix != category or not digits.isdecimal():
            raise RejectedModelError(f"{model_id} is no id of a procedural {category}")
        return SourceModel(*shapes.build(category, int(digits), self.seed))

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return what decides the models."""
        return {
            "source": "procedural",
            "num_models": self.num_models,
            "seed": self.seed,
            "generator_version": shapes.GENERATOR_VERSION,
        }

    def survey(self, category: str) -> Survey:
        """Return that models are computed."""
        return Survey("computed")

    def split(self, category: str) -> dict[str, str]:
        """Return {}: there is no split of its own."""
        return {}
