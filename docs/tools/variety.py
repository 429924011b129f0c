"""Print how much the embedded shapes vary: python docs/tools/variety.py chair car ...

For each category a row of box Chamfer distances (x 1000) between its first 150 shapes, 2,048 points
each: the median to the nearest other shape, the median to the nearest of 16 medoids, and the mean
over all pairs. Two samplings of one shape are about 0.5 apart.
"""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ffd_lightning.geometry.mesh import normalize
from ffd_lightning.geometry.sampling import sample_surface
from ffd_lightning.shapes import build, categories

SHAPES, POINTS, MEDOIDS = 150, 2048, 16


def clouds(category: str, count: int = SHAPES) -> list[NDArray[np.float64]]:
    """Return points of the first shapes of a category, each scaled to a box of diagonal 1."""
    found = []
    for index in range(count):
        mesh, _ = build(category, index)
        vertices = normalize(mesh.vertices, mesh.faces)
        points, *_ = sample_surface(vertices, mesh.faces, POINTS, np.random.default_rng(index))
        found.append(points)
    return found


def distances(found: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the Chamfer distances x 1000 of all pairs of clouds, (n, n)."""
    trees = [cKDTree(points) for points in found]
    pairs = np.zeros((len(found), len(found)))
    for i, a in enumerate(trees):
        for j, b in enumerate(trees[:i]):
            there, back = b.query(a.data)[0], a.query(b.data)[0]
            pairs[i, j] = pairs[j, i] = 1000 * float((there**2).mean() + (back**2).mean())
    return pairs


def medoids(pairs: NDArray[np.float64], count: int) -> list[int]:
    """Return `count` rows that are near all others, added one by one."""
    chosen: list[int] = []
    nearest = np.full(len(pairs), np.inf)
    for _ in range(count):
        gain = [np.minimum(nearest, row).sum() for row in pairs]
        chosen.append(int(np.argmin(gain)))
        nearest = np.minimum(nearest, pairs[chosen[-1]])
    return chosen


def row(category: str) -> tuple[float, float, float]:
    """Return the three figures of a category."""
    pairs = distances(clouds(category))
    other = pairs + np.diag(np.full(len(pairs), np.inf))
    near = other[:, medoids(pairs, MEDOIDS)].min(1)
    off = pairs[~np.eye(len(pairs), dtype=bool)]
    return float(np.median(other.min(1))), float(np.median(near)), float(off.mean())


if __name__ == "__main__":
    print(f"{'category':12}{'nearest other':>15}{'16 medoids':>12}{'mean pair':>11}")
    for name in sys.argv[1:] or categories():
        print("{:12}{:15.2f}{:12.2f}{:11.2f}".format(name, *row(name)), flush=True)
