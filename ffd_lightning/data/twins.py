"""Near copies within a set: shapes that no measurement can tell apart.

Data sets hold one mesh under several names: in other colours, another livery. A test shape whose
copy is trained on says what a network remembers. Two shapes are twins if they are as near to each
other as two samplings of one shape are.
"""

from collections.abc import Mapping
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.terminal import counted

MARGIN = 1.03
"""How much farther than two samplings of one shape two twins may be, in Chamfer distance."""

_HALF = 8192  # points of each of two samplings: the two halves of a cloud
_FEWEST = 1024  # with fewer, shapes that are merely alike are as near
_FIRST_LOOKS = (512, 1.2), (2048, 1.1)  # distances of few points vary: greater margins
_ALIKE = 1.5  # times what samplings of one shape differ by in what `_described` says
_PARTS = 4  # samplings of a shape that are described
_LEAST_ERROR = 1e-5  # in diagonals
_BINS = 16
_AT_ONCE = 4096  # pairs
_HELD = 256  # shapes in memory
_NAMED = 3  # groups

_Halves = tuple[cKDTree, NDArray[np.float32]]  # two samplings of one shape

_DIRECTIONS = np.array([v for v in product((-1, 0, 1), repeat=3) if v > (0, 0, 0)], np.float32)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1, keepdims=True)


def twins(prepared: PreparedSet) -> dict[str, str]:
    """Return the shapes that have twins, each with the least id of its group, by id.

    Twins of twins are twins. Clouds of fewer than 2,048 points have none: they are too coarse. For
    7,000 shapes it takes about half a minute, the first time; see `PreparedSet.measured`.
    """

    def measure() -> dict[str, Any]:
        groups = _groups(prepared)
        return {"ids": np.array(list(groups)), "first": np.array(list(groups.values()))}

    found = prepared.measured("twins", measure)
    return dict(zip(found["ids"].tolist(), found["first"].tolist(), strict=True))


def twin_note(found: Mapping[str, str], published: Mapping[str, str]) -> str:
    """Return in words what `twins` has found, also by the data set's own split; "" for nothing."""
    if not found:
        return ""
    groups: dict[str, list[str]] = {}
    for shape_id, first in found.items():
        groups.setdefault(first, []).append(shape_id)
    named = "; ".join(" = ".join(ids) for ids in list(groups.values())[:_NAMED])
    more = f" and {counted(len(groups) - _NAMED, 'more group')}" if len(groups) > _NAMED else ""
    text = f"{len(found)} shapes are near copies of each other: {named}{more}; "
    if not published:
        return text + "splits by the id's hash keep copies in one subset"
    seen = {first for i, first in found.items() if published.get(i) in ("train", "val")}
    parted = [i for i, first in found.items() if published.get(i) == "test" and first in seen]
    return text + f"{len(parted)} that the published split tests on have one in training"


def twin_warning(count: int, tested: int) -> str:
    """Return in words that shapes to test on have near copies in training, "" where none has."""
    if not count:
        return ""
    return (
        f"of {counted(tested, 'shape')} to test on, near copies of training shapes or templates: "
        f"{count}, which this split parts: scores are given with and without them"
    )


def _groups(prepared: PreparedSet) -> dict[str, str]:
    count, half = len(prepared), min(prepared.num_points // 2, _HALF)
    if half < _FEWEST or count < 2:
        return {}

    @lru_cache(_HELD)
    def halves(row: int) -> _Halves:
        first, second = np.split(prepared.cloud(row, 2 * half), 2)
        return cKDTree(first), second

    def near(i: int, j: int) -> bool:
        looks = *_FIRST_LOOKS, (half, MARGIN)
        return all(_times_farther(halves(i), halves(j), n) <= margin for n, margin in looks)

    pairs = [pair for pair in _alike(prepared, 2 * half // _PARTS * _PARTS).tolist() if near(*pair)]
    rows = np.array(pairs, np.int64).reshape(-1, 2).T
    graph = coo_array((np.ones(len(pairs)), rows), (count, count))
    _, group = connected_components(graph, directed=False)
    members: dict[int, list[str]] = {}
    for shape_id, number in zip(prepared.ids, group.tolist(), strict=True):
        members.setdefault(number, []).append(shape_id)
    return {i: min(ids) for ids in members.values() if len(ids) > 1 for i in ids}


def _alike(prepared: PreparedSet, points: int) -> NDArray[np.int64]:
    """Return the pairs that are worth a look, (k, 2) rows, sorted.

    A k-d tree finds shapes of which the same can be said as nearly as of samplings of one; what
    samplings of a shape have in common counts the more. A quarter of the points is a sampling.
    """
    clouds = (prepared.cloud(row, points) for row in range(len(prepared)))
    said = np.stack([[_described(part) for part in np.split(c, _PARTS)] for c in clouds])
    errors = said.std(1, ddof=1) / np.sqrt(_PARTS)  # of their means
    unit = np.maximum(np.sqrt(np.square(errors).mean(0)), _LEAST_ERROR)
    means, noise = said.mean(1) / unit, np.linalg.norm(errors / unit, axis=1)
    reach = _ALIKE * np.sqrt(2) * float(noise.max())
    pairs = cKDTree(means).query_pairs(reach, output_type="ndarray")
    pairs = pairs[np.lexsort(pairs.T[::-1])]  # the same shapes close after each other
    found = []
    for k in range(0, len(pairs), _AT_ONCE):
        i, j = pairs[k : k + _AT_ONCE].T
        apart = np.linalg.norm(means[i] - means[j], axis=1)
        found.append(pairs[k : k + _AT_ONCE][apart <= _ALIKE * np.hypot(noise[i], noise[j])])
    return np.concatenate([pairs[:0], *found])


def _described(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return how points are spread along 13 directions: means of their sixteenths in order."""
    along = np.sort(points @ _DIRECTIONS.T, axis=0)
    return along[: len(along) // _BINS * _BINS].reshape(_BINS, -1, len(_DIRECTIONS)).mean(1).ravel()


def _times_farther(first: _Halves, second: _Halves, count: int) -> float:
    """Return how much farther samplings of two shapes are apart than two of one of them.

    So many points of each sampling are looked at.
    """

    def apart(tree: cKDTree, points: NDArray[np.floating]) -> float:
        return float(np.square(tree.query(points[:count])[0]).mean())

    pairs = (first, second), (second, first)
    across = [apart(tree, points) for (tree, _), of in pairs for points in (of[0].data, of[1])]
    own = [apart(*shape) for shape in (first, second)]
    return float(np.mean(across) / np.mean(own))
