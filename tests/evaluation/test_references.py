"""The references, and their scores: computed once, and the same however they are come by."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.distance import cdist

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation import references
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.evaluation.references import NetworkFree, best_template, fitted_template, medoid
from ffd_lightning.evaluation.samples import Subset
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.geometry.mesh import Mesh


@pytest.fixture
def runs(tmp_path):
    """Names of folders to evaluate into, each once."""
    return (tmp_path / f"run{k}" for k in range(100))


@pytest.fixture
def shared(tmp_path):
    return tmp_path / "references"


def naive(a, b):
    squared = cdist(a.astype(float), b.astype(float)) ** 2
    return squared.min(0).mean() + squared.min(1).mean()


def test_the_nearest_training_shape_and_the_medoid(prepared, bank):
    among = list(range(5, 20))
    retrieval = NetworkFree(bank, Subset(prepared, np.array(among)), seed=0)
    for row in (0, 21, 7):
        distances = [naive(prepared.cloud(row), prepared.cloud(k)) for k in among]
        assert retrieval.nearest(prepared.cloud(row)) == among[int(np.argmin(distances))]
    totals = [sum(naive(prepared.cloud(a), prepared.cloud(b)) for b in among) for a in among]
    assert medoid(prepared, among) == among[int(np.argmin(totals))]


def test_the_best_templates(prepared, bank):
    offsets = 0.1 * np.random.default_rng(0).normal(size=(2, 64, 3)).astype("f4")
    for row in (5, 9, 14):
        truth = prepared.cloud(row)
        as_is = [naive(bank.points[t].numpy(), truth) for t in (0, 1)]
        moved = bank.deformation_matrix @ (bank.control_points + offsets)
        deformed = [naive(moved[t].numpy(), truth) for t in (0, 1)]
        best = [best_template(prepared, row, bank, x) for x in (None, offsets)]
        assert best == [int(np.argmin(as_is)), int(np.argmin(deformed))]


def test_another_network_finds_the_scores_and_they_change_nothing(
    case, runs, shared, fits, monkeypatch
):
    first, second = case(), case(seed=1)
    alone = [each.run(next(runs)) for each in (first, second)]
    assert alone[0] != alone[1]
    assert len(fits) == 6
    assert first.run(next(runs), shared) == alone[0]
    with monkeypatch.context() as patch:
        patch.setattr(references, "fitted_template", None)
        patch.setattr(references, "medoid", None)
        assert second.run(next(runs), shared, workers=3) == alone[1]
    assert len(fits) == 9, "all were known"
    folder = next(runs)
    assert first.run(folder, shared, restart=True) == alone[0]
    assert len(fits) == 12


@pytest.mark.parametrize(
    "change",
    [
        {"trained_on": (5, 4, 3, 2)},
        {"protocol": PaperProtocol(points=25)},
        {"options": {"seed": 1}},
        {"bank": {"degrees": (1, 7, 3)}},
        {"prepared": "another"},
    ],
    ids=lambda change: next(iter(change)),
)
def test_another_evaluation_does_not_read_them(case, runs, shared, fits, prepared, change):
    case().run(next(runs), shared)
    if "prepared" in change:
        (manifest,) = prepared.manifests
        change = {"prepared": replace(prepared, manifests=({**manifest, "sha256": "another"},))}
    other = case(seed=1, **change)
    expected, made = other.run(next(runs)), len(fits)
    assert other.run(next(runs), shared) == expected
    assert len(fits) == made + 3, "none of them was known"


def test_an_evaluation_that_was_cut_off_goes_on(case, runs, shared, fits, monkeypatch):
    expected, folder, fit = case().run(next(runs)), next(runs), references.fitted_template

    def cut_off(*arguments):
        if len(fits) == 3 + 2:
            raise KeyboardInterrupt
        return fit(*arguments)

    with monkeypatch.context() as patch:
        patch.setattr(references, "fitted_template", cut_off)
        with pytest.raises(KeyboardInterrupt):
            case().run(folder, shared)
    assert case().run(folder, shared) == expected
    assert len(fits) == 3 + 3
    more = case(tested_on=(7, 8, 9))
    expected, made = more.run(next(runs)), len(fits)
    assert more.run(next(runs), shared) == expected
    assert len(fits) == made + 1, "others have tested two of these shapes"
    assert more.run(next(runs), shared / "absent" / "references") == expected


def bank_of(clouds):
    corners = np.array([[-0.5, -0.5, -0.5], [0.5, 0.5, 0.5], [0.5, -0.5, 0.5]])
    meshes = (Mesh(corners, np.array([[0, 1, 2]]), np.full((1, 4), 255, np.uint8)),) * len(clouds)
    names = tuple("abc"[: len(clouds)])
    return TemplateBank(names, names, torch.from_numpy(np.stack(clouds)), meshes)


def test_a_deformed_template_is_found_and_fitted_again():
    rng = np.random.default_rng(0)
    ball = rng.normal(size=(2048, 3))
    ball *= 0.4 / np.linalg.norm(ball, axis=1, keepdims=True)
    rod = rng.uniform(-0.5, 0.5, (2048, 3)) * [1, 0.05, 0.05]
    bank = bank_of([ball.astype(np.float32), rod.astype(np.float32)])
    offsets = torch.from_numpy(0.1 * rng.normal(size=(64, 3))).float()
    truth = deform(bank.deformation_matrix[1], bank.control_points[1], offsets)
    index, found = fitted_template(bank, truth.numpy(), seed=0)
    assert index == 1
    moved = deform(bank.deformation_matrix[1], bank.control_points[1], torch.from_numpy(found))
    before = chamfer_distance(bank.points[1], truth, "mean")
    assert chamfer_distance(moved, truth, "mean") < 0.1 * before
    again = fitted_template(bank, truth.numpy(), seed=0)
    np.testing.assert_array_equal(found, again[1])
