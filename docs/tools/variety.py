"""Print how much the embedded shapes vary, and how near they come to real ones.

    python docs/tools/variety.py chair car                  all categories where none is named
    python docs/tools/variety.py chair real=meshes yaw=180  beside those in meshes/chair

For each category a row of box Chamfer distances (x 1000) between its first 150 shapes, 2,048 points
each: the median to the nearest other shape, the median to the nearest of 16 medoids, and the mean
over all pairs. Two samplings of one shape are about 0.5 apart. Beside real shapes: the median and
the mean distance of each of them to the nearest of the first 500.
"""

import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.geometry.mesh import Mesh, normalize
from ffd_lightning.geometry.sampling import sample_surface
from ffd_lightning.shapes import build, categories

SHAPES, POINTS, MEDOIDS = 150, 2048, 16


def clouds(category: str, count: int = SHAPES) -> list[NDArray[np.float64]]:
    """Return points of the first shapes of a category, each scaled to a box of diagonal 1."""
    return [_cloud(build(category, index)[0], index) for index in range(count)]


def _cloud(mesh: Mesh, seed: int) -> NDArray[np.float64]:
    vertices, rng = normalize(mesh.vertices, mesh.faces), np.random.default_rng(seed)
    return sample_surface(vertices, mesh.faces, POINTS, rng)[0]


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


def nearest_to_real(category: str, root: Path, yaw: float) -> NDArray[np.float64]:
    """Return the distance x 1000 of each real shape to the nearest of 500 embedded ones."""
    source = FolderSource(root, yaw=yaw)
    trees = [cKDTree(points) for points in clouds(category, 500)]
    found = []
    for shape_id in source.shape_ids(category):
        mesh = source.load(category, shape_id).mesh
        real = cKDTree(_cloud(mesh, 0))
        there = [
            (real.query(t.data)[0] ** 2).mean() + (t.query(real.data)[0] ** 2).mean() for t in trees
        ]
        found.append(1000 * min(there))
    return np.array(found)


def main() -> None:
    """See the top of this file."""
    settings = dict(word.split("=", 1) for word in sys.argv[1:] if "=" in word)
    names = [word for word in sys.argv[1:] if "=" not in word] or categories()
    if "real" in settings:
        for name in names:
            found = nearest_to_real(name, Path(settings["real"]), float(settings.get("yaw", 0)))
            print(
                f"{name}: {len(found)} real shapes, to the nearest of 500: median "
                f"{np.median(found):.2f}, mean {found.mean():.2f}"
            )
        return
    print(f"{'category':12}{'nearest other':>15}{'16 medoids':>12}{'mean pair':>11}")
    for name in names:
        print("{:12}{:15.2f}{:12.2f}{:11.2f}".format(name, *row(name)), flush=True)


if __name__ == "__main__":
    main()
