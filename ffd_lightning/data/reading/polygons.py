"""Faces of more than three corners, cut as they lie: trimesh cuts each from its first corner.

So OFF is read here as a whole; of PLY trimesh keeps the faces as the file has them.
"""

import re
from collections.abc import Sequence
from typing import Any

import mapbox_earcut
import numpy as np
import trimesh
from numpy.typing import NDArray

from ffd_lightning.errors import RejectedShapeError


def concave(
    polygons: Sequence[Sequence[int]], places: NDArray[np.float64]
) -> dict[int, NDArray[np.int64]]:
    """Return how to cut the polygons that are concave.

    Args:
        polygons: of each its corners, rows of `places`.
        places: of the corners, (V, 3).

    Returns:
        By the polygon's number its triangles, (t, 3), numbers of its own corners.
    """
    by_size: dict[int, list[int]] = {}
    for k, polygon in enumerate(polygons):
        by_size.setdefault(len(polygon), []).append(k)
    found: dict[int, NDArray[np.int64]] = {}
    for size, rows in by_size.items():
        if size < 4:
            continue
        around = places[[polygons[k] for k in rows]]  # (polygons, corners, 3)
        edges = np.roll(around, -1, axis=1) - around
        turns = np.cross(np.roll(edges, 1, axis=1), edges)
        spokes = around - around[:, :1]
        normals = np.cross(spokes, np.roll(spokes, -1, axis=1)).sum(axis=1)
        bends = (turns * normals[:, None]).sum(axis=2)
        bent = bends.min(axis=1) < -1e-6 * np.abs(bends).max(axis=1)
        cuts = {rows[k]: _triangles(around[k], normals[k]) for k in np.flatnonzero(bent)}
        found |= {k: cut for k, cut in cuts.items() if len(cut)}
    return found


def _of_polygons(
    places: NDArray[np.float64],
    polygons: Sequence[Sequence[int]],
    colors: NDArray[Any] | None,
    visual: Any = None,
) -> trimesh.Trimesh:
    """Return a mesh of polygons with colours (polygons, 3 or 4), or of another `visual`."""
    cuts, faces, origins = concave(polygons, places), [], []
    for k, polygon in enumerate(polygons):
        fan = [(0, i, i + 1) for i in range(1, len(polygon) - 1)]
        cut = cuts.get(k, fan)
        faces += [[polygon[c] for c in triangle] for triangle in cut]
        origins += [k] * len(cut)
    if colors is not None:
        visual = trimesh.visual.ColorVisuals(face_colors=colors[origins])
    return trimesh.Trimesh(places, np.reshape(faces, (-1, 3)), visual=visual, process=False)


def cut_ply(geometry: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a mesh of a PLY with its polygons cut, and coloured, as the file says."""
    if not isinstance(geometry.visual, trimesh.visual.ColorVisuals):
        return geometry
    data: Any = geometry.metadata["_ply_raw"]["face"]["data"]
    known = data if isinstance(data, dict) else data.dtype.names or ()
    name = next((x for x in ("vertex_index", "vertex_indices", *known) if x in known), None)
    polygons = data if name is None else data[name]
    polygons = polygons["f1"] if polygons.dtype.names else polygons
    if np.shape(polygons)[1:] == (3,):
        return geometry
    channels = [np.ravel(data[c]) for c in ("red", "green", "blue", "alpha") if c in known]
    vertices = geometry.visual if geometry.visual.kind == "vertex" else None
    colors = np.stack(channels, 1) if len(channels) > 2 else None
    return _of_polygons(geometry.vertices, polygons, colors, vertices)


def read_off(data: bytes, name: str) -> trimesh.Trimesh:
    """Return the mesh of an OFF, whose colours trimesh does not read.

    Raises:
        RejectedShapeError: it is of a kind that cannot be read, or ends before its last face.
    """
    rows = [row.split() for line in data.splitlines() if (row := line.split(b"#")[0].strip())]
    head = b" ".join(rows[0]) if rows else b""
    if (kind := re.fullmatch(rb"(ST)?(C?)(N?)OFF((?: ?\d+)*)", head)) is None:
        raise RejectedShapeError(f"{name} is not of a kind of OFF that can be read")
    counts, body = (kind[4].split(), rows[1:]) if kind[4] else (rows[1], rows[2:])
    first, second = int(counts[0]), int(counts[1])
    check_count(name, first + second, len(body))
    points, faces = body[:first], body[first : first + second]
    places = np.array([row[:3] for row in points], np.float64)
    polygons = [[int(x) for x in row[1 : 1 + int(row[0])]] for row in faces]
    at = 6 if kind[3] else 3  # behind a normal
    # What follows colours, coordinates of textures, would be taken for their alpha.
    colored = points if kind[2] and not kind[1] else []
    of_points = _off_colors([row[at : at + 4] for row in colored])
    visual = None if of_points is None else trimesh.visual.ColorVisuals(vertex_colors=of_points)
    of_faces = _off_colors([row[1 + int(row[0]) :] for row in faces])
    return _of_polygons(places, polygons, of_faces, visual)


def _off_colors(rows: Sequence[Sequence[bytes]]) -> NDArray[np.uint8] | None:
    """Return colours, RGB or RGBA in whole numbers to 255 or parts of 1; None if not all have."""
    if not rows or {len(row) for row in rows} not in ({3}, {4}):
        return None
    values = np.array(rows, np.float64)
    scale = 255 if any(b"." in x for row in rows for x in row) else 1
    return np.round(np.clip(values * scale, 0, 255)).astype(np.uint8)


def _triangles(corners: NDArray[np.float64], normal: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return triangles (t, 3) of a polygon with corners (k, 3); they turn about `normal`, too."""
    flat = np.delete(corners, np.abs(normal).argmax(), axis=1)
    ends = np.array([len(flat)], np.uint32)
    found = mapbox_earcut.triangulate_float64(flat, ends).reshape(-1, 3).astype(np.int64)
    a, b, c = corners[found].swapaxes(0, 1)
    turned = (np.cross(b - a, c - a) * normal).sum(axis=1) < 0
    found[turned] = found[turned][:, ::-1]
    return found


def check_count(name: str, promised: int, there: int) -> None:
    """Reject a text file that ends before its last vertex or face."""
    if there < promised:
        raise RejectedShapeError(
            f"{name} is incomplete: it has {there:,} of {promised:,} vertices and faces"
        )
