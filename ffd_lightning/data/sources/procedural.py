"""The embedded dataset as a source; `ffd_lightning.shapes` computes the shapes."""

from ffd_lightning import shapes
from ffd_lightning.components import check_ranges
from ffd_lightning.data.source import Source, SourceShape


class ProceduralSource(Source):
    """The embedded dataset: parametric shapes of 13 categories, the same for everyone.

    A shape depends on (category, index, seed) and never on how many are asked for.

    Args:
        num_models: shapes of each category.
        seed: makes another set.
    """

    def __init__(self, num_models: int = 500, seed: int = 0) -> None:
        check_ranges(locals(), num_models="(0, inf)", seed="[0, inf)")
        self.num_models, self.seed = num_models, seed

    def categories(self) -> list[str]:
        """Return the paper's categories."""
        return sorted(shapes.categories())

    def shape_ids(self, category: str) -> list[str]:
        """Return `table-000000` and so on; a DataError where there is no such category."""
        shapes.product(category)
        return [f"{category}-{i:06d}" for i in range(self.num_models)]

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Build one shape; its part names are the category's, in the category's order."""
        index = int(shape_id.removeprefix(f"{category}-"))
        return SourceShape(*shapes.build(category, index, self.seed))

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return what decides the shapes."""
        return {
            "source": "procedural",
            "num_models": self.num_models,
            "seed": self.seed,
            "generator_version": shapes.GENERATOR_VERSION,
        }
