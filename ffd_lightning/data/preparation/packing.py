"""How shapes are kept on disk: small, exact but for the clouds, and quick to get back.

Images are compressed one by one, a mesh as one block. Clouds stay mapped arrays, since training
picks points at random: their coordinates are rounded to 1/65534 of the bounding box's diagonal.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Sequence
from dataclasses import astuple

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera

# What zipfile, zlib, struct and numpy raise on damaged bytes.
_DAMAGED = (
    *(OSError, ValueError, LookupError, ArithmeticError, EOFError, MemoryError, RuntimeError),
    *(SyntaxError, struct.error, zipfile.BadZipFile, zlib.error),
)

UNKNOWN_PART = 255
POINT_STEP = 1 / 65534
"""What one unit of a packed coordinate is, in diagonals; half of it is the most that is lost."""


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
    """Compress a mesh without its textures, and the parts of its cloud's points, (N,).

    Vertices are kept as float32, faces as int32.
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
            return mesh, arrays["point_parts"]
    except _DAMAGED as error:
        raise ValueError(f"{type(error).__name__}: {error}") from None


def _planes(values: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return values as bytes, all first bytes before all second ones: alike stands by alike."""
    columns = np.ascontiguousarray(values.T if values.ndim > 1 else values[None])
    return np.stack([c.view(np.uint8).reshape(len(c), -1).T for c in columns])


def _values(planes: NDArray[np.uint8], dtype: np.dtype) -> NDArray:
    """Undo `_planes`; values of several columns come back column after column, transposed."""
    columns = [np.ascontiguousarray(p.T).view(dtype)[:, 0] for p in planes]
    return np.stack(columns, axis=1)
