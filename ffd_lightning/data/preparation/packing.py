"""How shapes are kept on disk: small, nearly exact, and quick to get back.

Images are compressed one by one, a mesh as one block. Coordinates of clouds are rounded to 1/65534
of the bounding box's diagonal. Textures are WebP pictures; all else is exact to the float32.
"""

import io
import threading
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera

POINT_STEP = 1 / 65534
"""What one unit of a packed coordinate is, in diagonals; half of it is the most that is lost."""
UV_STEP = 1 / 4096
"""What one unit of a packed texture coordinate is, in widths or heights of the texture."""
HEADERS = threading.Lock()
"""For reading an array's header: numpy has Python parse it, whose version 3.11 raises a SystemError
now and then where two threads parse at once (python/cpython#106905)."""
_MAX_UV = 2**30 - 1  # so that differences are within 32 bits
_QUALITY = 90  # of textures, of 100


def pack_points(points: NDArray[np.floating]) -> NDArray[np.int16]:
    """Round coordinates within [-0.5, 0.5] to multiples of `POINT_STEP`; the shape stays.

    >>> pack_points(np.array([-0.5, 0.0, 0.25]))
    array([-32767,      0,  16384], dtype=int16)
    """
    return np.round(np.clip(points, -0.5, 0.5) / POINT_STEP).astype(np.int16)


def unpack_points(packed: NDArray[np.int16]) -> NDArray[np.float32]:
    """Return packed coordinates as float32, in diagonals; the shape stays."""
    return packed.astype(np.float32) * np.float32(POINT_STEP)


def pack_image(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Compress one image, (H, W, 4), to its bytes."""
    # Rendered images are mostly background: PNG's filters make them larger and slower to read.
    return np.frombuffer(zlib.compress(image.tobytes(), 6), np.uint8)


def unpack_image(packed: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """Return an image of a known shape (H, W, 4)."""
    return np.frombuffer(zlib.decompress(packed.data), np.uint8).reshape(shape)


def pack_cameras(cameras: Sequence[Camera] | None, views: int) -> NDArray[np.float64]:
    """Return angles, distance, lens and target for each image, (views, 7); NaN where unknown."""
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
    """Compress a mesh, and the parts of its cloud's points, (N,); textures lose a little."""
    faces = mesh.faces.astype(np.int32)
    data = io.BytesIO()
    np.savez_compressed(
        data,
        vertices=_planes(mesh.vertices.astype(np.float32)),
        # Corners follow each other closely in nearly all files: differences compress well.
        faces=_planes(np.diff(faces.reshape(-1), prepend=np.int32(0))),
        face_colors=_planes(mesh.face_colors),
        face_parts=mesh.parts(),
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
        with HEADERS, np.load(io.BytesIO(packed), allow_pickle=False) as archive:
            arrays = dict(archive)
        steps = _values(arrays["faces"], np.int32)
        mesh = Mesh(
            vertices=_values(arrays["vertices"], np.float32).astype(np.float64),
            faces=np.cumsum(steps, dtype=np.int64).reshape(-1, 3),
            face_colors=_values(arrays["face_colors"], np.uint8),
            face_parts=arrays["face_parts"],
            part_names=tuple(arrays["part_names"].tolist()),
        )
        if "textures" in arrays:
            mesh = _with_textures(mesh, arrays)
        return mesh, arrays["point_parts"]
    except (OSError, LookupError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from None


def _packed_textures(mesh: Mesh) -> dict[str, Any]:
    """Return the arrays that hold a mesh's textures; none where it has no textures."""
    if mesh.face_textures is None or mesh.face_uvs is None or not mesh.textures:
        return {}
    pictures = []
    for texture in mesh.textures:  # a tenth of what it takes without loss
        data = io.BytesIO()
        Image.fromarray(np.ascontiguousarray(texture)).save(data, "WEBP", quality=_QUALITY)
        pictures.append(data.getvalue())
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
        "texture_sizes": np.array(list(map(len, pictures))),
        "face_textures": mesh.face_textures,
        "vertex_uvs": _planes(vertex_uvs),
        "uv_differences": _planes(uvs - vertex_uvs[corners]),
    }


def _with_textures(mesh: Mesh, arrays: Mapping[str, NDArray]) -> Mesh:
    """Return a mesh with the textures of `_packed_textures`; Pillow refuses giant ones."""
    pictures = np.split(arrays["textures"], np.cumsum(arrays["texture_sizes"]))[:-1]
    textures = [Image.open(io.BytesIO(p.tobytes()), formats=("WEBP",)) for p in pictures]
    face_textures = arrays["face_textures"]
    textured = face_textures >= 0
    differences = _values(arrays["uv_differences"], np.int32).reshape(-1, 3, 2)
    uvs = np.zeros((len(mesh.faces), 3, 2), np.float32)
    vertex_uvs = _values(arrays["vertex_uvs"], np.int32)
    uvs[textured] = UV_STEP * (vertex_uvs[mesh.faces[textured]] + differences)
    return replace(
        mesh,
        textures=tuple(np.array(texture.convert("RGBA")) for texture in textures),
        face_textures=face_textures,
        face_uvs=uvs,
    )


def _planes(values: NDArray[np.generic]) -> NDArray[np.uint8]:
    """Return values as bytes, all first bytes before all second ones: it compresses better."""
    columns = np.ascontiguousarray(values.T if values.ndim > 1 else values[None])
    return np.stack([c.view(np.uint8).reshape(len(c), -1).T for c in columns])


def _values(planes: NDArray[np.uint8], kind: type[np.generic]) -> NDArray:
    """Undo `_planes`: return values, (rows, columns)."""
    return np.ascontiguousarray(planes.transpose(2, 0, 1)).view(kind)[..., 0]
