"""How shapes are kept on disk: small, nearly exact, and quick to get back.

Images are compressed one by one, a mesh as one block. Coordinates of clouds are rounded to 1/65534
of the bounding box's diagonal.
Textures are WebP pictures; all else is exact to the float32.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh
from ffd_lightning.imaging.camera import Camera

# What zipfile, zlib, struct, numpy and Pillow raise on damaged bytes.
_DAMAGED = (
    *(OSError, ValueError, LookupError, ArithmeticError, EOFError, MemoryError, RuntimeError),
    *(SyntaxError, struct.error, zipfile.BadZipFile, zlib.error, Image.DecompressionBombError),
)

POINT_STEP = 1 / 65534
"""What one unit of a packed coordinate is, in diagonals; half of it is the most that is lost."""
UV_STEP = 1 / 4096
"""What one unit of a packed texture coordinate is, in widths or heights of the texture."""
_MAX_UV = 2**30 - 1  # so that differences are within 32 bits
_QUALITY = 90  # of textures, of 100
_MAX_TEXELS = 1 << 26  # of a mesh; decoding takes four bytes for each


def pack_points(points: NDArray[np.floating]) -> NDArray[np.int16]:
    """Round coordinates within [-0.5, 0.5] to multiples of `POINT_STEP`; the shape stays.

    >>> pack_points(np.array([-0.5, 0.0, 0.25]))
    array([-32767,      0,  16384], dtype=int16)
    """
    return np.round(np.clip(points, -0.5, 0.5) / POINT_STEP).astype(np.int16)


def unpack_points(packed: NDArray[np.int16]) -> NDArray[np.float32]:
    """Return packed coordinates as float32, in diagonals; the shape stays."""
    return packed.astype(np.float32) * np.float32(POINT_STEP)


def pack_image(image: NDArray[np.uint8]) -> bytes:
    """Compress one image, (H, W, 4) uint8."""
    # Rendered images are mostly background: PNG's filters make them larger and slower to read.
    return zlib.compress(image.tobytes(), 6)


def unpack_image(packed: bytes | memoryview, shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return an image of a known shape (H, W, 4).

    Raises:
        ValueError: the bytes are damaged.
    """
    try:
        return np.frombuffer(zlib.decompress(packed), np.uint8).reshape(shape)
    except zlib.error as error:
        raise ValueError(str(error)) from None


def pack_cameras(cameras: Sequence[Camera] | None, views: int) -> NDArray[np.float64]:
    """Return one row per image, (views, 7): angles, distance, field of view and target.

    Args:
        cameras: of the images; None where nobody knows them, for rows of NaN.
        views: how many images there are.
    """
    if cameras is None:
        return np.full((views, 7), np.nan)
    return np.array([[*astuple(camera)[:4], *camera.target] for camera in cameras], np.float64)


def unpack_camera(packed: NDArray[np.float64]) -> Camera:
    """Return a camera, of (7,); one that frames a shape where it is unknown."""
    if not np.isfinite(packed).all():
        return Camera()
    azimuth, elevation, distance, field_of_view, x, y, z = packed.tolist()
    return Camera(azimuth, elevation, distance, field_of_view, (x, y, z))


def pack_mesh(mesh: Mesh, point_parts: NDArray[np.uint8]) -> bytes:
    """Compress a mesh, and the parts of its cloud's points, (N,).

    Vertices are kept as float32, faces as int32, UVs as multiples of `UV_STEP`. Textures lose what
    the eye hardly sees, and again when they are packed again.
    """
    parts = mesh.face_parts
    if parts is None:
        parts = np.full(len(mesh.faces), UNKNOWN_PART, np.uint8)
    faces = mesh.faces.astype(np.int32)
    data = io.BytesIO()
    np.savez_compressed(
        data,
        vertices=_planes(mesh.vertices.astype(np.float32)),
        # Corners follow each other closely in nearly all files: differences compress well.
        faces=_planes(np.diff(faces.reshape(-1), prepend=np.int32(0))),
        face_colors=_planes(mesh.face_colors),
        face_parts=parts,
        point_parts=point_parts,
        part_names=np.array(mesh.part_names, dtype=np.str_),
        **_packed_textures(mesh),
    )
    return data.getvalue()


