"""Every protocol on shapes whose scores are known, and what results say of it."""

import json
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from ffd_lightning import components
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.candidates import PreparedShape, TemplateShape
from ffd_lightning.evaluation.protocols import (
    PaperProtocol,
    Protocol,
    ProtocolDescription,
    SurfaceProtocol,
)
from ffd_lightning.metrics.surface import sample_with_normals

SMALL = {"modern": {"points": 500}}
NAMES = components.names("protocol")


@pytest.fixture(params=NAMES)
def protocol(request):
    """Each protocol, with few points."""
    return components.make("protocol", request.param, **SMALL.get(request.param, {}))


def test_settings_and_packages_decide_the_key(monkeypatch):
    monkeypatch.setattr(components, "_registered", dict(components._registered))
    assert PaperProtocol(points=9).key != PaperProtocol().key
    assert SurfaceProtocol(thresholds=(0.01,)).key != SurfaceProtocol(thresholds=(0.5,)).key
    expected = "PaperProtocol(name='paper', points=1024, resolution=32, half_size=0.51)"
    assert PaperProtocol().key == expected, "as results of earlier versions have it"

    @components.component("protocol", "shares")
    @dataclass(frozen=True)
    class Shares(Protocol):
        within: tuple[float, ...]

        def truth(self, shape, rng): ...

        def score(self, candidate, truth, rng): ...

    assert Shares((0.01,)).key != Shares((0.5,)).key
    first = Shares((0.01,))
    object.__setattr__(first, "component", components.Component("protocol", "shares", {}, "a 0.1"))
    assert "a 0.1" in first.key


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
    content["measures"] = content.pop("metrics")
    assert ProtocolDescription.from_json(content) == description, "of an earlier version"
    reference = protocol.truth(PreparedShape(prepared, 3), np.random.default_rng(0))
    other = protocol.score(TemplateShape(bank, 0), reference, np.random.default_rng(1))
    for make, offsets in HOPELESS.items():
        shape = TemplateShape(bank, 0, offsets(bank.control_points[0].numpy()))
        assert not np.isnan([*shape.distortion().values()]).any()
        scores = protocol.score(shape, reference, np.random.default_rng(1))
        for metric in protocol.metrics:
            assert np.isfinite(scores[metric.name]), (make, metric.name)
            worse = scores[metric.name] - other[metric.name]
            if metric.name != "normal_consistency":
                as_bad = (worse <= 0) if metric.higher_is_better else (worse > 0)
                assert as_bad, (make, metric.name)


SCALES = {
    "box_diagonal": lambda surface, side: 1,
    "longest_side": lambda surface, side: 1 / side,
    "radius": lambda surface, side: (
        1 / np.linalg.norm(surface.points - surface.points.mean(0), axis=1).max()
    ),
}


@pytest.mark.parametrize("scale", SCALES)
def test_surfaces_are_scored_after_scaling(prepared, scale):
    """The formulas written down, on squared distances."""
    protocol = SurfaceProtocol(800, scale, 10.0, thresholds=(0.3,), voxels=())
    shapes = PreparedShape(prepared, 3), PreparedShape(prepared, 8)
    truth = protocol.truth(shapes[0], np.random.default_rng(0))
    scores = protocol.score(shapes[1], truth, np.random.default_rng(1))
    target, pred = (
        sample_with_normals(*shape.mesh(), 800, np.random.default_rng(seed))
        for seed, shape in enumerate(shapes)
    )
    vertices, faces = shapes[0].mesh()
    factor = 10 * SCALES[scale](target, np.ptp(vertices[np.unique(faces)], axis=0).max())
    squared = cdist(factor * pred.points, factor * target.points) ** 2
    there, back = squared.min(axis=1), squared.min(axis=0)
    p, r = np.mean(there < 0.09), np.mean(back < 0.09)
    assert scores["fscore_30"] == pytest.approx(2 * p * r / (p + r), rel=1e-5)
    assert scores["chamfer_l2"] == pytest.approx(there.mean() + back.mean(), rel=1e-5)
    l1 = (np.sqrt(there).mean() + np.sqrt(back).mean()) / 2
    assert scores["chamfer_l1"] == pytest.approx(l1, rel=1e-5)
    assert scores.keys() == {metric.name for metric in protocol.metrics}
