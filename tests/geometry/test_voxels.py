import itertools
from fractions import Fraction

import numpy as np
import pytest
import trimesh
from scipy.ndimage import binary_fill_holes

from ffd_lightning.geometry.voxels import fill_voxels, surface_voxels, voxelize

ONE = [[0, 1, 2]]
SIZE = 3


def touches(triangle, box_low, box_high):
    """Clip a triangle against the six half-spaces of a closed box, in exact arithmetic."""
    polygon = [tuple(map(Fraction, map(float, corner))) for corner in triangle]
    for axis in range(3):
        for sign, bound in ((1, box_low[axis]), (-1, box_high[axis])):
            kept = []
            for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
                d, e = sign * (p[axis] - bound), sign * (q[axis] - bound)
                if d >= 0:
                    kept.append(p)
                if d * e < 0:
                    kept.append(tuple(a + (b - a) * d / (d - e) for a, b in zip(p, q, strict=True)))
            polygon = kept
            if not polygon:
                return False
    return True


def by_clipping(triangle, half):
    """The grid of one triangle over [0, SIZE]^3, from definitions alone."""
    grid, reach = np.zeros((SIZE,) * 3, bool), Fraction(half)
    for voxel in np.ndindex(grid.shape):
        centre = [Fraction(2 * int(i) + 1, 2) for i in voxel]
        grid[voxel] = touches(triangle, [c - reach for c in centre], [c + reach for c in centre])
    return grid


def of_one(triangle, half=0.5):
    return surface_voxels(triangle, ONE, SIZE, 0, SIZE, half)


def needle(rng):
    start, end = rng.uniform(-1, SIZE + 1, (2, 3))
    aside = rng.normal(size=3) * 10.0 ** -rng.integers(17)
    return [start, end, start + 0.4 * (end - start) + aside]


def flat(rng):
    """In the plane between two voxels or, for small boxes, in that of their sides."""
    plane = rng.choice([1.75, 2])
    return np.where(np.arange(3) == rng.integers(3), plane, rng.uniform(0, SIZE, (3, 3)))


def far(rng):
    return rng.integers(-(2**30), 2**30, (3, 3))


def huge(rng):
    """Whose inner point is a corner of voxels, exactly."""
    corners = far(rng)
    return corners - (corners[0] + corners[1] + 2 * corners[2]) / 4 + rng.integers(0, SIZE, 3)


def huge_edge(rng):
    """Through a corner of voxels, in the middle of an edge."""
    step, third = far(rng)[:2]
    return rng.integers(0, SIZE + 1, 3) + np.array([-step, step, third])


def folded(rng):
    """No area: three dyadic points on one line."""
    start, step = rng.integers(-4, 4 * SIZE + 4, 3) / 4, rng.integers(-6, 7, 3) / 4
    return start + rng.integers(-2, 3, (3, 1)) * step


TRIANGLES = {
    "any": lambda rng: rng.uniform(-1, SIZE + 1, (3, 3)),
    "dyadic": lambda rng: rng.integers(-4, 4 * SIZE + 4, (3, 3)) / 4,  # contacts everywhere
    "flat": flat,
    "huge": huge,
    "huge edge": huge_edge,
    "needle": needle,
    "folded": folded,
    "point": lambda rng: np.tile(rng.integers(0, 4 * SIZE + 1, 3) / 4, (3, 1)),
}


@pytest.mark.parametrize("half", [0.5, 0.51, 0.25, 1.25])
@pytest.mark.parametrize("kind", TRIANGLES)
def test_matches_exact_clipping(kind, half):
    rng = np.random.default_rng([list(TRIANGLES).index(kind), int(100 * half)])
    marked = 0
    for _ in range(8):
        triangle = np.asarray(TRIANGLES[kind](rng), float)
        expected = by_clipping(triangle, half)
        np.testing.assert_array_equal(of_one(triangle, half), expected, str(triangle.tolist()))
        marked += expected.sum()
    assert 0 < marked < 8 * SIZE**3


@pytest.mark.parametrize("scale", [1.1, 1.1e6])
def test_slanted_contacts_survive_rounding(scale):
    """The plane x = y runs through voxels' edges, at coordinates that no float holds exactly."""
    rng = np.random.default_rng(0)
    diagonal = np.abs(np.subtract.outer(np.arange(32), np.arange(32))) <= 1
    for _ in range(20):
        s = rng.uniform(0.5, 3, 4)
        corners = [[s[0], s[0], -s[1]], [-s[1], -s[1], s[2]], [s[3], s[3], 3], [-3, -3, -3]]
        grid = surface_voxels(np.array(corners) * scale, [[0, 1, 2], [0, 1, 3]])
        assert not grid[~diagonal].any()
        touched = grid.any(2)
        np.testing.assert_array_equal(touched, touched.T)
        assert touched[diagonal].all()


def test_fill_matches_scipy():
    rng = np.random.default_rng(0)
    shapes = (12, 12, 12), (5, 9, 17), (1, 6, 6)
    for shape, density in itertools.product(shapes, (0.3, 0.5, 0.65, 0.8)):
        surface = rng.random(shape) < density
        np.testing.assert_array_equal(fill_voxels(surface), binary_fill_holes(surface))


def box(side):
    mesh = trimesh.creation.box((side,) * 3)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def test_a_box_is_exact_and_the_papers_voxels_reach_a_little_further():
    vertices, faces = box((16 - 0.01) / 32)  # 0.005 voxels short of the next ones
    assert voxelize(vertices, faces, half_size=0.5).sum() == 16**3
    assert voxelize(vertices, faces).sum() == 18**3
    vertices, faces = box(15 / 32)
    expected = np.zeros((32,) * 3, bool)
    expected[8:24, 8:24, 8:24] = True
    for half in (0.5, 0.51):
        np.testing.assert_array_equal(voxelize(vertices, faces, half_size=half), expected)
    assert surface_voxels(vertices, faces).sum() == 16**3 - 14**3
