"""How close two sampled surfaces are: F-score, normals, Hausdorff, and other papers' scales.

Convention:
    All distances are from a point to the nearest point of the other cloud. They are unsquared and
    in the points' unit, except in Chamfer-L2. Computed in float64.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from ffd_lightning.geometry.chamfer import chamfer_of
from ffd_lightning.geometry.nearest import NearestNeighbors, nearest_neighbors
from ffd_lightning.geometry.sampling import sample_surface
from ffd_lightning.metrics.clouds import Points, as_clouds, as_given


class SurfaceSample(NamedTuple):
    """Points on a surface, (*batch, N, 3), and its normals there, of any length above 0."""

    points: Points
    normals: Points | None = None


def sample_with_normals(
    vertices: ArrayLike, faces: ArrayLike, count: int, rng: np.random.Generator
) -> SurfaceSample:
    """Draw points uniformly by area, each with the unit normal of the face that it lies on.

    Args:
        vertices: (V, 3).
        faces: (F, 3).
        count: number of points.
        rng: the only source of randomness.

    Raises:
        ValueError: the surface has no area.

    >>> sample = sample_with_normals(np.eye(3), [[0, 1, 2]], 2, np.random.default_rng(0))
    >>> sample.points.shape, sample.normals[0].round(3)
    ((2, 3), array([0.577, 0.577, 0.577]))
    """
    points, face_ids = sample_surface(vertices, faces, count, rng)
    corners = np.asarray(vertices, np.float64)[np.asarray(faces, np.int64).reshape(-1, 3)[face_ids]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return SurfaceSample(points, normals / np.linalg.norm(normals, axis=1, keepdims=True))


def precision(pred_points: Points, target_points: Points, threshold: float) -> Any:
    """Return the share of predicted points that are nearer than `threshold` to the target.

    Args:
        pred_points: (*batch, N, 3).
        target_points: (*batch, M, 3).
        threshold: see `fscore`.

    Returns:
        (*batch,), in [0, 1]; a float for one pair of arrays.

    Raises:
        ValueError: as `fscore`.

    >>> precision(np.array([[0.0, 0, 0], [0, 0, 5]]), np.zeros((1, 3)), 0.1)
    0.5
    """
    near = _share(_search(pred_points, target_points).a_to_b, threshold)
    return as_given(near, pred_points, target_points)


def recall(pred_points: Points, target_points: Points, threshold: float) -> Any:
    """Return the share of target points that are nearer than `threshold` to the prediction.

    Arguments, result and errors are those of `precision`.

    >>> recall(np.array([[0.0, 0, 0], [0, 0, 5]]), np.zeros((1, 3)), 0.1)
    1.0
    """
    return precision(target_points, pred_points, threshold)


def fscore(pred_points: Points, target_points: Points, threshold: float) -> Any:
    """Return the harmonic mean of `precision` and `recall`; 0 where both are 0.

    Args:
        pred_points: (*batch, N, 3).
        target_points: (*batch, M, 3).
        threshold: distance in the points' unit, above 0; a point exactly as far is not near.

    Returns:
        (*batch,), in [0, 1]; a float for one pair of arrays.

    Raises:
        ValueError: no points, values that are not finite, a threshold of 0 or below.

    Source: Knapitsch et al. 2017, "Tanks and Temples"; Tatarchenko et al. 2019.

    >>> round(fscore(np.array([[0.0, 0, 0], [0, 0, 5]]), np.zeros((1, 3)), 0.1), 4)
    0.6667
    """
    found = _search(pred_points, target_points)
    value = _harmonic(_share(found.a_to_b, threshold), _share(found.b_to_a, threshold))
    return as_given(value, pred_points, target_points)


def normal_consistency(
    pred_points: Points, pred_normals: Points, target_points: Points, target_normals: Points
) -> Any:
    """Return the mean absolute cosine between normals at nearest points, both ways averaged.

    Absolute, since the faces of template meshes are oriented at random. Two unrelated directions
    have 0.5 in the mean, so that is what a bad value looks like.

    Args:
        pred_points: (*batch, N, 3).
        pred_normals: (*batch, N, 3), of any length above 0.
        target_points: (*batch, M, 3).
        target_normals: (*batch, M, 3).

    Returns:
        (*batch,), in [0, 1]; a float for one pair of arrays.

    Raises:
        ValueError: no points, values that are not finite, normals of another shape or length 0.

    Source: Mescheder et al. 2019, "Occupancy Networks", section 4, and its evaluation code.

    >>> points, up = np.zeros((1, 3)), np.array([[0.0, 0, 1]])
    >>> normal_consistency(points, up, points, -2 * up)
    1.0
    """
    pred = SurfaceSample(pred_points, pred_normals)
    target = SurfaceSample(target_points, target_normals)
    value = _consistency(_search(pred_points, target_points), pred, target)
    return as_given(value, pred_points, target_points)


def hausdorff(pred_points: Points, target_points: Points, percentile: float = 90) -> Any:
    """Return the larger of both directions' percentiles of the distances.

    Args:
        pred_points: (*batch, N, 3).
        target_points: (*batch, M, 3).
        percentile: 100 is the Hausdorff distance, which a single point decides.

    Returns:
        (*batch,), in the points' unit; a float for one pair of arrays.

    Raises:
        ValueError: no points, values that are not finite, a percentile outside [0, 100].

    >>> hausdorff(np.array([[0.0, 0, 0], [0, 0, 5]]), np.zeros((1, 3)), percentile=100)
    5.0
    """
    value = _percentile(_search(pred_points, target_points), percentile)
    return as_given(value, pred_points, target_points)


def surface_scores(
    pred: SurfaceSample, target: SurfaceSample, thresholds: tuple[float, ...] = (0.01,)
) -> dict[str, Any]:
    """Return all scores from one search for nearest neighbours.

    Args:
        pred: points, with normals or without.
        target: the same.
        thresholds: of the F-score, in the points' unit.

    Returns:
        `chamfer_l1`, the mean of accuracy and completeness (the mean distances of the predicted
        and of the target points); `chamfer_l2`, the sum of both means of squared distances;
        `hausdorff90`; for each threshold, written as by `f"{t:g}"`, `precision@t`, `recall@t` and
        `fscore@t`; where both samples have normals, `normal_consistency`.

    Raises:
        ValueError: as each of them.

    >>> apart = surface_scores(SurfaceSample(np.zeros((1, 3))), SurfaceSample(np.ones((1, 3))))
    >>> apart["chamfer_l2"], apart["fscore@0.01"]
    (6.0, 0.0)
    """
    found = _search(pred.points, target.points)
    scores = {
        "chamfer_l1": chamfer_of(found, lambda squared: squared.sqrt().mean(-1)) / 2,
        "chamfer_l2": chamfer_of(found, "mean"),
        "hausdorff90": _percentile(found, 90),
    }
    for threshold in thresholds:
        shares = _share(found.a_to_b, threshold), _share(found.b_to_a, threshold)
        scores[f"precision@{threshold:g}"], scores[f"recall@{threshold:g}"] = shares
        scores[f"fscore@{threshold:g}"] = _harmonic(*shares)
    if pred.normals is not None and target.normals is not None:
        scores["normal_consistency"] = _consistency(found, pred, target)
    return {name: as_given(value, pred.points, target.points) for name, value in scores.items()}


def _double(points: Points, name: str) -> Tensor:
    tensor = as_clouds(points, name)
    return (tensor.cpu() if tensor.device.type == "mps" else tensor).double()


def _search(pred_points: Points, target_points: Points) -> NearestNeighbors:
    """Return nearest neighbours both ways, the prediction's first; distances are squared."""
    return nearest_neighbors(
        _double(pred_points, "pred_points"), _double(target_points, "target_points")
    )


