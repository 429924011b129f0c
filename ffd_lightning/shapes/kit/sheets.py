"""What is bent: curved sheets, arcs, and all that a builder is given."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ffd_lightning.shapes.kit import Builder, Material
from ffd_lightning.shapes.kit.vectors import Array, Pair


def sheet(b: Builder, part: str, material: Material, grid: ArrayLike, thickness: float) -> None:
    """Add a curved sheet: a grid of points (n, m, 3) thickened along its normals."""
    points = np.asarray(grid, float)
    n, m = points.shape[:2]
    normals = np.cross(np.gradient(points, axis=0), np.gradient(points, axis=1))
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    offset = normals * thickness / 2
    index = np.arange(n * m).reshape(n, m)
    border = np.concatenate([index[0], index[1:, -1], index[-1, -2::-1], index[-2:0:-1, 0]])
    following = np.roll(border, -1)
    quads = [(index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:])]
    quads += [tuple(q + n * m for q in quads[0])]
    quads += [(border, following, following + n * m, border + n * m)]
    faces = [np.stack([q[i].ravel() for i in t], 1) for q in quads for t in ((0, 1, 2), (0, 2, 3))]
    vertices = np.concatenate([(points + offset).reshape(-1, 3), (points - offset).reshape(-1, 3)])
    b.add(part, material, vertices, np.concatenate(faces))


def arc(
    b: Builder, part: str, material: Material, radii: Pair, heights: Pair, angles: Array
) -> None:
    """Sweep a chamfered rectangle around the y axis; angle 0 is +z."""
    flat = np.array(
        [(0, 0.06), (0.1, 0), (0.9, 0), (1, 0.06), (1, 0.9), (0.88, 1), (0.12, 1), (0, 0.9)]
    )
    r = radii[0] + flat[:, 0] * (radii[1] - radii[0])
    y = heights[0] + flat[:, 1] * (heights[1] - heights[0])
    rings = [np.stack([r * np.sin(angle), y, r * np.cos(angle)], 1) for angle in angles]
    b.loft(part, material, rings)


class Bent(Builder):
    """Draws into another builder, triangles cut until none is longer than `limit` along x.

    `bend` moves their vertices (v, 3) then.
    """

    def __init__(self, target: Builder, bend: Callable[[Array], Array], limit: float) -> None:
        super().__init__()
        self.target, self.bend, self.limit = target, bend, limit

    def add(self, part: str, material: Material, vertices: ArrayLike, faces: ArrayLike) -> None:
        """Add triangles, cut at the middles of their edges and bent."""
        v = np.asarray(vertices, float).reshape(-1, 3)
        f = np.asarray(faces, np.int64).reshape(-1, 3)
        while True:
            lengths = np.abs(v[f][:, :, 0] - v[np.roll(f, -1, 1)][:, :, 0])
            cut = lengths.max(1) > self.limit
            if not cut.any():
                break
            first = lengths[cut].argmax(1)[:, None] + np.arange(3)
            a, b, c = np.take_along_axis(f[cut], first % 3, 1).T
            middle = len(v) + np.arange(len(a))
            halves = np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)
            v, f = np.concatenate([v, (v[a] + v[b]) / 2]), np.concatenate([f[~cut], *halves])
        self.target.add(part, material, self.bend(v), f)
