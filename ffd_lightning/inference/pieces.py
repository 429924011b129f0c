"""Meshes divided by part and material: what GLB files and browsers draw has one material each."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.palette import part_colors

MeshColors = Literal["photo", "material", "parts"]
"""What the colours of a mesh say: what the photograph shows, what the template is of, or its parts.
"""


@dataclass(frozen=True)
class Piece:
    """The faces of a mesh that have one colour, or one texture.

    Attributes:
        name: of the part they are of, "mesh" where that is unknown or several.
        vertices: which of the mesh's it uses, (v,); one with several UVs is there for each.
        faces: indices into those, (f, 3).
        rgba: its colour, four of 0 to 255; white where it has a texture.
        texture: which of the mesh's, -1 for none.
        uvs: of the vertices, (v, 2), where it has a texture.
    """

    name: str
    vertices: NDArray[np.int64]
    faces: NDArray[np.int64]
    rgba: tuple[int, int, int, int]
    texture: int = -1
    uvs: NDArray[np.float32] | None = None


def face_colors(mesh: Mesh, colors: MeshColors) -> NDArray[np.uint8]:
    """Return RGBA of each face, (F, 4): its own, or for `parts` that of its part where known."""
    if colors != "parts" or mesh.face_parts is None:
        return mesh.face_colors
    return part_colors(mesh.face_parts)


def pieces(mesh: Mesh, colors: MeshColors, most: int, by_part: bool = True) -> list[Piece]:
    """Divide a mesh by colour and texture.

    Args:
        mesh: with a colour per face, and perhaps with textures.
        colors: what the colours say; those by part are plain.
        most: plain colours that are told apart, each opaque or see-through; like ones become one.
        by_part: divide it by part too.
    """
    rgba = face_colors(mesh, colors).copy()
    textures = np.full(len(mesh.faces), -1)
    if mesh.face_textures is not None and (colors != "parts" or mesh.face_parts is None):
        textures = mesh.face_textures.astype(np.int64)
    plain = textures < 0
    rgba[plain], rgba[~plain] = _few_colors(rgba[plain], most), 255
    parts = np.zeros(len(mesh.faces), np.uint8)
    if by_part and mesh.face_parts is not None:
        parts = mesh.face_parts
    # One number for part, texture and colour: sorting those is many times faster than sorting rows.
    codes = parts.astype(np.uint64) << np.uint64(48) | _codes(rgba)
    codes |= (textures + 1).astype(np.uint64) << np.uint64(32)
    kinds, kind = np.unique(codes, return_inverse=True)
    ends = np.cumsum(np.bincount(kind, minlength=len(kinds)))
    result = []
    for group in np.split(np.argsort(kind, kind="stable"), ends[:-1]):
        part, texture = int(parts[group[0]]), int(textures[group[0]])
        name = mesh.part_names[part] if by_part and part < len(mesh.part_names) else "mesh"
        red, green, blue, alpha = rgba[group[0]].tolist()
        corners, uvs = mesh.faces[group].reshape(-1), None
        if texture >= 0 and mesh.face_uvs is not None:
            # The bits of a UV's two numbers as one, and pairs as one number again: see above.
            bits = np.ascontiguousarray(mesh.face_uvs[group]).view(np.uint64).reshape(-1)
            bits, number = np.unique(bits, return_inverse=True)
            pairs, faces = np.unique(corners * len(bits) + number, return_inverse=True)
            used, own = np.divmod(pairs, len(bits))
            uvs = bits.view(np.float32).reshape(-1, 2)[own]
        else:
            used, faces = np.unique(corners, return_inverse=True)
        color = (red, green, blue, alpha)
        result.append(Piece(name, used, faces.reshape(-1, 3), color, texture, uvs))
    # Textured ones first: trimesh writes an OBJ's UVs as if no piece before had gone without.
    return sorted(result, key=lambda piece: piece.texture < 0)


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
