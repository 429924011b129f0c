"""Faces of a mesh that pass through other faces of it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from ffd_lightning.geometry.compiled import jit
from ffd_lightning.geometry.nearest.threads import over_threads

_LEAF = 4  # faces per leaf of the tree


def merge_equal(vertices: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return for every vertex the first vertex that has the same position, (V,).

    >>> merge_equal(np.array([[0.0, 0, 1], [2, 0, 0], [-0.0, 0, 1]]))
    array([0, 1, 0])
    """
    order = np.lexsort(vertices.T)  # stable: of equals the first comes first
    ordered = vertices[order]
    new = np.ones(len(vertices), bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    first = np.empty(len(vertices), np.int64)
    first[order] = order[new][np.cumsum(new) - 1]
    return first


def self_intersecting_faces(
    vertices: ArrayLike,
    faces: ArrayLike,
    tolerance: float = 1e-6,
    coplanar: bool = True,
    merge: bool = True,
) -> NDArray[np.bool_]:
    """Tell which faces pass through another face with which they share no corner.

    Two faces do where their interiors meet: along a line, or over an area where they lie in one
    plane. Touching is no intersection (an edge or a corner on another face, faces back to back
    at an edge): shapes are assembled of parts that touch.

    Convention:
        A line counts where it is longer than the tolerance and each face reaches further than that
        to both sides of the other's plane; an overlap counts where it is wider. Faces no higher
        than the tolerance are no faces. The default is what files with six digits leave uncertain,
        and ten times what float32 does. Not found: faces that share a corner and meet elsewhere.

    Args:
        vertices: (V, 3) positions, in any unit.
        faces: (F, 3) vertex indices.
        tolerance: share of the diagonal of the box around the vertices in use; above 0.
        coplanar: count overlaps within one plane. They become intersections along lines as soon
            as the mesh is bent, so leave them in to compare a mesh before and after.
        merge: vertices at equal positions are one. Leave it out where faces that belong together
            have the same indices: those that came to touch by chance are then not let off.

    Returns:
        (F,) bool.

    Raises:
        ValueError: wrong shapes, indices without a vertex, vertices in use that are not finite, a
            tolerance of 0 or below.

    Source: interval test of Moeller 1997, "A Fast Triangle-Triangle Intersection Test", on
    candidates from a tree of boxes.

    >>> sheet, blade = [[0, 0, 0], [3, 0, 0], [0, 3, 0]], [[1, 1, -1], [1, 1, 1], [9, 9, 0]]
    >>> self_intersecting_faces(sheet + blade, [[0, 1, 2], [3, 4, 5]])
    array([ True,  True])
    """
    vertices, faces = _checked(vertices, faces)
    if not tolerance > 0:
        raise ValueError(f"tolerance must be above 0, got {tolerance}")
    ids = merge_equal(vertices)[faces] if merge else faces
    shape, order = _shapes(vertices[faces], tolerance)
    found, boxes = np.zeros(len(order), bool), _boxes(shape[:, :3])
    over_threads(_search, len(order), shape, ids[order], *boxes, tolerance, coplanar, found)
    result = np.zeros(len(faces), bool)
    result[order] = found
    return result


def _checked(vertices: ArrayLike, faces: ArrayLike) -> tuple[NDArray[np.float64], NDArray]:
    points, triangles = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)
    triangles = triangles.reshape(-1, 3) if triangles.size == 0 else triangles
    for name, array in (("vertices", points), ("faces", triangles)):
        if array.ndim != 2 or array.shape[1] != 3:
            raise ValueError(f"{name} must be (n, 3), got {array.shape}")
    if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(points)):
        raise ValueError(f"faces must index the {len(points)} vertices")
    if not np.isfinite(points[triangles]).all():
        raise ValueError("vertices that faces use must be finite")
    return points, triangles


