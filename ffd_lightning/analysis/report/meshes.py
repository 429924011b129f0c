"""Meshes light enough to travel in a page."""

import base64
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.evaluation.candidates import Surface, TemplateShape
from ffd_lightning.geometry.subdivision import subdivide

_EDGES = (0.3, 0.2, 0.15, 0.1, 0.07, 0.05)  # of a shape of diagonal 1, from coarse to fine
# Cells per unit, from fine to coarse; the finest tells what is not the same place all along.
_CELLS = (2**15, 400, 250, 160, 100, 64, 40, 24, 14, 8, 5, 3)
MAX_BYTES = 60_000
"""Of a mesh: so its vertices are fewer than 16 bits can count."""


@dataclass(frozen=True)
class PackedMesh:
    """A mesh in few bytes.

    Attributes:
        vertices: (V, 3) int16; 32,767 is `scale`.
        faces: (F, 3) uint16.
        scale: greatest coordinate, in units of the shape's diagonal before deformation.
    """

    vertices: NDArray[np.int16]
    faces: NDArray[np.uint16]
    scale: float

    def places(self) -> NDArray[np.float64]:
        """Return where the vertices are, (V, 3)."""
        return self.vertices.astype(np.float64) * (self.scale / 32767)

    def as_json(self) -> dict[str, str | float]:
        """Return what the page's script reads: little-endian arrays in base64."""
        arrays = (self.vertices.astype("<i2"), self.faces.astype("<u2"))
        vertices, faces = (base64.b64encode(a.tobytes()).decode() for a in arrays)
        return {"vertices": vertices, "faces": faces, "scale": self.scale}


def pack(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> PackedMesh:
    """Store a mesh in 16 bits a number; places move by at most 1/65,534 of the greatest one."""
    scale = max(float(np.abs(vertices).max()), 1e-6)
    places = np.round(vertices * (32767 / scale)).astype(np.int16)
    return PackedMesh(places, faces.astype(np.uint16), scale)


def size(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> int:
    """Return how many bytes a mesh takes, packed."""
    return 6 * (len(vertices) + len(faces))


def lighten(
    vertices: NDArray[np.float64], faces: NDArray[np.int64], max_bytes: int = MAX_BYTES
) -> Surface:
    """Merge vertices that are near each other until a mesh is small enough (vertex clustering).

    Vertices of one cell of a grid become their mean; faces that lose their area go, and so do
    faces that come to lie on others. The finest grid is taken that gives (V, 3) vertices and (F, 3)
    faces of `max_bytes` at most, packed.

    Source: Rossignac and Borrel 1993.
    """
    used, faces = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], faces.reshape(-1, 3)
    for cells in _CELLS:
        merged = _merge(vertices, faces, cells)
        if size(*merged) <= min(max_bytes, MAX_BYTES):
            break
    return merged


def _merge(vertices: NDArray[np.float64], faces: NDArray[np.int64], cells: float) -> Surface:
    """Merge the vertices of each cell of a grid of `cells` per unit."""
    _, cell = np.unique(np.round(vertices * cells), axis=0, return_inverse=True)
    cell = cell.reshape(-1)  # numpy 2.0 keeps the axis
    count = np.bincount(cell)
    means = np.stack([np.bincount(cell, x) / count for x in vertices.T], 1)
    faces = cell[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    _, first = np.unique(np.sort(faces, 1), axis=0, return_index=True)
    used, faces = np.unique(faces[np.sort(first)], return_inverse=True)
    return means[used], faces.reshape(-1, 3)


def light_template(template: TemplateShape, max_bytes: int = MAX_BYTES) -> Surface:
    """Return a template's mesh, deformed, divided as finely as the bytes allow.

    A mesh of large faces does not bend with its lattice, so it is subdivided before it is deformed
    as in the paper, only not as finely as for evaluation.
    """
    mesh = template.bank.meshes[template.index]
    vertices, faces = lighten(mesh.vertices, mesh.faces, max_bytes)
    for edge in _EDGES:
        finer = subdivide(vertices, faces, edge)[:2]
        if size(*finer) > min(max_bytes, MAX_BYTES):
            break
        vertices, faces = finer
    return template.carried(vertices), faces
