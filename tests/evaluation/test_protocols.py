"""Every protocol on shapes whose scores are known, and what results say of it."""

import json

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from ffd_lightning import components
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.candidates import PreparedShape, TemplateShape
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription, SurfaceProtocol
from ffd_lightning.evaluation.protocols.base import Metric
from ffd_lightning.metrics.surface import sample_with_normals

PAPERS = ("pixel2mesh", "atlasnet", "mesh_rcnn", "occnet")
SMALL = {name: {"points": 500} for name in ("modern", *PAPERS)}
NAMES = components.names("protocol")


@pytest.fixture(params=NAMES)
def protocol(request):
    """Each protocol, with few points."""
    return components.make("protocol", request.param, **SMALL.get(request.param, {}))


def test_settings_and_packages_decide_the_key():
    own = SurfaceProtocol(thresholds=(0.01,))
    assert own.key != SurfaceProtocol(thresholds=(0.5,)).key
    expected = "PaperProtocol(name='paper', points=1024, resolution=32, half_size=0.51)"
    assert PaperProtocol().key == expected, "as results of earlier versions have it"
    object.__setattr__(own, "component", components.Component("protocol", "own", {}, "a 0.1"))
    assert "a 0.1" in own.key


def test_metrics_have_columns_of_their_own(protocol):
    protocol.check_metrics("x")
    for names in ((), ("id",), ("err", "err"), ("err", "undeformed_err"), ("folded",)):
        object.__setattr__(protocol, "metrics", tuple(Metric(name, "") for name in names))
        with pytest.raises(ConfigError, match="protocol=x, metrics: "):
            protocol.check_metrics("x")


# The first template's control points in one place, all moved alike, and all far apart.
HOPELESS = {
    "collapsed": lambda control: np.float32([0.1, 0.2, 0.1]) - control,
    "far away": lambda control: np.full_like(control, 10),
    "huge": lambda control: 1e4 * control,
}


def test_every_protocol_is_described_and_scores_the_hopeless_badly(prepared, bank, protocol):
    description = ProtocolDescription.of(protocol)
    content = json.loads(json.dumps(description.to_json()))
    assert ProtocolDescription.from_json(content) == description
    with pytest.raises(ConfigError, match=f"{protocol.name} has no metric 'd': choose one of "):
        description.metric("d")
    reference = protocol.truth(PreparedShape(prepared, 3), np.random.default_rng(0))
    other = protocol.score(TemplateShape(bank, 0), reference, np.random.default_rng(1))
    for make, offsets in HOPELESS.items():
        shape = TemplateShape(bank, 0, offsets(bank.control_points[0].numpy()))
        assert not np.isnan([*shape.distortion().values()]).any()
        scores = protocol.score(shape, reference, np.random.default_rng(1))
        for metric in protocol.metrics:
            assert np.isfinite(scores[metric.name]), (make, metric.name)
            worse = scores[metric.name] - other[metric.name]
            if metric.name not in ("normal_consistency", "Normal", "Normal Consistency"):
                as_bad = (worse <= 0) if metric.higher_is_better else (worse > 0)
                assert as_bad, (make, metric.name)


def papers_numbers(name, pred, target, side):
    """The other papers' numbers from their formulas: squared distances, their thresholds."""
    points = target.points
    factor = {
        "pixel2mesh": 0.57,
        "atlasnet": 1 / max(np.linalg.norm(points - points.mean(axis=0), axis=1)),
        "mesh_rcnn": 10 / side,
        "occnet": 1 / side,
    }[name]
    squared = cdist(factor * pred.points, factor * points) ** 2
    there, back = squared.min(axis=1), squared.min(axis=0)

    def f(threshold):  # on squared distances
        p, r = np.mean(there < threshold), np.mean(back < threshold)
        return 2 * p * r / (p + r + 1e-8)

    cosines = np.abs(pred.normals @ target.normals.T)
    normals = np.mean(
        [
            np.take_along_axis(cosines, squared.argmin(1)[:, None], 1).mean(),
            np.take_along_axis(cosines, squared.argmin(0)[None], 0).mean(),
        ]
    )
    chamfer = there.mean() + back.mean()
    if name == "pixel2mesh":
        return {"CD": 1000 * chamfer, "F(1e-4)": 100 * f(1e-4), "F(2e-4)": 100 * f(2e-4)}
    if name == "atlasnet":
        return {"chamfer": chamfer, "fscore": f(0.001)}
    if name == "mesh_rcnn":
        shares = {f"F1({t})": 100 * f(t**2) for t in (0.1, 0.3, 0.5)}
        return {"Chamfer": chamfer, "Normal": normals, **shares}
    l1 = (np.sqrt(there).mean() + np.sqrt(back).mean()) / 2
    return {"Chamfer-L1": 10 * l1, "Normal Consistency": normals}


@pytest.mark.parametrize("name", PAPERS)
def test_other_papers_numbers_are_those_of_their_formulas(prepared, name):
    protocol = components.make("protocol", name, points=1500)
    shapes = PreparedShape(prepared, 3), PreparedShape(prepared, 8)
    truth = protocol.truth(shapes[0], np.random.default_rng(0))
    scores = protocol.score(shapes[1], truth, np.random.default_rng(1))
    target, pred = (
        sample_with_normals(*shape.mesh(), 1500, np.random.default_rng(seed))
        for seed, shape in enumerate(shapes)
    )
    vertices, faces = shapes[0].mesh()
    side = np.ptp(vertices[np.unique(faces)], axis=0).max()
    assert scores == pytest.approx(papers_numbers(name, pred, target, side), rel=1e-5)
    assert scores.keys() == {metric.name for metric in protocol.metrics}
