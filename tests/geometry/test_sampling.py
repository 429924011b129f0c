from types import SimpleNamespace

import numpy as np
from scipy import stats

from ffd_lightning.geometry.sampling import sample_stratified, sample_surface

# One triangle of each area 1, 0 (a line), 3, 0 (a point), 6, and an unused vertex that is not
# finite; apart along z so that a point tells its triangle.
VERTICES = np.array(
    [
        *([0, 0, 0], [2, 0, 0], [0, 1, 0]),
        *([0, 0, 1], [1, 0, 1], [2, 0, 1]),
        *([0, 0, 2], [2, 0, 2], [0, 3, 2]),
        *([5, 5, 3], [5, 5, 3], [5, 5, 3]),
        *([0, 0, 4], [3, 0, 4], [7, 4, 4]),
        [np.nan, 0, 0],
    ]
)
FACES = np.arange(15).reshape(5, 3)
AREAS = np.array([1.0, 0, 3, 0, 6])


def test_faces_are_drawn_by_area_and_degenerate_ones_never() -> None:
    points, faces = sample_surface(VERTICES, FACES, 20_000, np.random.default_rng(0))
    assert (points.shape, points.dtype) == ((20_000, 3), np.float32)
    assert (faces.shape, faces.dtype) == ((20_000,), np.int32)
    counts = np.bincount(faces, minlength=5)
    assert counts[AREAS == 0].sum() == 0
    drawn = AREAS > 0
    expected = 20_000 * AREAS[drawn] / AREAS.sum()
    assert stats.chisquare(counts[drawn], expected).pvalue > 1e-3
    np.testing.assert_array_equal(points[:, 2], faces)


def test_points_are_uniform_within_the_triangle() -> None:
    triangle = np.array([[0.3, -1, 2], [4, 1, 0], [1, 3, 5]])
    points, _ = sample_surface(triangle, [[0, 1, 2]], 16_000, np.random.default_rng(1))
    edges = (triangle[1:] - triangle[0]).T
    (u, v), residual, *_ = np.linalg.lstsq(edges, (points - triangle[0]).T, rcond=None)
    assert residual.max() < 1e-9  # in the plane
    assert min(u.min(), v.min(), (1 - u - v).min()) > -1e-5  # in the triangle
    # Cut into 16 triangles of one area by the grid lines u, v, u + v = k / 4.
    cell = (4 * u).astype(int) * 16 + (4 * v).astype(int) * 4 * 4 * 4 + (4 * (u + v)).astype(int)
    counts = np.unique(cell, return_counts=True)[1]
    assert len(counts) == 16
    assert stats.chisquare(counts).pvalue > 1e-3


def test_the_largest_draw_takes_the_last_face_with_area() -> None:
    faces = [[0, 1, 2], [3, 4, 5]]
    largest = SimpleNamespace(random=lambda size: np.full(size, np.nextafter(1, 0)))
    _, drawn = sample_surface(VERTICES, faces, 3, largest)
    np.testing.assert_array_equal(drawn, 0)


def test_stratified_points_give_each_face_its_share() -> None:
    points, faces = sample_stratified(VERTICES, FACES, 1001, np.random.default_rng(0))
    assert (points.shape, points.dtype) == ((1001, 3), np.float32)
    # By hand: the cumulated areas 1, 1, 4, 4, 10 times 100.1 are rounded, and the steps taken.
    np.testing.assert_array_equal(np.bincount(faces, minlength=5), [100, 0, 300, 0, 601])
    np.testing.assert_array_equal(points[:, 2], faces)
