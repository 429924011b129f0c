"""What a score is worth: shapes that a model must beat, found for each query."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.geometry.chamfer import chamfer_distance

SHAPES = {
    "": "the model: selected template, deformed",
    "resampled": "the model, points drawn on the deformed surface",
    "undeformed": "selected template as it is",
    "best_deformed": "best of its templates deformed, an oracle",
    "fitted": "best of its templates fitted to the truth, an oracle",
    "best_undeformed": "best of its templates as it is, an oracle",
    "feature_retrieval": "training shape of the most similar image (encoder)",
    "retrieval": "nearest training shape, an oracle",
    "medoid": "most central training shape, always",
    "floor": "the truth itself, sampled again",
}
"""What is scored, by the prefix of its columns, the model first."""

_COARSE = 256  # points of a cloud for a first ranking
_FINE = 1024
_CANDIDATES = 16  # that the first ranking leaves
_MEDOID_MODELS = 512


class ShapeRetrieval:
    """Finds the nearest of some shapes in Chamfer distance, for a shape that is known.

    All are ranked by 256 points of their clouds, the first 16 again by 1,024.

    Args:
        prepared: the shapes to choose from.
        among: rows of those.
    """

    def __init__(self, prepared: PreparedSet, among: Sequence[int]) -> None:
        self._prepared, self._among = prepared, list(among)
        self._coarse = _clouds(prepared, among, _COARSE)

    def nearest(self, cloud: NDArray[np.float32]) -> int:
        """Return the row of the nearest shape.

        Args:
            cloud: independent samples of the shape, (1024 or more, 3).
        """
        query = torch.from_numpy(cloud[:_FINE])
        first = chamfer_distance(query[:_COARSE], self._coarse, "mean").topk(
            min(_CANDIDATES, len(self._among)), largest=False
        )
        close = [self._among[k] for k in sorted(first.indices.tolist())]
        fine = chamfer_distance(query, _clouds(self._prepared, close, _FINE), "mean")
        return close[int(fine.argmin())]


def nearest_by_feature(features: Tensor, others: Tensor) -> NDArray[np.int64]:
    """Return for each image the one that looks most alike to the encoder.

    Args:
        features: of the images, (q, D), of length 1.
        others: of those to choose from, (k, D), of length 1.

    Returns:
        (q,) places among the others: of the greatest cosine.
    """
    best = torch.cat([(part @ others.T).argmax(1) for part in features.split(256)])
    return best.numpy()


def medoid(prepared: PreparedSet, among: Sequence[int]) -> int:
    """Return the row of the model with the least mean Chamfer distance to the others.

    Of a larger set, 512 shapes evenly spread are looked at, with 256 points each.
    """
    places = np.linspace(0, len(among) - 1, min(len(among), _MEDOID_MODELS)).astype(int)
    rows = [among[k] for k in places]
    clouds = _clouds(prepared, rows, _COARSE)
    totals = [float(chamfer_distance(cloud, clouds, "mean").sum()) for cloud in clouds]
    return rows[int(np.argmin(totals))]


def _clouds(prepared: PreparedSet, rows: Sequence[int], count: int) -> Tensor:
    """Return the first points of clouds, (k, count, 3): they are drawn independently."""
    return torch.from_numpy(np.stack([prepared.cloud(row, count) for row in rows]))
