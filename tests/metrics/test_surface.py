"""Against plain loops over all distances, scipy, spheres, and the formulas of other papers."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.scalings import SCALINGS, score_like
from ffd_lightning.metrics.surface import SurfaceSample, sample_with_normals, surface_scores


def pair(seed=0, num_pred=70, num_target=50):
    rng = np.random.default_rng(seed)
    return tuple(
        SurfaceSample(rng.random((n, 3)), unit(rng.normal(size=(n, 3))))
        for n in (num_pred, num_target)
    )


def unit(normals):
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def plain_scores(pred, target, thresholds):
    distances = cdist(pred.points, target.points)
    there, back = distances.min(axis=1), distances.min(axis=0)
    scores = {
        "chamfer_l1": (sum(there) / len(there) + sum(back) / len(back)) / 2,
        "chamfer_l2": sum(there**2) / len(there) + sum(back**2) / len(back),
        "hausdorff90": max(np.quantile(there, 0.9), np.quantile(back, 0.9)),
    }
    for t in thresholds:
        p, r = (sum(d < t for d in x) / len(x) for x in (there, back))
        scores[f"precision@{t:g}"], scores[f"recall@{t:g}"] = p, r
        scores[f"fscore@{t:g}"] = 2 * p * r / (p + r) if p + r else 0
    cosines = 1 - cdist(pred.normals, target.normals, "cosine")
    there = [abs(cosines[i, j]) for i, j in enumerate(distances.argmin(axis=1))]
    back = [abs(cosines[i, j]) for j, i in enumerate(distances.argmin(axis=0))]
    scores["normal_consistency"] = (np.mean(there) + np.mean(back)) / 2
    return scores


@pytest.mark.parametrize("seed", range(3))
def test_all_scores_are_what_loops_find(seed):
    pred, target = pair(seed)
    thresholds = (0.01, 0.1, 0.15, 0.3)
    scores = surface_scores(pred, target, thresholds)
    assert all(isinstance(value, float) for value in scores.values())
    assert scores == pytest.approx(plain_scores(pred, target, thresholds))


def test_concentric_spheres():
    sphere = trimesh.creation.icosphere(5)
    rng = np.random.default_rng(0)
    inner = sample_with_normals(sphere.vertices, sphere.faces, 20_000, rng)
    outer = sample_with_normals(1.1 * sphere.vertices, sphere.faces, 20_000, rng)
    scores = surface_scores(outer, inner, (0.09, 0.13))
    assert scores["chamfer_l1"] == pytest.approx(0.1, rel=0.02)
    assert scores["chamfer_l2"] == pytest.approx(0.02, rel=0.03)
    assert scores["fscore@0.09"] == 0
    assert scores["fscore@0.13"] > 0.99
    assert scores["normal_consistency"] > 0.995
    flipped = SurfaceSample(inner.points, -inner.normals)
    assert surface_scores(outer, flipped)["normal_consistency"] == scores["normal_consistency"]


def test_the_same_cloud_and_unrelated_normals():
    rng = np.random.default_rng(0)
    points = rng.random((4000, 3))
    same, other = (SurfaceSample(points, unit(rng.normal(size=(4000, 3)))) for _ in range(2))
    assert surface_scores(same, same, (1e-9,)) == pytest.approx(
        {
            "chamfer_l1": 0,
            "chamfer_l2": 0,
            "hausdorff90": 0,
            "precision@1e-09": 1,
            "recall@1e-09": 1,
            "fscore@1e-09": 1,
            "normal_consistency": 1,
        }
    )
    unrelated = surface_scores(same, other)["normal_consistency"]
    assert unrelated == pytest.approx(0.5, abs=0.02)


def test_samples_lie_on_their_faces_with_the_faces_normals():
    box = trimesh.creation.box((1, 2, 3))
    sample = sample_with_normals(box.vertices, box.faces, 500, np.random.default_rng(0))
    scaled = np.abs(sample.points) * 2 / [1, 2, 3]
    side = np.abs(sample.normals) == 1
    assert (side.sum(axis=1) == 1).all()
    np.testing.assert_allclose(scaled[side], 1, rtol=1e-6)
    assert (np.sign(sample.points[side]) == sample.normals[side]).all()
    again = sample_with_normals(box.vertices, box.faces, 500, np.random.default_rng(0))
    np.testing.assert_array_equal(sample.points, again.points)


def test_scores_without_normals():
    pred, target = pair()
    assert "normal_consistency" not in surface_scores(SurfaceSample(pred.points), target)


def plain_scaled(name, pred, target):
    """The other papers' numbers from their formulas: squared distances, their thresholds."""
    points = target.points
    factor = {
        "pixel2mesh": 0.57,
        "atlasnet": 1 / max(np.linalg.norm(points - points.mean(axis=0), axis=1)),
        "mesh_rcnn": 10 / max(np.ptp(points, axis=0)),
        "occnet": 1 / max(np.ptp(points, axis=0)),
    }[name]
    squared = cdist(factor * pred.points, factor * points) ** 2
    there, back = squared.min(axis=1), squared.min(axis=0)

    def f(threshold):  # on squared distances
        p, r = np.mean(there < threshold), np.mean(back < threshold)
        return 2 * p * r / (p + r + 1e-8)

    chamfer = there.mean() + back.mean()
    normals = plain_scores(pred, target, ())["normal_consistency"]
    if name == "pixel2mesh":
        return {"CD": 1000 * chamfer, "F(1e-4)": 100 * f(1e-4), "F(2e-4)": 100 * f(2e-4)}
    if name == "atlasnet":
        return {"chamfer": chamfer, "fscore": f(0.001)}
    if name == "mesh_rcnn":
        shares = {f"F1({t})": 100 * f(t**2) for t in (0.1, 0.3, 0.5)}
        return {"Chamfer": chamfer, "Normal": normals, **shares}
    l1 = (np.sqrt(there).mean() + np.sqrt(back).mean()) / 2
    return {"Chamfer-L1": 10 * l1, "Normal Consistency": normals}


@pytest.mark.parametrize("name", SCALINGS)
def test_other_papers_numbers_are_those_of_their_formulas(name):
    pred, target = pair(1, 900, 700)
    target = target._replace(points=0.3 * target.points + [3, 0, 0])
    pred = pred._replace(points=0.31 * pred.points + [3, 0, 0])
    got = score_like(name, pred, target)
    assert got == pytest.approx(plain_scaled(name, pred, target), rel=1e-6)
    assert all(value > 0 for value in got.values())  # no threshold out of reach of the test


def test_the_longest_side_of_the_mesh_can_be_given():
    pred, target = pair()
    own = float(max(np.ptp(target.points, axis=0)))
    given = score_like("mesh_rcnn", pred, target, target_side=2 * own)
    assert given["Chamfer"] == pytest.approx(score_like("mesh_rcnn", pred, target)["Chamfer"] / 4)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: surface_scores(SurfaceSample(np.zeros((0, 3))), pair()[0]), "no points"),
        (lambda: surface_scores(SurfaceSample(np.full((2, 3), np.nan)), pair()[0]), "finite"),
        (lambda: score_like("nobody", *pair()), "atlasnet"),
        (lambda: score_like("occnet", *(s._replace(normals=None) for s in pair())), "normals"),
        (lambda: score_like("occnet", pair()[0], SurfaceSample(np.eye(3)[:1])), "extent"),
    ],
)
def test_refuses(call, message):
    with pytest.raises(ValueError, match=message):
        call()
