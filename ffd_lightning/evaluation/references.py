"""What a score is worth: shapes that a model must beat, found for each query."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.prepared import PreparedSet
from ffd_lightning.losses.chamfer import chamfer_distance

SHAPES = {
    "": "the model: selected template, deformed",
    "undeformed": "selected template as it is",
    "best_deformed": "best of its templates deformed, knowing the truth",
    "best_undeformed": "best of its templates as it is, knowing the truth",
    "feature_retrieval": "training shape of the most similar image (encoder)",
    "retrieval": "nearest training shape, knowing the truth",
    "medoid": "most central training shape, always",
    "floor": "the truth itself, sampled again",
}
"""What is scored, by the prefix of its columns, the model first."""

_COARSE = 256  # points of a cloud for a first ranking
_FINE = 1024
_CANDIDATES = 16  # that the first ranking leaves
_MEDOID_MODELS = 512


def nearest_by_shape(
    prepared: PreparedSet,
    rows: Sequence[int],
    others: PreparedSet,
    among: Sequence[int],
    device: torch.device,
) -> NDArray[np.int64]:
    """Return for each model the nearest other one in Chamfer distance, knowing its true shape.

    All are ranked by 256 points of their clouds, the first 16 again by 1,024.

    Args:
        prepared: the models.
        rows: q rows of them.
        others: the models to choose from.
        among: rows of those.
        device: where to compute.

    Returns:
        (q,) rows.
    """
    coarse = _clouds(others, among, _COARSE).to(device)
    found = []
    for row in rows:
        query = _clouds(prepared, [row], _FINE).to(device)[0]
        first = chamfer_distance(query[:_COARSE], coarse, "mean").topk(
            min(_CANDIDATES, len(among)), largest=False
        )
        close = [among[k] for k in sorted(first.indices.tolist())]
        fine = chamfer_distance(query, _clouds(others, close, _FINE).to(device), "mean")
        found.append(close[int(fine.argmin())])
    return np.asarray(found, np.int64)


def nearest_by_feature(
    features: Tensor, among_features: Tensor, among: Sequence[int]
) -> NDArray[np.int64]:
    """Return for each image the model whose image looks most alike to the encoder.

    Args:
        features: of the queries' images, (q, D), of length 1.
        among_features: of the others', (k, D), of length 1.
        among: their rows, k.

    Returns:
        (q,) rows: of the greatest cosine.
    """
    best = torch.cat([(part @ among_features.T).argmax(1) for part in features.split(256)])
    return np.asarray(among, np.int64)[best.numpy()]


def medoid(prepared: PreparedSet, among: Sequence[int], device: torch.device) -> int:
    """Return the row of the model with the least mean Chamfer distance to the others.

    Of a larger set, 512 models evenly spread are looked at, with 256 points each.
    """
    places = np.linspace(0, len(among) - 1, min(len(among), _MEDOID_MODELS)).astype(int)
    rows = [among[k] for k in places]
    clouds = _clouds(prepared, rows, _COARSE).to(device)
    totals = [float(chamfer_distance(cloud, clouds, "mean").sum()) for cloud in clouds]
    return rows[int(np.argmin(totals))]


def _clouds(prepared: PreparedSet, rows: Sequence[int], count: int) -> Tensor:
    """Return the first points of clouds, (k, count, 3): they are drawn independently."""
    return torch.from_numpy(np.stack([prepared.cloud(row, count) for row in rows]))
