import numpy as np
import pytest

from ffd_lightning.evaluation.candidates import ResampledTemplate, TemplateShape
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


def test_resampled_points_are_spread_by_the_deformed_surfaces_area(bank):
    offsets = stretched(bank)
    for index in range(len(bank)):
        carried, anew = (kind(bank, index, offsets) for kind in (TemplateShape, ResampledTemplate))
        clouds = [
            np.mean([shape.cloud(1000, np.random.default_rng(k)) for k in range(40)], axis=(0, 1))
            for shape in (carried, anew)
        ]
        expected = mean_of_surface(*carried.mesh())
        # Of 256 points with a share for each face, the mean is off by 0.08 whatever is drawn.
        assert clouds[1] == pytest.approx(expected, abs=0.1)
        assert clouds[0][0] < expected[0] - 0.1, "thin where it is stretched"
