"""One prepared shape: what is computed of it, and its file."""

import hashlib
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.data.preparation.packing import pack_cameras, pack_image, pack_mesh, pack_points
from ffd_lightning.data.preparation.part_labels import label_faces, label_points
from ffd_lightning.data.preparation.variants import vary
from ffd_lightning.data.source import Source, SourceShape
from ffd_lightning.errors import RejectedShapeError, UserError, explain_unforeseen, is_of_machine
from ffd_lightning.files import atomic_file
from ffd_lightning.geometry.mesh import Mesh, bounding_box, mean_colors, normalize
from ffd_lightning.geometry.sampling import sample_stratified
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.framing import fit_picture
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render

MAX_TEXELS = 256 * 256
"""Of a shape's textures together, but that each has one at least."""
_DIVISIONS = 7  # of a face's edges, where its texture is averaged
_ARRAYS: dict[str, tuple[type[np.generic], tuple[str | int, ...]]] = {
    "vertices": (np.number, ("V", 3)),
    "faces": (np.integer, ("F", 3)),
    "face_colors": (np.uint8, ("F", 4)),
    "face_parts": (np.integer, ("F",)),
    "face_textures": (np.integer, ("F",)),
    "face_uvs": (np.floating, ("F", 3, 2)),
}
"""Of a `Mesh`: numbers of which kind, and how many."""


def shape_file(folder: Path, shape_id: str) -> Path:
    """Return where a shape's file is; ids may hold anything, names of files may not."""
    return folder / f"{hashlib.sha256(shape_id.encode()).hexdigest()[:24]}.npz"


@dataclass(frozen=True)
class Failure:
    """Why a shape was not made, with a line of text as the reason.

    It cannot be used, took too much time or memory, or the disk or the network failed ("unread").
    """

    kind: Literal["rejected", "given up", "unread"]
    reason: str


@dataclass(frozen=True)
class ShapeMaker:
    """Makes the files of a category's shapes in a folder.

    `origins` names the variants among them, and the shape that each is made of.
    """

    source: Source
    category: str
    num_points: int
    render: RenderSettings
    folder: Path
    origins: Mapping[str, str] = field(default_factory=dict)

    def make(self, shape_id: str) -> Failure | None:
        """Make one shape's file, or return why it cannot be made.

        An error that nobody foresaw rejects the shape too, with the place in the code where it
        arose: one odd shape must not end hours of work.

        Raises:
            UserError: no shape of the source can be loaded.
            OSError: the file cannot be written.
        """
        try:
            arrays = self.arrays(shape_id)
        except UserError:
            raise
        except RejectedShapeError as error:
            return Failure("rejected", " ".join(str(error).split()))
        except (Exception, SystemExit) as error:
            reason = " ".join(explain_unforeseen(error).split())
            if isinstance(error, MemoryError):
                return Failure("given up", reason)
            return Failure("unread" if is_of_machine(error) else "rejected", reason)
        # Not durable: `is_done` sees a file that a power cut broke.
        with atomic_file(shape_file(self.folder, shape_id), durable=False) as file:
            np.savez(file, **arrays)
        return None

    def is_done(self, shape_id: str) -> bool:
        """Return whether a shape's file is there and whole; remove a broken one."""
        file = shape_file(self.folder, shape_id)
        try:
            with zipfile.ZipFile(file) as archive:
                if "warning.npy" in archive.namelist() and archive.testzip() is None:
                    return True
        except FileNotFoundError:
            return False
        except (zipfile.BadZipFile, EOFError, NotImplementedError):
            pass
        file.unlink()
        return False

    def arrays(self, shape_id: str) -> dict[str, Any]:
        """Load, normalise, sample and render one shape; return what its file holds."""
        origin = self.origins.get(shape_id, shape_id)
        loaded = self.source.load(self.category, origin)
        if not isinstance(loaded, SourceShape):
            kind = type(loaded).__name__
            raise RejectedShapeError(f"its source gives a {kind}, not a SourceShape")
        _check_mesh(loaded.mesh)
        shape = _normalized(loaded)
        if origin != shape_id:
            shape = _normalized(vary(shape, f"{self.category}/{shape_id}"))
        mesh = shape.mesh
        # The id alone decides the draw, so that no shape's sample depends on the others.
        key = hashlib.sha256(f"{self.category}/{shape_id}".encode()).digest()
        points, face_ids = sample_stratified(
            mesh.vertices, mesh.faces, self.num_points, np.random.default_rng(list(key))
        )
        cameras: Sequence[Camera] | None
        if shape.images is None:
            to, cameras = self.render, self.render.cameras(f"{self.category}/{shape_id}")
            size = {"height": to.height, "width": to.width, "samples": to.samples}
            images = np.stack([render(mesh, camera, **size) for camera in cameras])
        else:
            images, cameras = _fitted(shape, self.render.height, self.render.width)
        if shape.parts is not None:
            face_parts = label_faces(shape.parts, mesh.vertices, mesh.faces)
            point_parts = label_points(shape.parts, points.astype(np.float64))
            mesh = replace(mesh, face_parts=face_parts, part_names=shape.parts.names)
        else:
            point_parts = mesh.parts()[face_ids]
        warnings = [line for line in shape.warning.splitlines() if line.strip()]
        # Colours of the textures as they came, then textures as they are kept.
        mesh = shrink_textures(replace(mesh, face_colors=mean_colors(mesh, _DIVISIONS)))
        return {
            **{f"image_{view}": pack_image(image) for view, image in enumerate(images)},
            "image_shape": np.array(images.shape),
            "cameras": pack_cameras(cameras, len(images)),
            "points": pack_points(points),
            "mesh": np.frombuffer(pack_mesh(mesh, point_parts), np.uint8),
            "family": np.str_(shape.family),
            "part_names": np.array(mesh.part_names, dtype=np.str_),
            "warning": np.str_("\n".join(" ".join(line.split()) for line in warnings)),
        }


