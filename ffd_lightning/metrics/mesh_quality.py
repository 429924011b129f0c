"""What a deformation does to a mesh: folds, stretch, faces through each other, holes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import Tensor

from ffd_lightning.geometry.intersections import merge_equal, self_intersecting_faces

# Equal vertices may come out of a matrix product unequal in their last bits, depending on the row.
_SAME = 1e-6


class MeshQuality(NamedTuple):
    """Measures of a deformed mesh; shares are in [0, 1].

    Attributes:
        folded: share of the original surface where the deformation turns space inside out.
        stretch_median: median over edges of max(r, 1 / r), r the ratio of lengths; 1 for none.
        stretch_95: the 95th percentile of the same.
        intersecting_before: share of the original faces that pass through others.
        intersecting: share of the deformed faces that pass through others.
        newly_intersecting: share of faces that do after the deformation and did not before.
        watertight_before: whether every edge of the original mesh belongs to two faces.
        watertight: the same of the deformed mesh; parts that come to touch at vertices open it.
    """

    folded: float
    stretch_median: float
    stretch_95: float
    intersecting_before: float
    intersecting: float
    newly_intersecting: float
    watertight_before: bool
    watertight: bool


class Distortion(NamedTuple):
    """The measures of `MeshQuality` that take no search for faces through each other."""

    folded: float
    stretch_median: float
    stretch_95: float


def distortion(
    vertices: ArrayLike | Tensor,
    deformed: ArrayLike | Tensor,
    faces: ArrayLike | Tensor,
    jacobians: ArrayLike | Tensor,
) -> Distortion:
    """Measure how a deformation folds and stretches a mesh; see `mesh_quality`.

    Raises:
        ValueError: as `mesh_quality`.
    """
    points, moved, matrices = (_array(x) for x in (vertices, deformed, jacobians))
    triangles = _faces(faces)
    if moved.shape != points.shape or matrices.shape != (len(points), 3, 3):
        raise ValueError(
            f"vertices {points.shape}, deformed {moved.shape} and jacobians {matrices.shape} do "
            "not go together"
        )
    if len(triangles) == 0:
        raise ValueError("the mesh has no faces")
    ratios = edge_stretch(points, moved, triangles)
    return Distortion(
        folded_share(points, triangles, matrices),
        # A value that occurs, not one between two: there may be infinite ones.
        float(np.percentile(ratios, 50, method="inverted_cdf")),
        float(np.percentile(ratios, 95, method="inverted_cdf")),
    )


def mesh_quality(
    vertices: ArrayLike | Tensor,
    deformed: ArrayLike | Tensor,
    faces: ArrayLike | Tensor,
    jacobians: ArrayLike | Tensor,
) -> MeshQuality:
    """Measure what a deformation did to a mesh.

    Convention:
        Everything is independent of the unit. The deformation is looked at where the mesh has
        vertices, so measure the finely subdivided mesh that is deformed, not the coarse one.

    Args:
        vertices: (V, 3) original positions.
        deformed: (V, 3) positions after the deformation.
        faces: (F, 3) vertex indices, the same before and after.
        jacobians: (V, 3, 3), see `geometry.jacobian.deformation_jacobian`.

    Raises:
        ValueError: shapes that do not go together, no faces, indices without a vertex, values that
            are not finite, an original mesh without area.

    >>> corner, wide = np.eye(4, 3), np.diag([2.0, 1, 1])
    >>> quality = mesh_quality(corner, corner @ wide, [[3, 0, 1]], np.tile(wide, (4, 1, 1)))
    >>> quality.folded, quality.stretch_95, quality.watertight
    (0.0, 2.0, False)
    """
    points, moved = _array(vertices), _array(deformed)
    triangles = _faces(faces)
    before = self_intersecting_faces(points, triangles)  # refuses what is no mesh
    bent = distortion(vertices, deformed, faces, jacobians)
    # Neighbours are those of the original mesh: parts that come to touch are not let off.
    after = self_intersecting_faces(moved, merge_equal(points)[triangles], merge=False)
    return MeshQuality(
        *bent,
        float(before.mean()),
        float(after.mean()),
        float((after & ~before).mean()),
        is_watertight(points, triangles),
        is_watertight(_rejoin(points, moved), triangles),
    )


def folded_share(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], jacobians: NDArray[np.float64]
) -> float:
    """Return the share of the original surface where the determinant of the Jacobian is below 0.

    Each corner stands for a third of its face's area: a share of vertices would count mostly the
    finely modelled parts.

    Args:
        vertices: (V, 3) original positions.
        faces: (F, 3).
        jacobians: (V, 3, 3).

    Raises:
        ValueError: the original mesh has no area, or a Jacobian is not finite.

    >>> triangle, mirror = np.eye(3), np.diag([1.0, 1, -1])
    >>> jacobians = np.stack([mirror, np.eye(3), np.eye(3)])
    >>> round(folded_share(triangle, np.array([[0, 1, 2]]), jacobians), 6)
    0.333333
    """
    if not np.isfinite(jacobians[np.unique(faces)]).all():
        raise ValueError("jacobians hold values that are not finite")
    corners = vertices[faces]
    edges = corners[:, 1:] - corners[:, :1]
    area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    if not area.sum() > 0:
        raise ValueError("the original mesh has no area")
    folded = np.linalg.det(jacobians) < 0
    return float((area * folded[faces].mean(axis=1)).sum() / area.sum())


def edge_stretch(
    vertices: NDArray[np.float64], deformed: NDArray[np.float64], faces: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Return max(r, 1 / r) of every edge, r the deformed length over the original one.

    Edges between the same two original positions are one edge. Edges of original length 0 are left
    out; one that the deformation takes to length 0 gives inf.

    Args:
        vertices: (V, 3) original positions.
        deformed: (V, 3) positions after the deformation.
        faces: (F, 3).

    Returns:
        (E,) ratios of 1 or more.

    Raises:
        ValueError: there is no edge with a length.

    >>> line = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> edge_stretch(line, line * [4, 0.5, 1], np.array([[0, 1, 1]]))
    array([4.])
    """
    numbers = np.unique(_edges(merge_equal(vertices)[faces], len(vertices)))
    start, end = np.divmod(numbers, len(vertices))
    before, after = (np.linalg.norm(x[start] - x[end], axis=1) for x in (vertices, deformed))
    before, after = before[before > 0], after[before > 0]
    if len(before) == 0:
        raise ValueError("the mesh has no edge with a length")
    with np.errstate(divide="ignore"):
        return np.maximum(after / before, before / after)


