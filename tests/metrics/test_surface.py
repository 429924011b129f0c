import numpy as np
import pytest
import trimesh
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals, surface_scores


def unit(normals):
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def test_the_hausdorff_distance_is_that_of_the_worse_way():
    rng = np.random.default_rng(0)
    pred, target = (
        SurfaceSample(rng.random((n, 3)), unit(rng.normal(size=(n, 3)))) for n in (70, 50)
    )
    distances = cdist(pred.points, target.points)
    worse = max(np.quantile(distances.min(axis=way), 0.9) for way in (0, 1))
    assert surface_scores(pred, target, ())["hausdorff90"] == pytest.approx(worse)


def test_samples_lie_on_their_faces_with_the_faces_normals():
    box = trimesh.creation.box((1, 2, 3))
    sample = sample_with_normals(box.vertices, box.faces, 500, np.random.default_rng(0))
    scaled = np.abs(sample.points) * 2 / [1, 2, 3]
    side = np.abs(sample.normals) == 1
    assert (side.sum(axis=1) == 1).all()
    np.testing.assert_allclose(scaled[side], 1, rtol=1e-6)
    assert (np.sign(sample.points[side]) == sample.normals[side]).all()
