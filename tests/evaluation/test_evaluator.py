"""Whole evaluations: what is written, the numbers again from their definitions, and resuming."""

import csv
import hashlib
import json

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation import evaluator
from ffd_lightning.evaluation import samples as samples_module
from ffd_lightning.evaluation.candidates import PreparedShape
from ffd_lightning.evaluation.protocols.base import COLUMNS
from ffd_lightning.evaluation.samples import Sample, predict, predict_in_chunks
from ffd_lightning.evaluation.summaries import template_ranking
from ffd_lightning.files import lock_folder


def rows_of(text):
    return list(csv.DictReader(text.splitlines()))


def twice_drawn(mesh, count, rng):
    """Points of which each face has its share, and as many of those again, with replacement."""
    corners = mesh.vertices[mesh.faces]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    ends = np.round(areas.cumsum() / areas.sum() * count).astype(int)
    order = rng.permutation(np.searchsorted(ends, np.arange(count), side="right"))
    u, v = rng.random((2, count))
    points = np.empty((count, 3))
    for k, face in enumerate(order):
        s, t = (u[k], v[k]) if u[k] + v[k] <= 1 else (1 - u[k], 1 - v[k])
        a, b, c = corners[face]
        points[k] = a + s * (b - a) + t * (c - a)
    return points[rng.integers(count, size=count)]


def test_the_numbers_are_the_papers(case, tmp_path):
    """Chamfer and EMD of each sample again, from the definitions and by other libraries."""
    one = case()
    evaluated, prepared = one.evaluated, one.prepared
    bank = evaluated.bank
    outputs = predict(evaluated.network, prepared, evaluated.tested_on.samples(all_views=False))
    for k, row in enumerate(rows_of(one.run(tmp_path, references=False))):
        place = prepared.index(row["id"])
        mesh = prepared.mesh(place)
        shape, rng = PreparedShape(prepared, place), np.random.default_rng()
        center = one.protocol.truth(shape, rng).frame.center
        radius = np.linalg.norm(mesh.vertices[np.unique(mesh.faces)] - center, axis=1).max()
        key = int.from_bytes(hashlib.sha256(row["id"].encode()).digest()[:8], "big")
        truth = twice_drawn(mesh, 24, np.random.default_rng([0, key, 0]))
        drawn = np.random.default_rng([0, key, 1]).integers(256, size=24)
        t = bank.ids.index(row["template"])
        assert t == outputs.weights[k].argmax()
        moved = bank.control_points[t] + outputs.offsets[k, t]
        cloud = (bank.deformation_matrix[t] @ moved).numpy()[drawn].astype(float)
        a, b = ((x - center) * 3.2 / radius for x in (cloud, truth))
        distances = cdist(a, b)
        chamfer = (distances.min(0) ** 2).mean() + (distances.min(1) ** 2).mean()
        assert float(row["chamfer"]) == pytest.approx(chamfer, rel=1e-4)
        pairs = linear_sum_assignment(distances)
        assert float(row["emd"]) == pytest.approx(distances[pairs].mean(), rel=1e-4)


def test_nothing_but_the_weights_and_the_seed_decides_the_numbers(case, tmp_path):
    alone = case().run(tmp_path / "one", references=False, workers=1)
    assert case().run(tmp_path / "many", references=False, workers=3) == alone
    other = case().run(tmp_path / "seed", references=False, seed=1)
    first, second = rows_of(alone)[0], rows_of(other)[0]
    assert first["chamfer"] != second["chamfer"]
    assert first["iou"] == second["iou"], "voxels are not drawn"


def test_a_finished_evaluation_is_read_back(case, fits, tmp_path, monkeypatch):
    text = case().run(tmp_path)
    assert not (tmp_path / "samples.partial").exists()
    there = {*rows_of(text)[0], *json.loads((tmp_path / "summary.json").read_text())}
    assert {name for name in there if not name.endswith(("chamfer", "emd", "iou"))} <= {*COLUMNS}
    monkeypatch.setattr(evaluator, "predict", None)
    assert case().run(tmp_path) == text
    assert case().run(tmp_path, references=False) == text, "it has references too"
    with lock_folder(tmp_path, ""), pytest.raises(ConfigError, match="evaluates"):
        case(seed=1).run(tmp_path)


def test_a_network_that_has_diverged_is_said_and_not_averaged(case):
    evaluated = case().evaluated
    evaluated.network.offsets.data[:] = float("nan")
    with pytest.raises(DataError, match="not finite"):
        predict(evaluated.network, evaluated.tested_on.prepared, [Sample(6)])


def test_a_ranking_is_the_same_however_many_images_are_counted_at_once(case, monkeypatch):
    evaluated = case(tested_on=tuple(range(6, 17))).evaluated
    samples, prepared = evaluated.tested_on.samples(all_views=False), evaluated.tested_on.prepared
    monkeypatch.setattr(samples_module, "_AT_ONCE", 4)
    predictions = predict_in_chunks(evaluated.network, prepared, samples, workers=1)
    ranking = template_ranking(evaluated.bank, predictions)
    found = predict(evaluated.network, prepared, samples)
    weights = dict(zip(evaluated.bank.ids, found.weights.mean(0).tolist(), strict=True))
    assert {row["id"]: row["mean_weight"] for row in ranking} == pytest.approx(weights, rel=1e-5)
    counts = np.bincount(found.selected, minlength=2)
    assert [row["count"] for row in ranking] == sorted(counts, reverse=True)