def is_watertight(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> bool:
    """Tell whether every edge belongs to exactly two faces, vertices at equal positions being one.

    Faces with two corners at the same position have no area and are left out; a mesh of which
    nothing is left is not watertight.

    Args:
        vertices: (V, 3).
        faces: (F, 3).

    >>> is_watertight(np.eye(4, 3), np.array([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]]))
    True
    """
    corners = merge_equal(vertices)[faces]
    distinct = (corners != np.roll(corners, 1, axis=1)).all(axis=1)
    if not distinct.any():
        return False
    _, counts = np.unique(_edges(corners[distinct], len(vertices)), return_counts=True)
    return bool((counts == 2).all())


def _edges(faces: NDArray[np.int64], num_vertices: int) -> NDArray[np.int64]:
    """Return the edges of faces as numbers, smaller index * num_vertices + larger one, (3F,)."""
    ends = faces, np.roll(faces, -1, axis=1)
    return (np.minimum(*ends) * num_vertices + np.maximum(*ends)).ravel()


def _rejoin(vertices: NDArray[np.float64], deformed: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give vertices that were at equal positions, and still nearly are, equal positions again."""
    joined = deformed[merge_equal(vertices)]
    near = np.abs(joined - deformed).max(axis=1) <= _SAME * np.ptp(deformed, axis=0).max()
    return np.where(near[:, None], joined, deformed)


def _array(values: ArrayLike | Tensor) -> NDArray[np.float64]:
    array = values.detach().cpu().numpy() if isinstance(values, Tensor) else np.asarray(values)
    return array.astype(np.float64)


def _faces(values: ArrayLike | Tensor) -> NDArray[np.int64]:
    return torch.as_tensor(values).cpu().numpy().astype(np.int64).reshape(-1, 3)
