"""One prepared shape: what is computed of it, and its file."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.data.preparation.packing import (
    pack_cameras,
    pack_image,
    pack_mesh,
    pack_points,
)
from ffd_lightning.data.preparation.part_labels import label_faces, label_points
from ffd_lightning.data.preparation.texture_reduction import shrink_textures
from ffd_lightning.data.source import Source, SourceShape
from ffd_lightning.errors import (
    RejectedShapeError,
    UserError,
    explain_unforeseen,
    is_of_machine,
)
from ffd_lightning.files import atomic_file
from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh, bounding_box, mean_colors, normalize
from ffd_lightning.geometry.sampling import sample_stratified
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.framing import fit_picture
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render

NEARLY_WHITE = 225.0
"""Mean brightness of the pixels a shape covers, of 255, above which it is hard to see on white."""

_DIVISIONS = 7  # of a face's edges, where its texture is averaged


def shape_file(folder: Path, shape_id: str) -> Path:
    """Return where a shape's file is; ids may hold anything, names of files may not."""
    return folder / f"{hashlib.sha256(shape_id.encode()).hexdigest()[:24]}.npz"


@dataclass(frozen=True)
class Recipe:
    """What is made of each shape of a category, and the folder it goes to."""

    source: Source
    category: str
    num_points: int
    render: RenderSettings
    folder: Path

    def file(self, shape_id: str) -> Path:
        """Return where a finished shape goes."""
        return shape_file(self.folder, shape_id)


@dataclass(frozen=True)
class Failure:
    """Why a shape was not made.

    Attributes:
        kind: "rejected": it cannot be used; "given up": it took too much time or memory; "unread":
            the disk or the network failed, so that nothing can be said of it.
        reason: in words, in one line.
    """

    kind: Literal["rejected", "given up", "unread"]
    reason: str


def compute_shape(recipe: Recipe, shape_id: str) -> dict[str, Any] | Failure:
    """Load, normalise, sample and render one shape.

    An error that nobody foresaw rejects the model too, with the place in the code where it arose:
    one odd shape must not end hours of work.

    Args:
        recipe: what to make.
        shape_id: of the shape.

    Returns:
        What its file holds, or why it cannot be made.

    Raises:
        UserError: what no shape of the source can be loaded for.
    """
    try:
        return _arrays(recipe, shape_id)
    except UserError:
        raise
    except RejectedShapeError as error:
        return Failure("rejected", " ".join(str(error).split()))
    except Exception as error:
        kind: Literal["rejected", "given up", "unread"] = "rejected"
        if is_of_machine(error):
            kind = "unread" if isinstance(error, OSError) else "given up"
        return Failure(kind, " ".join(explain_unforeseen(error).split()))


def write_shape(recipe: Recipe, shape_id: str, arrays: dict[str, Any]) -> None:
    """Write one shape's file.

    Raises:
        OSError: it cannot be written.
    """
    # Not durable: `is_done` sees a file that a power cut broke.
    with atomic_file(recipe.file(shape_id), durable=False) as file:
        np.savez(file, **arrays)


def is_done(recipe: Recipe, shape_id: str) -> bool:
    """Return whether a shape's file is there and whole; remove a broken one."""
    file = recipe.file(shape_id)
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


