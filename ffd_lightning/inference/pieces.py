"""Meshes divided by part and colour: what GLB files and browsers draw has one material each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.data.preparation.part_labels import part_colors
from ffd_lightning.geometry.mesh import Mesh

MeshColors = Literal["material", "parts"]
"""What the colours of a mesh say."""


@dataclass(frozen=True)
class Piece:
    """The faces of a mesh that have one colour.

    Attributes:
        name: of the part they are of, "mesh" where that is unknown or several.
        vertices: which of the mesh's it uses, (v,).
        faces: indices into those, (f, 3).
        rgba: its colour, four of 0 to 255.
    """

    name: str
    vertices: NDArray[np.int64]
    faces: NDArray[np.int64]
    rgba: tuple[int, int, int, int]


def face_colors(mesh: Mesh, colors: MeshColors) -> NDArray[np.uint8]:
    """Return RGBA of each face, (F, 4), by its material, or by its part where those are known."""
    if colors == "material" or mesh.face_parts is None:
        return mesh.face_colors
    return part_colors(mesh.face_parts)


def pieces(mesh: Mesh, colors: MeshColors, most: int, by_part: bool = True) -> list[Piece]:
    """Divide a mesh by colour.

    Args:
        mesh: with a colour per face.
        colors: what they say.
        most: colours that are told apart, each opaque or see-through; like ones become one.
        by_part: divide it by part too.
    """
    rgba = _few_colors(face_colors(mesh, colors), most)
    parts = np.zeros(len(mesh.faces), np.uint8)
    if by_part and mesh.face_parts is not None:
        parts = mesh.face_parts
    # One number for part and colour: sorting those is many times faster than sorting rows.
    codes = (parts.astype(np.uint64) << np.uint64(32)) | _codes(rgba)
    kinds, kind = np.unique(codes, return_inverse=True)
    ends = np.cumsum(np.bincount(kind, minlength=len(kinds)))
    result = []
    for group in np.split(np.argsort(kind, kind="stable"), ends[:-1]):
        part = int(parts[group[0]])
        name = mesh.part_names[part] if by_part and part < len(mesh.part_names) else "mesh"
        used, faces = np.unique(mesh.faces[group], return_inverse=True)
        red, green, blue, alpha = rgba[group[0]].tolist()
        result.append(Piece(name, used, faces.reshape(-1, 3), (red, green, blue, alpha)))
    return result


def _codes(rgba: NDArray[np.uint8]) -> NDArray[np.uint32]:
    return np.ascontiguousarray(rgba).view("<u4")[:, 0]


def _few_colors(rgba: NDArray[np.uint8], most: int) -> NDArray[np.uint8]:
    """Return face colours (F, 4) of which few are different."""
    if len(np.unique(_codes(rgba))) <= most:
        return rgba
    picture = Image.fromarray(np.ascontiguousarray(rgba[None, :, :3]))
    few = np.asarray(picture.quantize(most, dither=Image.Dither.NONE).convert("RGB"))[0]
    # Of what is see-through it matters that it is, not how much.
    glass = rgba[:, 3] < 250
    alpha = np.where(glass, np.median(rgba[glass, 3]) if glass.any() else 255, 255)
    return np.column_stack([few, alpha]).astype(np.uint8)
