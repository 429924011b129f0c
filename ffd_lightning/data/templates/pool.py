"""The shapes that training steps draw their templates from, where heads are told them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property

import numpy as np
import torch
from jaxtyping import Float
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError
from ffd_lightning.parallel import available_cores


class TemplatePool:
    """Shapes of which each step draws some as templates, and others as what is to be seen.

    No shape is a template of itself, nor of a variant of itself.

    Args:
        prepared: the set of all shapes.
        trained_on: ids of the shapes that queries are drawn from.
        others: ids of shapes that are templates only.
        count: templates of a step, at most half of the shapes (variants of one count once).

    Raises:
        ConfigError: a single shape.
    """

    def __init__(
        self, prepared: PreparedSet, trained_on: Sequence[str], others: Sequence[str], count: int
    ) -> None:
        ids = [*trained_on, *others]
        self._prepared = prepared
        self.rows = np.array([prepared.index(i) for i in ids], np.int64)
        _, self._shapes = np.unique([i.partition("~")[0] for i in ids], return_inverse=True)
        self._members = [np.flatnonzero(self._shapes == k) for k in range(self._shapes.max() + 1)]
        self._queries = np.arange(len(ids)) < len(trained_on)
        if len(self._members) < 2:
            raise ConfigError("a shape needs another one as its template: add shapes")
        self.count = min(count, len(self._members) // 2)

    def draw(
        self, queries: int, rng: np.random.Generator
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Draw rows of templates, (T,), and of queries of other shapes, (queries,)."""
        while True:
            shapes = rng.permutation(len(self._members))[: self.count]
            free = np.flatnonzero(self._queries & ~np.isin(self._shapes, shapes))
            if len(free):
                break
        templates = [rng.choice(self._members[k]) for k in shapes]
        chosen = rng.choice(free, queries, replace=len(free) < queries)
        return self.rows[templates], self.rows[chosen]

    @cached_property
    def boxes(self) -> Float[Tensor, "shapes 2 3"]:
        """The least and greatest coordinates of each mesh, for its lattice; by row of the set."""
        boxes = torch.zeros(len(self._prepared), 2, 3, dtype=torch.float64)

        def measure(row: int) -> None:
            vertices = torch.from_numpy(self._prepared.mesh(row).used_vertices())
            boxes[row] = torch.stack([vertices.amin(0), vertices.amax(0)])

        with ThreadPoolExecutor(min(available_cores(), 8)) as pool:
            list(pool.map(measure, self.rows.tolist()))
        return boxes
