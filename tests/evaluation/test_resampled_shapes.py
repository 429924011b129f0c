import numpy as np
import pytest

from ffd_lightning.app.open_run import open_run
from ffd_lightning.evaluation.shapes import ResampledTemplate, TemplateShape
from ffd_lightning.geometry.ffd import num_control_points


def stretched(bank):
    """Offsets that leave one half of a lattice nearly as it is, and draw the other half out."""
    offsets = np.zeros((*(d + 1 for d in bank.degrees), 3), np.float32)
    offsets[-1, ..., 0] = 3
    return offsets.reshape(num_control_points(bank.degrees), 3)


def mean_of_surface(vertices, faces):
    corners = vertices[faces]
    sides = corners[:, 1:] - corners[:, :1]
    areas = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.average(corners.mean(axis=1), axis=0, weights=areas)


def mean_of_clouds(shape):
    draws = [shape.cloud(1000, np.random.default_rng(seed)) for seed in range(40)]
    return np.mean(draws, axis=(0, 1))


def test_resampled_points_are_spread_by_the_deformed_surfaces_area(tiny_run):
    bank = open_run(tiny_run).data.bank
    offsets = stretched(bank)
    for index in range(len(bank)):
        carried, anew = (kind(bank, index, offsets) for kind in (TemplateShape, ResampledTemplate))
        expected = mean_of_surface(*carried.mesh())
        assert mean_of_clouds(anew) == pytest.approx(expected, abs=0.03)
        assert mean_of_clouds(carried)[0] < expected[0] - 0.1, "thin where it is stretched"


def test_resampled_points_lie_on_the_deformed_surface(tiny_run):
    bank = open_run(tiny_run).data.bank
    shape = ResampledTemplate(bank, 0, stretched(bank))
    vertices, _ = shape.mesh()
    points = shape.cloud(200, np.random.default_rng(0))
    nearest = np.linalg.norm(points[:, None] - vertices, axis=2).min(axis=1)
    longest = 10 * bank.max_edge  # of an edge, drawn out
    assert points.shape == (200, 3)
    assert nearest.max() < longest
    assert np.array_equal(points, shape.cloud(200, np.random.default_rng(0)))