def _share(squared: Tensor, threshold: float) -> Tensor:
    if not threshold > 0:
        raise ValueError(f"threshold must be above 0, got {threshold}")
    return (squared.sqrt() < threshold).double().mean(-1)


def _harmonic(a: Tensor, b: Tensor) -> Tensor:
    return 2 * a * b / torch.where(a + b > 0, a + b, 1)


def _percentile(found: NearestNeighbors, percentile: float) -> Tensor:
    if not 0 <= percentile <= 100:
        raise ValueError(f"percentile must be in [0, 100], got {percentile}")
    squared = (found.a_to_b, found.b_to_a)
    both = [np.percentile(d.sqrt().cpu().numpy(), percentile, axis=-1) for d in squared]
    return torch.from_numpy(np.asarray(np.maximum(*both))).to(found.a_to_b.device)


def _consistency(found: NearestNeighbors, pred: SurfaceSample, target: SurfaceSample) -> Tensor:
    unit_pred, unit_target = _unit(pred), _unit(target)
    batch = found.a_to_b.shape[:-1]
    means = []
    for own, other, index in (
        (unit_pred, unit_target, found.a_to_b_index),
        (unit_target, unit_pred, found.b_to_a_index),
    ):
        other = other.expand(*batch, *other.shape[-2:])
        near = torch.take_along_dim(other, index[..., None], dim=-2)
        means.append((own * near).sum(-1).abs().clamp(max=1).mean(-1))
    return (means[0] + means[1]) / 2


def _unit(sample: SurfaceSample) -> Tensor:
    if sample.normals is None:
        raise ValueError("both samples need normals")
    normals = _double(sample.normals, "normals")
    if normals.shape != np.shape(sample.points):
        raise ValueError(
            f"normals {tuple(normals.shape)} and points {np.shape(sample.points)} differ in shape"
        )
    length = normals.norm(dim=-1, keepdim=True)
    if not (length > 0).all():
        raise ValueError("normals must have a length above 0")
    return normals / length