def _shapes(
    corners: NDArray[np.float64], tolerance: float
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Return corners and unit normals of the faces that count, in a frame with diagonal 1.

    Returns:
        (G, 4, 3), neighbours in space side by side, and which faces they are, (G,).
    """
    if len(corners) == 0:
        return np.empty((0, 4, 3)), np.empty(0, np.intp)
    corners = corners - corners.min(axis=(0, 1))
    corners /= max(float(np.linalg.norm(corners.max(axis=(0, 1)))), np.finfo(float).tiny)
    edges = np.stack([corners[:, (k + 1) % 3] - corners[:, k] for k in range(3)])
    normals = np.cross(edges[0], edges[1])
    area = np.sqrt((normals**2).sum(axis=1))  # twice the area: longest edge times height
    longest = np.sqrt((edges**2).sum(axis=2).max(axis=0))
    order = cKDTree(corners.mean(axis=1)).indices
    order = order[area[order] > tolerance * longest[order]]
    normals = normals[order] / area[order, None]
    return np.concatenate([corners[order], normals[:, None]], axis=1), order


def _boxes(corners: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return lows and highs of a complete binary tree: children of k are 2k and 2k + 1, root 1."""
    leaves = 2 ** math.ceil(math.log2(max(1, len(corners) / _LEAF)))
    boxes = []
    for extreme, empty in ((np.minimum, np.inf), (np.maximum, -np.inf)):
        faces = np.full((leaves * _LEAF, 3), empty)
        faces[: len(corners)] = extreme.reduce(corners, axis=1)
        levels = [extreme.reduce(faces.reshape(leaves, _LEAF, 3), axis=1)]
        while len(levels[-1]) > 1:
            levels.append(extreme.reduce(levels[-1].reshape(-1, 2, 3), axis=1))
        boxes.append(np.concatenate([np.zeros((1, 3)), *levels[::-1]]))
    return boxes


@jit
def _search(
    shape: NDArray,
    ids: NDArray,
    low: NDArray,
    high: NDArray,
    tolerance: float,
    coplanar: bool,
    found: NDArray,
    start: int,
    stop: int,
) -> None:  # pragma: no cover - compiled
    """Look for a partner of the faces start..stop; one is enough, and both are marked.

    `shape` (F, 4, 3) holds the corners of each face and its unit normal. The result does not depend
    on the order of threads: they write nothing but True, and a pair is compared in one order.
    """
    leaves = len(low) // 2
    stack = np.empty(128, np.int64)
    for i in range(start, stop):
        # All of the tree, but first the faces nearby: most partners are found among them.
        stack[0], stack[1], size = 1, max(1, (leaves + i // _LEAF) >> 2), 2
        while size > 0 and not found[i]:
            size -= 1
            node = stack[size]
            if not _meets(shape, i, low, high, node):
                continue
            if node < leaves:
                stack[size], stack[size + 1] = 2 * node, 2 * node + 1
                size += 2
                continue
            first = (node - leaves) * _LEAF
            for j in range(first, min(first + _LEAF, len(shape))):
                if _cross(shape, ids, min(i, j), max(i, j), tolerance, coplanar):
                    found[i] = found[j] = True
                    break


@jit
def _meets(f: NDArray, i: int, low: NDArray, high: NDArray, node: int) -> bool:  # pragma: no cover
    """Tell whether the boxes of a face and of a node of the tree meet."""
    for k in range(3):
        x, y, z = f[i, 0, k], f[i, 1, k], f[i, 2, k]
        if max(x, y, z) < low[node, k] or min(x, y, z) > high[node, k]:
            return False
    return True


@jit
def _cross(
    f: NDArray, ids: NDArray, a: int, b: int, tolerance: float, coplanar: bool
) -> bool:  # pragma: no cover - compiled
    """Tell whether two faces without a common corner meet with their interiors."""
    from_b, from_a = _distances(f, a, b), _distances(f, b, a)
    for d in (from_b, from_a):
        if min(d) > tolerance or max(d) < -tolerance:
            return False
    for p in range(3):
        for q in range(3):
            if ids[a, p] == ids[b, q]:
                return False
    for plane, d in ((b, from_b), (a, from_a)):
        if max(d) <= tolerance and min(d) >= -tolerance:
            return coplanar and _overlap(f, a, b, plane, tolerance)
    for d in (from_b, from_a):
        if max(d) <= tolerance or min(d) >= -tolerance:
            return False
    line, _ = _product(_row(f, a, 3), _row(f, b, 3))
    low_a, high_a = _chord(_along(f, a, line), from_b)
    low_b, high_b = _chord(_along(f, b, line), from_a)
    return min(high_a, high_b) - max(low_a, low_b) > tolerance


@jit
def _overlap(f: NDArray, a: int, b: int, plane: int, tolerance: float) -> bool:  # pragma: no cover
    """Tell whether two faces that lie in the plane of one overlap: no edge separates them."""
    for face in (a, b):
        for p in range(3):
            tip, tail = _row(f, face, (p + 1) % 3), _row(f, face, p)
            edge = (tip[0] - tail[0], tip[1] - tail[1], tip[2] - tail[2])
            across, length = _product(_row(f, plane, 3), edge)
            if length <= tolerance:
                continue
            at_a, at_b = _along(f, a, across), _along(f, b, across)
            if min(max(at_a), max(at_b)) - max(min(at_a), min(at_b)) <= tolerance:
                return False
    return True


@jit
def _chord(at: Any, d: Any) -> Any:  # pragma: no cover - compiled
    """Where a plane cuts a face, from the positions of its corners along the cut and off it."""
    low, high = np.inf, -np.inf
    for p in range(3):
        q = (p + 1) % 3
        if d[p] * d[q] < 0:
            cut = at[p] + (at[q] - at[p]) * (d[p] / (d[p] - d[q]))
            low, high = min(low, cut), max(high, cut)
        elif d[p] == 0:
            low, high = min(low, at[p]), max(high, at[p])
    return low, high


@jit
def _distances(f: NDArray, i: int, plane: int) -> Any:  # pragma: no cover - compiled
    """Signed distances of the corners of face i from the plane of another."""
    x, y, z = _along(f, i, _row(f, plane, 3))
    at = _along(f, plane, _row(f, plane, 3))[0]
    return x - at, y - at, z - at


@jit
def _along(f: NDArray, i: int, axis: Any) -> Any:  # pragma: no cover - compiled
    """Positions of the corners of face i along a direction."""
    u, v, w = axis
    return (
        u * f[i, 0, 0] + v * f[i, 0, 1] + w * f[i, 0, 2],
        u * f[i, 1, 0] + v * f[i, 1, 1] + w * f[i, 1, 2],
        u * f[i, 2, 0] + v * f[i, 2, 1] + w * f[i, 2, 2],
    )


@jit
def _row(f: NDArray, i: int, p: int) -> Any:  # pragma: no cover - compiled
    return f[i, p, 0], f[i, p, 1], f[i, p, 2]


@jit
def _product(a: Any, b: Any) -> Any:  # pragma: no cover - compiled
    """Direction and length of the cross product; the zero vector where that has no length."""
    x, y, z = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    length = np.sqrt(x * x + y * y + z * z)
    scale = 1 / length if length > 0 else 0.0
    return (x * scale, y * scale, z * scale), length
