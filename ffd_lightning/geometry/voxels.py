"""Occupancy grids of triangle meshes: every voxel that the surface touches, and what it encloses.

Convention:
    A grid of resolution R divides the cube [low, high]^3 into R^3 voxels; `grid[i, j, k]` is the
    voxel whose centre is ``low + (i + 0.5, j + 0.5, k + 0.5) * (high - low) / R`` along x, y, z.
    The cube is the same for all meshes that are compared. What lies outside of it is cut off.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.geometry.compiled import jit

PAPER_HALF_SIZE = 0.51  # of a voxel: how far the boxes reach in the paper's evaluation

# Beyond this many voxels from the grid, products of three coordinates would overflow.
_FARTHEST = 1e100


def voxelize(
    vertices: ArrayLike,
    faces: ArrayLike,
    resolution: int = 32,
    half_size: float = PAPER_HALF_SIZE,
) -> NDArray[np.bool_]:
    """Return the voxels of [-0.5, 0.5]^3 that a mesh touches or encloses, (R, R, R).

    `surface_voxels`, then `fill_voxels`. The paper's numbers are with the defaults. A mesh that
    sticks out of the grid is open where it is cut off, hence not filled from there.

    Source: the paper's section 3.1 (intersection over union on a grid of 32^3).

    >>> tetrahedron = [[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], [-0.5, 0.5, -0.5], [-0.5, -0.5, 0.5]]
    >>> int(voxelize(tetrahedron, [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]], 8).sum())
    162
    """
    return fill_voxels(surface_voxels(vertices, faces, resolution, half_size=half_size))


def surface_voxels(
    vertices: ArrayLike,
    faces: ArrayLike,
    resolution: int = 32,
    low: float = -0.5,
    high: float = 0.5,
    half_size: float = 0.5,
) -> NDArray[np.bool_]:
    """Return the voxels whose closed box touches a closed triangle, (R, R, R) indexed [x, y, z].

    No contact is missed, one in a single point included: a triangle in the plane between two voxels
    belongs to both. The test along x, y and z is exact; along the ten other axes boxes are larger
    by what rounding may take away, 2e-15 of the largest distance from the grid's corner. Triangles
    without area count as the segments or points that they are.

    Args:
        vertices: (V, 3) positions.
        faces: (F, 3) vertex indices; none give an empty grid.
        resolution: R, voxels along each axis.
        low: lower end of the grid along each axis, in units of the vertices.
        high: upper end.
        half_size: of a voxel's box, in voxels: 0.5 for the voxel itself; the paper's authors
            measured with 0.51. Above 0.5 the outermost voxels also feel what is just outside.

    Raises:
        ValueError: vertices that are not finite or absurdly far away (1e100 voxels), or that faces
            name and that are not there.

    Source: Akenine-Möller 2001, "Fast 3D triangle-box overlap testing": thirteen separating axes.

    >>> surface_voxels([[0.1, 0.1, 0.1], [0.9, 0.1, 0.1], [0.1, 0.1, 0.1]], [[0, 1, 2]], 2, 0, 1)
    array([[[ True, False],
            [False, False]],
    <BLANKLINE>
           [[ True, False],
            [False, False]]])
    """
    points = np.asarray(vertices, np.float64).reshape(-1, 3)
    triangles = np.ascontiguousarray(faces, np.int64).reshape(-1, 3)
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(points):
        raise ValueError(f"faces name vertices that are not among the {len(points)}")
    with np.errstate(over="ignore", invalid="ignore"):
        scaled = (points - low) * (resolution / (high - low))
    if not np.abs(scaled).max(initial=0) < _FARTHEST:
        raise ValueError("vertices must be finite, and less than 1e100 voxels away")
    grid = np.zeros((resolution, resolution, resolution), np.bool_)
    _mark(scaled, triangles, float(half_size), grid)
    return grid


def fill_voxels(surface: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a surface (X, Y, Z) with all it encloses: voxels without a free way to the outside.

    A way leads through voxels' faces (6-connected); all around the grid is free. The same as
    `scipy.ndimage.binary_fill_holes`, several times faster.

    >>> shell = np.ones((3, 3, 3), bool)
    >>> shell[1, 1, 1] = False
    >>> bool(fill_voxels(shell).all())
    True
    """
    from scipy.ndimage import label

    labels, _ = label(np.pad(~np.asarray(surface, bool), 1, constant_values=True))
    return labels[1:-1, 1:-1, 1:-1] != labels[0, 0, 0]