def unpack_mesh(packed: bytes) -> tuple[Mesh, NDArray[np.uint8]]:
    """Return a mesh and the parts of its cloud's points, (N,) index into its `part_names`.

    Raises:
        ValueError: the bytes are damaged.
    """
    try:
        with np.load(io.BytesIO(packed), allow_pickle=False) as arrays:
            steps = _values(arrays["faces"], np.dtype(np.int32))
            mesh = Mesh(
                vertices=_values(arrays["vertices"], np.dtype(np.float32))
                .reshape(-1, 3)
                .astype(np.float64),
                faces=np.cumsum(steps, dtype=np.int64).reshape(-1, 3),
                face_colors=_values(arrays["face_colors"], np.dtype(np.uint8)).reshape(-1, 4),
                face_parts=arrays["face_parts"],
                part_names=tuple(arrays["part_names"].tolist()),
            )
            if "textures" in arrays:
                mesh = _with_textures(mesh, arrays)
            return mesh, arrays["point_parts"]
    except _DAMAGED as error:
        raise ValueError(f"{type(error).__name__}: {error}") from None


def _packed_textures(mesh: Mesh) -> dict[str, Any]:
    """Return the arrays that hold a mesh's textures; none where it has no textures."""
    if mesh.face_textures is None or mesh.face_uvs is None or not mesh.textures:
        return {}
    pictures = [_webp(texture) for texture in mesh.textures]
    textured = mesh.face_textures >= 0
    corners = mesh.faces[textured].reshape(-1)
    steps = np.clip(mesh.face_uvs[textured].astype(np.float64) / UV_STEP, -_MAX_UV, _MAX_UV)
    uvs = np.round(steps).astype(np.int32).reshape(-1, 2)
    # Most faces that meet at a vertex have the same UV there: it is kept once, and what others
    # differ by, mostly 0.
    used, first = np.unique(corners, return_index=True)
    vertex_uvs = np.zeros((len(mesh.vertices), 2), np.int32)
    vertex_uvs[used] = uvs[first]
    return {
        "textures": np.frombuffer(b"".join(pictures), np.uint8),
        "texture_sizes": np.array([len(picture) for picture in pictures]),
        "face_textures": mesh.face_textures,
        "vertex_uvs": _planes(vertex_uvs),
        "uv_differences": _planes(uvs - vertex_uvs[corners]),
    }


def _with_textures(mesh: Mesh, arrays: Mapping[str, NDArray]) -> Mesh:
    """Return a mesh with the textures of `_packed_textures`."""
    ends = np.cumsum(arrays["texture_sizes"])
    pictures = [
        Image.open(io.BytesIO(p.tobytes()), formats=("WEBP",))
        for p in np.split(arrays["textures"], ends)[:-1]
    ]
    if sum(picture.width * picture.height for picture in pictures) > _MAX_TEXELS:
        raise ValueError(f"its textures have more than {_MAX_TEXELS:,} texels")
    face_textures = arrays["face_textures"]
    if face_textures.max(initial=-1) >= len(pictures):
        raise ValueError(f"a face has texture {face_textures.max()} of {len(pictures)}")
    textured = face_textures >= 0
    vertex_uvs, differences = (
        _values(arrays[name], np.dtype(np.int32)) for name in ("vertex_uvs", "uv_differences")
    )
    uvs = np.zeros((len(mesh.faces), 3, 2), np.float32)
    uvs[textured] = UV_STEP * (vertex_uvs[mesh.faces[textured]] + differences.reshape(-1, 3, 2))
    return replace(
        mesh,
        textures=tuple(np.array(picture.convert("RGBA")) for picture in pictures),
        face_textures=face_textures,
        face_uvs=uvs,
    )


def _webp(texture: NDArray[np.uint8]) -> bytes:
    """Return a texture, (h, w, 4), as a file of a tenth of what it takes without loss."""
    data = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(texture)).save(data, "WEBP", quality=_QUALITY)
    return data.getvalue()


def _planes(values: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return values as bytes, all first bytes before all second ones: alike stands by alike."""
    columns = np.ascontiguousarray(values.T if values.ndim > 1 else values[None])
    return np.stack([c.view(np.uint8).reshape(len(c), -1).T for c in columns])


def _values(planes: NDArray[np.uint8], dtype: np.dtype) -> NDArray:
    """Undo `_planes`; values of several columns come back column after column, transposed."""
    columns = [np.ascontiguousarray(p.T).view(dtype)[:, 0] for p in planes]
    return np.stack(columns, axis=1)