def _arrays(recipe: Recipe, shape_id: str) -> dict[str, Any]:
    """Load, normalise, sample and render one shape; return what its file holds."""
    loaded = recipe.source.load(recipe.category, shape_id)
    if not isinstance(loaded, SourceShape):
        raise RejectedShapeError(f"its source gives a {type(loaded).__name__}, not a SourceShape")
    model = _normalized(loaded)
    mesh = model.mesh
    # The id alone decides the draw, so that no shape's sample depends on the others.
    key = hashlib.sha256(f"{recipe.category}/{shape_id}".encode()).digest()
    points, face_ids = sample_stratified(
        mesh.vertices, mesh.faces, recipe.num_points, np.random.default_rng(list(key))
    )
    if model.images is None:
        cameras: Sequence[Camera] | None = recipe.render.cameras(f"{recipe.category}/{shape_id}")
        images = _rendered(mesh, recipe.render, cameras or ())
    else:
        images, cameras = _fitted(model, recipe.render.height, recipe.render.width)
    packed = [pack_image(image) for image in images]
    if model.parts is not None:
        face_parts = label_faces(model.parts, mesh.vertices, mesh.faces)
        point_parts = label_points(model.parts, points.astype(np.float64))
        mesh = replace(mesh, face_parts=face_parts, part_names=model.parts.names)
    elif mesh.face_parts is not None:
        point_parts = mesh.face_parts[face_ids]
    else:
        point_parts = np.full(len(points), UNKNOWN_PART, np.uint8)
    # Colours of the textures as they came, then textures as they are kept.
    mesh = shrink_textures(replace(mesh, face_colors=mean_colors(mesh, _DIVISIONS)))
    return {
        **{f"image_{view}": np.frombuffer(p, np.uint8) for view, p in enumerate(packed)},
        "image_shape": np.array(images.shape),
        "cameras": pack_cameras(cameras, len(images)),
        "points": pack_points(points),
        "mesh": np.frombuffer(pack_mesh(mesh, point_parts), np.uint8),
        "family": np.str_(model.family),
        "part_names": np.array(mesh.part_names, dtype=np.str_),
        "warning": np.str_("\n".join(_warnings(model, images))),
    }


def _warnings(model: SourceShape, images: NDArray[np.uint8]) -> list[str]:
    """Return what is wrong with a shape, and whether it hardly shows in its images, a line each.

    A warning is "what: details", as `SourceShape` has it.
    """
    lines = [" ".join(line.split()) for line in model.warning.splitlines() if line.strip()]
    covered = images[images[..., 3] > 127, :3]
    brightness = float(covered.mean()) if len(covered) else 0.0
    if brightness > NEARLY_WHITE:
        lines.append(f"nearly invisible on white: brightness {brightness:.0f} of 255")
    return lines


def _normalized(model: SourceShape) -> SourceShape:
    """Return a shape whose mesh has box diagonal 1; annotated points and cameras move along."""
    mesh, parts, cameras = model.mesh, model.parts, model.cameras
    center, diagonal = bounding_box(mesh.vertices, mesh.faces)
    if parts is not None:
        parts = replace(parts, points=(parts.points - center) / diagonal)
    if cameras is not None:
        cameras = tuple(camera.moved(center, 1 / diagonal) for camera in cameras)
    vertices = normalize(mesh.vertices, mesh.faces)
    return replace(model, mesh=mesh.with_vertices(vertices), parts=parts, cameras=cameras)


def _fitted(
    model: SourceShape, height: int, width: int
) -> tuple[NDArray[np.uint8], Sequence[Camera] | None]:
    """Return a source's own images, (views, H, W, 4), and cameras that see what is round them."""
    pictures, cameras = list(model.images or ()), model.cameras
    for picture in pictures:
        if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 4:
            raise RejectedShapeError(
                f"its source gives an image {picture.dtype} {picture.shape}, not uint8 (H, W, 4)"
            )
    if not pictures or (cameras is not None and len(cameras) != len(pictures)):
        count = "no" if cameras is None else str(len(cameras))
        raise RejectedShapeError(f"its source gives {len(pictures)} images of {count} cameras")
    if cameras is not None:
        cameras = [
            camera.widened(height / min(height, width * picture.shape[0] / picture.shape[1]))
            for camera, picture in zip(cameras, pictures, strict=True)
        ]
    return np.stack([fit_picture(Image.fromarray(p), height, width) for p in pictures]), cameras


def _rendered(mesh: Mesh, views: RenderSettings, cameras: Sequence[Camera]) -> NDArray[np.uint8]:
    """Return a mesh's images, (views, H, W, 4)."""
    images = [
        render(mesh, camera, height=views.height, width=views.width, samples=views.samples)
        for camera in cameras
    ]
    return np.stack(images)
