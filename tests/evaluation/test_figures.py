import numpy as np
import pytest
import torch

from ffd_lightning.app.open_run import open_run
from ffd_lightning.evaluation import figures
from ffd_lightning.evaluation.figures import cloud_mesh, reconstruction_figure
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.imaging.rendering import render


def test_a_cloud_becomes_one_octahedron_per_point_at_its_place():
    points = np.array([[0, 0, 0], [0.2, 0.3, -0.1]])
    mesh = cloud_mesh(points, radius=0.01)
    assert mesh.faces.shape == (16, 3)
    centers = mesh.vertices.reshape(2, 6, 3).mean(1)
    np.testing.assert_allclose(centers, points, atol=1e-12)
    assert np.abs(mesh.vertices.reshape(2, 6, 3) - points[:, None]).max() <= 0.01 + 1e-12
    assert (mesh.face_colors[:8] != mesh.face_colors[8:]).any()
    assert (render(mesh, height=48, width=64, samples=2)[..., 3] > 0).any()


def test_a_cloud_of_one_height_has_a_colour():
    mesh = cloud_mesh(np.zeros((3, 3)))
    assert (mesh.face_colors[:, 3] == 255).all()


def test_points_take_the_colours_they_are_given():
    colors = np.array([[9, 8, 7, 255], [1, 2, 3, 255]], np.uint8)
    mesh = cloud_mesh(np.eye(3)[:2], colors=colors)
    np.testing.assert_array_equal(mesh.face_colors, np.repeat(colors, 8, axis=0))


def test_reconstructions_have_headings_once_and_the_score_of_training(tiny_run, monkeypatch):
    sheets = []

    def sheet(cells, columns, labels, headings, font_size):
        sheets.append((cells, labels, headings))
        return np.zeros((1, 1, 3), np.uint8)

    monkeypatch.setattr(figures, "contact_sheet", sheet)
    opened = open_run(tiny_run)
    prepared, bank = opened.data.prepared, opened.data.bank
    rows = opened.data.rows(opened.data.split.test)[:3]
    reconstruction_figure(opened.network, prepared, bank, rows)
    ((cells, labels, headings),) = sheets
    assert len(headings) == 5
    assert len(cells) == len(labels) == 15
    prediction = predict(opened.network, prepared, [Sample(int(row)) for row in rows])
    for k, row in enumerate(rows):
        t = int(prediction.selected[k])
        offsets = torch.from_numpy(prediction.offsets[k, t])
        cloud = deform(bank.deformation_matrix[t], bank.control_points[t], offsets).numpy()
        squared = ((cloud[:, None] - prepared.cloud(row)[None, : len(cloud)]) ** 2).sum(2)
        score = 1000 * (squared.min(0).mean() + squared.min(1).mean())
        name, template, _, below, _ = labels[5 * k : 5 * k + 5]
        assert name == prepared.ids[row]
        assert template == f"{bank.ids[t]}\nweight {prediction.weights[k, t]:.2f}"
        title, value = below.split(": ")
        assert title == "box Chamfer x 1000"
        assert float(value) == pytest.approx(score, abs=0.051)