@jit
def _mark(
    points: NDArray, faces: NDArray, half: float, grid: NDArray
) -> None:  # pragma: no cover - compiled
    """Mark the voxels that triangles touch; points (V, 3) are in voxels from the grid's corner."""
    size = grid.shape[0]
    corners = np.empty((3, 3))
    first, last = np.empty(3, np.int64), np.empty(3, np.int64)
    axes, low, high = np.empty((10, 3)), np.empty(10), np.empty(10)
    for face in range(len(faces)):
        for c in range(3):
            for k in range(3):
                corners[c, k] = points[faces[face, c], k]
        if not _box(corners, half, size, first, last) or _all_marked(grid, first, last):
            continue
        _slanted_axes(corners, half, size, axes, low, high)
        for i in range(first[0], last[0] + 1):
            for j in range(first[1], last[1] + 1):
                start, stop = _run(i + 0.5, j + 0.5, first[2], last[2], axes, low, high)
                grid[i, j, start:stop] = True


@jit
def _box(
    corners: NDArray, half: float, size: int, first: NDArray, last: NDArray
) -> bool:  # pragma: no cover - compiled
    """Write the voxels, first to last, that the triangle's bounding box touches; False if none."""
    for k in range(3):
        low = min(corners[0, k], corners[1, k], corners[2, k])
        high = max(corners[0, k], corners[1, k], corners[2, k])
        # Compared as floats: far coordinates don't fit into an integer.
        start = max(np.ceil(low - (half + 0.5)), 0.0)
        stop = min(np.floor(high + (half - 0.5)), size - 1.0)
        if start > stop:
            return False
        first[k], last[k] = int(start), int(stop)
    return True


@jit
def _all_marked(grid: NDArray, first: NDArray, last: NDArray) -> bool:  # pragma: no cover
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            for k in range(first[2], last[2] + 1):
                if not grid[i, j, k]:
                    return False
    return True


@jit
def _slanted_axes(
    corners: NDArray, half: float, size: int, axes: NDArray, low: NDArray, high: NDArray
) -> None:  # pragma: no cover - compiled
    """Write the ten slanted axes and between what a touching box's centre projects onto each.

    They are the cross products of each edge with z, y and x, and the normal. One that comes out as
    zero separates nothing.
    """
    farthest = float(size)
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        for c in range(3):
            axis, c1 = axes[3 * (2 - k) + c], (c + 1) % 3
            axis[k] = 0.0
            axis[k1] = corners[c, k2] - corners[c1, k2]
            axis[k2] = corners[c1, k1] - corners[c, k1]
            farthest = max(farthest, abs(corners[c, k]))
        u1, u2 = corners[1, k1] - corners[0, k1], corners[1, k2] - corners[0, k2]
        v1, v2 = corners[2, k1] - corners[0, k1], corners[2, k2] - corners[0, k2]
        axes[9, k] = u1 * v2 - u2 * v1
    # What is computed here and in `_run` is off by less than 8 eps of the largest coordinate. A
    # rounded axis is an axis like any other, as all three corners are projected onto it.
    reach = half + 8 * np.finfo(np.float64).eps * farthest
    for a in range(10):
        x, y, z = axes[a, 0], axes[a, 1], axes[a, 2]
        p0 = x * corners[0, 0] + y * corners[0, 1] + z * corners[0, 2]
        p1 = x * corners[1, 0] + y * corners[1, 1] + z * corners[1, 2]
        p2 = x * corners[2, 0] + y * corners[2, 1] + z * corners[2, 2]
        radius = reach * (abs(x) + abs(y) + abs(z))
        low[a], high[a] = min(p0, p1, p2) - radius, max(p0, p1, p2) + radius


@jit
def _run(
    x: float, y: float, first: int, last: int, axes: NDArray, low: NDArray, high: NDArray
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return start and stop, among voxels first..last of the row at (x, y), of those touched.

    What an axis leaves of a row is an interval, and so is what all of them leave.
    """
    bottom, top = first + 0.5, last + 0.5
    for a in range(10):
        height, along = axes[a, 0] * x + axes[a, 1] * y, axes[a, 2]
        if along == 0:
            if height < low[a] or height > high[a]:
                return 0, 0
        else:
            one, other = (low[a] - height) / along, (high[a] - height) / along
            bottom, top = max(bottom, min(one, other)), min(top, max(one, other))
    if bottom > top:  # by any amount: too far for an integer, perhaps
        return 0, 0
    return int(np.ceil(bottom - 0.5)), int(np.floor(top - 0.5)) + 1
