"""Against plain loops over all distances, scipy, and spheres."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals, surface_scores


def unit(normals):
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_all_scores_are_what_loops_find():
    rng = np.random.default_rng(0)
    pred, target = (
        SurfaceSample(rng.random((n, 3)), unit(rng.normal(size=(n, 3)))) for n in (70, 50)
    )
    thresholds = (0.01, 0.1, 0.3)
    distances = cdist(pred.points, target.points)
    there, back = distances.min(axis=1), distances.min(axis=0)
    expected = {
        "chamfer_l1": (sum(there) / len(there) + sum(back) / len(back)) / 2,
        "chamfer_l2": sum(there**2) / len(there) + sum(back**2) / len(back),
        "hausdorff90": max(np.quantile(there, 0.9), np.quantile(back, 0.9)),
    }
    for t in thresholds:
        p, r = (sum(d < t for d in x) / len(x) for x in (there, back))
        expected[f"fscore@{t:g}"] = 2 * p * r / (p + r) if p + r else 0
    cosines = 1 - cdist(pred.normals, target.normals, "cosine")
    ways = (
        [abs(cosines[i, j]) for i, j in enumerate(distances.argmin(axis=1))],
        [abs(cosines[i, j]) for j, i in enumerate(distances.argmin(axis=0))],
    )
    expected["normal_consistency"] = np.mean([np.mean(way) for way in ways])
    assert surface_scores(pred, target, thresholds) == pytest.approx(expected)


def test_samples_lie_on_their_faces_with_the_faces_normals():
    box = trimesh.creation.box((1, 2, 3))
    sample = sample_with_normals(box.vertices, box.faces, 500, np.random.default_rng(0))
    scaled = np.abs(sample.points) * 2 / [1, 2, 3]
    side = np.abs(sample.normals) == 1
    assert (side.sum(axis=1) == 1).all()
    np.testing.assert_allclose(scaled[side], 1, rtol=1e-6)
    assert (np.sign(sample.points[side]) == sample.normals[side]).all()
