"""Nearest neighbours of large clouds on the CPU: scipy's k-d tree, one per cloud, in threads."""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

from ffd_lightning.geometry.nearest.threads import over_threads
from ffd_lightning.geometry.nearest.torch_backend import gradient

__all__ = ["gradient", "search"]


def search(a: Tensor, b: Tensor, index_a: Tensor, index_b: Tensor) -> tuple[Tensor, ...]:
    """Return squared distances and indices, both ways; see `torch_backend.search`."""
    clouds = [_Cloud(points) for points in (*a, *b)]
    over_threads(_plant, len(clouds), clouds)
    pairs = [(clouds[i], clouds[len(a) + j]) for i, j in zip(index_a, index_b, strict=True)]
    forth = [x.nearest_in(y) for x, y in pairs]
    back = [y.nearest_in(x) for x, y in pairs]
    return tuple(torch.stack(part) for ways in (forth, back) for part in zip(*ways, strict=True))


def _plant(clouds: list[_Cloud], start: int, stop: int) -> None:
    for cloud in clouds[start:stop]:
        cloud.plant()


class _Cloud:
    """Points (N, 3) and the tree of the finite ones among them."""

    def __init__(self, points: Tensor) -> None:
        self.points = points
        self.finite = points.isfinite().all(1).nonzero()[:, 0]

    def plant(self) -> None:
        """Build the tree."""
        self.values = self.points[self.finite].double().numpy()
        self.tree = cKDTree(self.values)

    def nearest_in(self, other: _Cloud) -> tuple[Tensor, Tensor]:
        """Squared distances and indices of this cloud's points in the other's, each (N,)."""
        distance = torch.full_like(self.points[:, 0], torch.nan)
        index = torch.zeros(len(distance), dtype=torch.int64)
        if len(other.finite) == 0:
            distance[self.finite] = torch.inf
        else:
            _, found = other.tree.query(self.values, workers=torch.get_num_threads())
            index[self.finite] = other.finite[torch.from_numpy(np.asarray(found))]
            # The tree computes in double and takes a root; these are what the gradient sees.
            difference = self.points[self.finite] - other.points[index[self.finite]]
            distance[self.finite] = difference.square().sum(1)
        return distance, index
