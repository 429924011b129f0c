"""How close two sampled surfaces are: F-score, normals, Hausdorff."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import KDTree

from ffd_lightning.geometry.sampling import sample_surface


class SurfaceSample(NamedTuple):
    """Points on a surface, (N, 3), and its unit normals there, (N, 3)."""

    points: NDArray[np.float64]
    normals: NDArray[np.float64]


def sample_with_normals(
    vertices: ArrayLike, faces: ArrayLike, count: int, rng: np.random.Generator
) -> SurfaceSample:
    """Draw points uniformly by area, each with the unit normal of the face that it lies on.

    The surface is vertices (V, 3) and faces (F, 3).

    >>> sample = sample_with_normals(np.eye(3), [[0, 1, 2]], 2, np.random.default_rng(0))
    >>> sample.points.shape, sample.normals[0].round(3)
    ((2, 3), array([0.577, 0.577, 0.577]))
    """
    points, face_ids = sample_surface(vertices, faces, count, rng)
    corners = np.asarray(vertices, np.float64)[np.asarray(faces, np.int64).reshape(-1, 3)[face_ids]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return SurfaceSample(points.astype(np.float64), normals)


def surface_scores(
    pred: SurfaceSample, target: SurfaceSample, thresholds: Sequence[float] = (0.01,)
) -> dict[str, float]:
    """Return how close two surfaces are, from the points of either to the nearest of the other.

    Normals are compared without their signs, since the faces of template meshes are oriented at
    random. Two unrelated directions agree to 0.5 in the mean: that is what a bad value looks like.

    Thresholds of the F-score are in the points' unit; a point exactly as far is not near.

    Returns:
        Distances in the points' unit: `chamfer_l1`, the mean of accuracy and completeness (the mean
        distances of the predicted and of the target points); `chamfer_l2`, the sum of both means of
        squared distances; `hausdorff90`, the larger of both 90th percentiles.
        `normal_consistency`, the mean absolute cosine between normals at nearest points, both ways
        averaged. For each threshold, written as by `f"{t:g}"`, `fscore@t`: the harmonic mean of the
        shares of predicted and of target points that are nearer, 0 where both are 0.

    Raises:
        ValueError: a sample is empty or not finite.

    Source: Knapitsch et al. 2017, "Tanks and Temples", and Tatarchenko et al. 2019 (F-score);
    Mescheder et al. 2019, "Occupancy Networks", section 4 (Chamfer-L1, normals).

    >>> here, there = SurfaceSample(*np.zeros((2, 1, 3))), SurfaceSample(*np.ones((2, 1, 3)))
    >>> apart = surface_scores(here, there)
    >>> round(apart["chamfer_l2"], 6), apart["fscore@0.01"]
    (6.0, 0.0)
    """
    if not len(pred.points) or not len(target.points):
        raise ValueError("a surface has no points")
    if not (np.isfinite(pred.normals).all() and np.isfinite(target.normals).all()):
        raise ValueError("a surface has normals that are not finite")
    # For so many points a tree is faster than `geometry.nearest`, which compares all with all.
    there, to_target = KDTree(target.points).query(pred.points)
    back, to_pred = KDTree(pred.points).query(target.points)
    scores = {
        "chamfer_l1": (there.mean() + back.mean()) / 2,
        "chamfer_l2": np.mean(there**2) + np.mean(back**2),
        "hausdorff90": max(np.percentile(there, 90), np.percentile(back, 90)),
    }
    for threshold in thresholds:
        precision, recall = np.mean(there < threshold), np.mean(back < threshold)
        scores[f"fscore@{threshold:g}"] = 2 * precision * recall / ((precision + recall) or 1)
    cosines = (
        np.abs((pred.normals * target.normals[to_target]).sum(axis=1)).mean(),
        np.abs((target.normals * pred.normals[to_pred]).sum(axis=1)).mean(),
    )
    scores["normal_consistency"] = min(1, (cosines[0] + cosines[1]) / 2)
    return {name: float(value) for name, value in scores.items()}