def shrink_textures(mesh: Mesh) -> Mesh:
    """Return a mesh with textures of few texels, all shrunk alike, and none that no face has."""
    if mesh.face_textures is None or mesh.face_uvs is None:
        return mesh
    used, numbers = np.unique(mesh.face_textures, return_inverse=True)
    if used[-1] < 0:
        return mesh.without_textures()
    textures = [mesh.textures[index] for index in used[used >= 0]]
    scale = min(1.0, np.sqrt(MAX_TEXELS / sum(t.shape[0] * t.shape[1] for t in textures)))
    small = []
    for texture in textures:
        width, height = (max(1, int(side * scale)) for side in (texture.shape[1], texture.shape[0]))
        picture = Image.fromarray(np.ascontiguousarray(texture))
        small.append(np.array(picture.resize((width, height), Image.Resampling.BOX)))
    face_textures = (numbers.reshape(-1) - int(used[0] < 0)).astype(np.int16)
    return replace(mesh, textures=tuple(small), face_textures=face_textures)


def _normalized(shape: SourceShape) -> SourceShape:
    """Return a shape whose mesh has box diagonal 1; annotated points and cameras move along."""
    mesh, parts, cameras = shape.mesh, shape.parts, shape.cameras
    center, diagonal = bounding_box(mesh.vertices, mesh.faces)
    if parts is not None:
        parts = replace(parts, points=(parts.points - center) / diagonal)
    if cameras is not None:
        cameras = tuple(camera.moved(center, 1 / diagonal) for camera in cameras)
    mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
    return replace(shape, mesh=mesh, parts=parts, cameras=cameras)


def _check_mesh(mesh: Mesh) -> None:
    """Make sure that a mesh has arrays as `Mesh` describes them, with a row for each face."""
    each = {name: getattr(mesh, name) for name in _ARRAYS}
    each |= {f"textures[{k}]": texture for k, texture in enumerate(mesh.textures)}
    for name, array in each.items():
        if array is None:
            continue
        kind, shape = _ARRAYS.get(name, (np.uint8, ("h", "w", 4)))
        found = array.shape if isinstance(array, np.ndarray) else ()
        same = [a == b or isinstance(a, str) for a, b in zip(shape, found, strict=False)]
        if not (len(found) == len(shape) and all(same) and np.issubdtype(array.dtype, kind)):
            wanted = f"{kind.__name__} ({', '.join(map(str, shape))})"
            gives = f"{array.dtype} {found}" if found else f"a {type(array).__name__}"
            raise RejectedShapeError(f"its source must give {name} as {wanted}; it gives {gives}")
        if shape[0] == "F" and len(array) != len(mesh.faces):
            raise RejectedShapeError(
                f"its source gives {len(array)} {name} for {len(mesh.faces)} faces"
            )
    if mesh.faces.size and not 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices):
        raise RejectedShapeError("its source gives faces of vertices that are not there")


def _fitted(
    shape: SourceShape, height: int, width: int
) -> tuple[NDArray[np.uint8], Sequence[Camera] | None]:
    """Return a source's own images, (views, H, W, 4), and cameras that see what is round them."""
    pictures, cameras = list(shape.images or ()), shape.cameras
    right = [p.dtype == np.uint8 and p.ndim == 3 and p.shape[2] == 4 for p in pictures]
    if not (pictures and all(right) and len(cameras or pictures) == len(pictures)):
        raise RejectedShapeError(
            "its source must give images uint8 (H, W, 4), and as many cameras or none; it gives "
            f"{[(p.dtype.name, p.shape) for p in pictures]} and {len(cameras or ())} cameras"
        )
    if cameras is not None:
        cameras = [
            camera.widened(height / min(height, width * picture.shape[0] / picture.shape[1]))
            for camera, picture in zip(cameras, pictures, strict=True)
        ]
    return np.stack([fit_picture(Image.fromarray(p), height, width) for p in pictures]), cameras
