import numpy as np
import pytest

from ffd_lightning.geometry.normalization import normalize


def random_points(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(50, 3)) * rng.uniform(0.01, 100, 3) + rng.normal(size=3) * 1e3


@pytest.mark.parametrize("seed", range(5))
def test_box_is_centred_with_diagonal_one(seed: int) -> None:
    points = normalize(random_points(seed))
    low, high = points.min(0), points.max(0)
    np.testing.assert_allclose(low + high, 0, atol=1e-12)
    assert np.sqrt(((high - low) ** 2).sum()) == pytest.approx(1, abs=1e-12)


def test_shape_is_kept_whatever_the_unit_and_place() -> None:
    points = random_points(0)
    moved = normalize(points * 254.0 + [10, -20, 30])
    np.testing.assert_allclose(moved, normalize(points), atol=1e-9)
    before = np.linalg.norm(points[0] - points[1]) / np.linalg.norm(points[2] - points[3])
    after = np.linalg.norm(moved[0] - moved[1]) / np.linalg.norm(moved[2] - moved[3])
    assert after == pytest.approx(before)


def test_vertices_that_no_face_uses_do_not_count() -> None:
    corners = np.array([[0, 0, 0], [3, 0, 0], [0, 4, 0]], float)
    stray = np.vstack([corners, [[1e6, 0, 0]], np.full((1, 3), np.nan)])
    points = normalize(stray, [[0, 1, 2]])
    np.testing.assert_allclose(points[:3], normalize(corners))
    assert points.shape == stray.shape
    assert points.dtype == np.float64


def test_flat_shapes_are_good() -> None:
    points = normalize([[0, 5, 0], [1, 5, 0], [1, 5, 1]])
    np.testing.assert_array_equal(points[:, 1], 0)


@pytest.mark.parametrize(
    ("vertices", "faces", "message"),
    [
        (np.zeros((0, 3)), None, "no vertices"),
        (np.eye(3), np.zeros((0, 3), int), "no vertices"),
        (np.ones((4, 3)), None, "no extent"),
        ([[0, 0, 0], [np.nan, 1, 1]], None, "finite"),
        ([[0, 0, 0], [np.inf, 1, 1]], None, "finite"),
    ],
)
def test_what_has_no_box_is_refused(vertices, faces, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        normalize(vertices, faces)
