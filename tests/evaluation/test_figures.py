"""Pictures of reconstructions and templates."""

import numpy as np
import pytest
import torch

from ffd_lightning.app.open_run import open_run
from ffd_lightning.evaluation import figures
from ffd_lightning.evaluation.figures import (
    View,
    fitting_scale,
    reconstruction_figure,
    reconstruction_row,
)
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.grid import grid
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render


@pytest.fixture
def labels(monkeypatch):
    """What is written below the pictures of each grid."""
    kept = []

    def keep(cells, columns, words, *rest, **options):
        kept.append(words)
        return grid(cells, columns, words, *rest, **options)

    monkeypatch.setattr(figures, "grid", keep)
    return kept


def soup(points):
    faces = np.arange(len(points)).reshape(-1, 3)
    return Mesh(points, faces, np.full((len(faces), 4), (90, 140, 200, 255), np.uint8))


@pytest.mark.parametrize("size", [(96, 128), (160, 100)])
@pytest.mark.parametrize("camera", [Camera(230), *RenderSettings(camera="authors").cameras()])
def test_the_scale_is_the_largest_that_fits(size, camera):
    points = np.random.default_rng(0).normal(size=(9, 3)) + [0.3, -0.5, 0.2]
    view = View(camera, *size)
    scale = fitting_scale(points, view)
    assert 0 < scale < 1

    def on_border(factor):
        mesh = soup(factor * points)
        alpha = render(mesh, view.camera, height=view.height, width=view.width, samples=5)[..., 3]
        return bool(alpha[[0, -1]].any() or alpha[:, [0, -1]].any())

    assert not on_border(scale)
    assert on_border(1.1 * scale)
    assert fitting_scale(0.1 * scale * points, view) == 1


def test_a_row_is_drawn_at_one_scale_beside_its_image():
    view = View(Camera(0, 0), height=96, width=128)
    points = np.random.default_rng(0).normal(size=(30, 3))
    small, large = soup(0.05 * points), soup(3 * points)
    image = np.random.default_rng(0).integers(0, 255, (96, 128, 4), np.uint8)
    seen, alone = reconstruction_row(image, [small], view)
    np.testing.assert_array_equal(seen, image[..., :3])
    _, beside, whole = reconstruction_row(image, [small, large], view)
    covered = [int((picture < 255).any(2).sum()) for picture in (alone, beside, whole)]
    assert covered[1] < 0.25 * covered[0]
    assert covered[2] > 500
    assert (whole[[0, -1]] == 255).all(), "nothing is cut off"


def test_reconstructions_are_the_network_s_with_the_score_of_training(tiny_run, labels):
    opened = open_run(tiny_run)
    prepared, bank = opened.data.prepared, opened.data.bank
    rows = [int(row) for row in opened.data.rows(opened.data.split.test)[:3]]
    reconstruction_figure(opened.network, prepared, bank, rows)
    prediction = predict(opened.network, prepared, [Sample(row) for row in rows])
    for k, row in enumerate(rows):
        t = int(prediction.selected[k])
        offsets = torch.from_numpy(prediction.offsets[k, t])
        cloud = deform(bank.deformation_matrix[t], bank.control_points[t], offsets).numpy()
        squared = ((cloud[:, None] - prepared.cloud(row)[None, : len(cloud)]) ** 2).sum(2)
        score = 1000 * (squared.min(0).mean() + squared.min(1).mean())
        name, template, _, below, _ = labels[0][5 * k : 5 * k + 5]
        assert name == prepared.ids[row]
        assert template == f"{bank.ids[t]}\nweight {prediction.weights[k, t]:.2f}"
        assert float(below.removeprefix("box Chamfer x 1000: ")) == pytest.approx(score, abs=0.051)
