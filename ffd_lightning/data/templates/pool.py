"""The shapes that training steps draw their templates from, where heads are told them."""

from collections.abc import Collection, Sequence
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.prepared import PreparedSet, read_in_threads
from ffd_lightning.errors import ConfigError

_EACH = 8  # templates of a category, where there are several


class TemplatePool:
    """Shapes of which each step draws some as templates, and others as what is to be seen.

    No shape is a template of itself, nor of a variant of itself. Of several categories a step takes
    a few, with as many templates of each. Up to half of them are of the bank, which the network is
    used with unless it is told others.

    Args:
        prepared: the set of all shapes.
        ids: of the shapes.
        count: templates of a step; of each category at most half of its shapes, where variants of
            one count once.
        bank: ids of the run's own templates, among those of the shapes.

    Attributes:
        count: templates of a step, as many as there can be.

    Raises:
        ConfigError: a category of a single shape.
    """

    def __init__(
        self, prepared: PreparedSet, ids: Sequence[str], count: int, bank: Collection[str] = ()
    ) -> None:
        self._prepared = prepared
        self.rows = np.array([prepared.index(i) for i in ids], np.int64)
        origins = [prepared.origins.get(i, i) for i in ids]
        names, self._shapes = np.unique(origins, return_inverse=True)
        self._banked = np.isin(names, list(bank))
        self._members = [np.flatnonzero(self._shapes == k) for k in range(self._shapes.max() + 1)]
        whose = np.array([prepared.category(self.rows[m[0]]) for m in self._members])
        self._categories = [np.flatnonzero(whose == name) for name in np.unique(whose)]
        fewest = min(map(len, self._categories))
        if fewest < 2:
            raise ConfigError("a shape needs another one of its category as template: add shapes")
        self._taken = min(max(count // _EACH, 2), len(self._categories))
        self._each = min(max(count // self._taken, 1), fewest // 2)
        self.count = self._taken * self._each

    def draw(
        self, queries: int, rng: np.random.Generator
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Draw rows of templates, (T,), and of queries of other shapes, (queries,)."""
        taken = rng.permutation(len(self._categories))[: self._taken]
        orders = [self._bank_first(rng.permutation(self._categories[k])) for k in taken]
        shapes = np.concatenate([order[: self._each] for order in orders])
        others = np.concatenate([order[self._each :] for order in orders])
        free = np.flatnonzero(np.isin(self._shapes, others))
        templates = [rng.choice(self._members[k]) for k in shapes]
        chosen = rng.choice(free, queries, replace=len(free) < queries)
        return self.rows[templates], self.rows[chosen]

    def _bank_first(self, shapes: NDArray[np.int64]) -> NDArray[np.int64]:
        """Bring shapes of the bank to the front, as many as are half of a step's templates."""
        first = shapes[self._banked[shapes]][: self._each // 2]
        return np.concatenate([first, shapes[~np.isin(shapes, first)]])

    @cached_property
    def boxes(self) -> Float[Tensor, "shapes 2 3"]:
        """The least and greatest coordinates of each mesh, for its lattice; by row of the set."""
        boxes = torch.zeros(len(self._prepared), 2, 3, dtype=torch.float64)

        def measure(row: int) -> None:
            vertices = torch.from_numpy(self._prepared.mesh(row).used_vertices())
            boxes[row] = torch.stack([vertices.amin(0), vertices.amax(0)])

        read_in_threads(measure, self.rows.tolist())
        return boxes
