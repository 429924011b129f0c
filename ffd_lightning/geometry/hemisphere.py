"""The smallest hemisphere on the ground that holds a shape: the paper's frame for its metrics."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

_RADIUS = 3.2  # of the paper's numbers
# A squared radius within this share of its lower bound is the smallest: rounding is all that is
# left. The search ends without it too, but it may take in rounding errors as if they were points.
_ROUNDING = 4 * np.finfo(np.float64).eps


class Hemisphere(NamedTuple):
    """A hemisphere, flat side down, in the frame and unit of the points it was made from.

    Convention:
        y is up. The centre, (3,), is that of the flat side: its y is the lowest y of the points.
    """

    center: NDArray[np.float64]
    radius: float

    def transform(self, points: ArrayLike) -> NDArray[np.float64]:
        """Carry points (*batch, 3) into the frame where this hemisphere is centred, of radius 3.2.

        What was inside has y >= 0 and lies within 3.2 of the origin afterwards. Nothing is turned.
        A prediction is carried by the hemisphere of its ground truth.

        Raises:
            ValueError: a hemisphere of radius 0 (all vertices were one point) has no scale.
        """
        if not self.radius > 0:
            raise ValueError("the hemisphere has no extent: all its vertices are one point")
        return (np.asarray(points, np.float64) - self.center) / self.radius * _RADIUS


def bounding_hemisphere(vertices: ArrayLike) -> Hemisphere:
    r"""Return the smallest hemisphere on the plane of the lowest vertex that holds all vertices.

    $$ \min_{c \in R^2} \max_i \; |(x_i, z_i) - c|^2 + h_i^2, \quad h_i = y_i - \min_j y_j $$

    The minimum is unique, and at most three vertices decide it. It is found exactly: take the
    farthest vertex into a working set, solve that set by trying its singles, pairs and triples,
    repeat until no vertex lies outside.

    Args:
        vertices: (V, 3), y up; only those that a face uses, since stray vertices count as well.

    Raises:
        ValueError: no vertices, or vertices that are not finite.

    Source: the authors' evaluation, which looks for the same centre with a local optimiser; the
    solution is the exchange method for smallest enclosing balls (of the vertices and their mirror
    images below the plane).

    >>> bounding_hemisphere([[0, 0, 0], [2, 0, 0], [1, 1, 0]])
    Hemisphere(center=array([1., 0., 0.]), radius=1.0)
    """
    points = np.asarray(vertices, np.float64).reshape(-1, 3)
    if len(points) == 0 or not np.isfinite(points).all():
        raise ValueError("there must be vertices to bound, all of them finite")
    low, high = points.min(axis=0), points.max(axis=0)
    middle = low / 2 + high / 2
    middle[1] = low[1]
    scale = float((high / 2 - low / 2).max())
    if scale == 0:
        return Hemisphere(middle, 0.0)
    # Near the origin and of size 1, neither distance nor smallness of a shape costs digits.
    x, y, z = ((points - middle) / scale).T
    center = middle + scale * np.insert(_center(np.stack([x, z]), y * y), 1, 0.0)
    # Seen from the centre as it was rounded, so that nothing lies outside.
    farthest = np.square((points - center) / scale).sum(axis=1).max()
    return Hemisphere(center, scale * float(np.sqrt(farthest)))


def _center(ground: NDArray[np.float64], height: NDArray[np.float64]) -> NDArray[np.float64]:
    """Find the centre for positions on the ground (2, V) and squared heights above it (V,)."""
    center, bound = np.zeros(2), -np.inf
    active: list[int] = []
    while True:
        squared = _squared_distances(ground, height, center)
        farthest = int(squared.argmax())
        # Every round adds a vertex: it ends at the latest when all are in.
        if squared[farthest] <= bound * (1 + _ROUNDING) or farthest in active:
            return center
        active.append(farthest)
        center, bound = _solve(ground[:, active], height[active])


def _solve(
    ground: NDArray[np.float64], height: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Find centre and squared radius for a few points, (2, k) and (k,), that the last one decides.

    The best centre is equally far from the last point and from none, one or two others. All such
    centres are tried; one that is ill-conditioned merely turns out to be a bad one.
    """
    tip, others = ground[:, -1:], ground[:, :-1]
    apart = others - tip  # (2, k - 1)
    # c - tip = t satisfies 2 apart . t = reach for each point that is as far away as the last.
    length = np.square(apart).sum(axis=0)
    reach = length + height[:-1] - height[-1]
    (x, z), (i, j) = apart, np.triu_indices(len(length), 1)
    with np.errstate(all="ignore"):
        pairs = apart * (reach / (2 * length))
        turned = np.stack([z[j] * reach[i] - z[i] * reach[j], x[i] * reach[j] - x[j] * reach[i]])
        triples = turned / (2 * (x[i] * z[j] - x[j] * z[i]))
        centers = tip + np.concatenate([np.zeros((2, 1)), pairs, triples], axis=1)
        squared = _squared_distances(ground[:, None], height, centers[..., None]).max(axis=-1)
    best = int(np.where(np.isfinite(squared), squared, np.inf).argmin())
    return centers[:, best], float(squared[best])


def _squared_distances(
    ground: NDArray[np.float64], height: NDArray[np.float64], center: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Squared distances in space from centres on the ground, broadcast over what follows axis 0."""
    x, z = ground
    return np.square(x - center[0]) + np.square(z - center[1]) + height
