"""One prepared model: what is computed of it, and its file in the working folder."""

from __future__ import annotations

import hashlib
import os
import zipfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.config import RenderConfig
from ffd_lightning.data.mesh import Mesh
from ffd_lightning.data.prepared import UNKNOWN_PART
from ffd_lightning.data.rendering import render
from ffd_lightning.data.sources.base import Source
from ffd_lightning.errors import RejectedModelError
from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.geometry.sampling import sample_surface

# Barycentric coordinates spread over a face, (36, 3).
_FACE_PLACES = np.array([(i, j, 7 - i - j) for i in range(8) for j in range(8 - i)]) / 7
_CONTENTS = frozenset(
    ("images", "points", "face_ids", "point_parts", "vertices", "faces", "face_parts")
    + ("face_colors", "family", "part_names")
)


@dataclass(frozen=True)
class Recipe:
    """What is made of each model of a category, and the working folder it goes to."""

    source: Source
    category: str
    num_points: int
    render: RenderConfig
    folder: Path

    def file(self, model_id: str) -> Path:
        """Return where a finished model goes; ids may hold anything, names of files may not."""
        return self.folder / f"{hashlib.sha256(model_id.encode()).hexdigest()[:24]}.npz"

    def rejection(self, model_id: str) -> Path:
        """Return where the reason goes for which a model was rejected."""
        return self.file(model_id).with_suffix(".rejected")


def make_model(recipe: Recipe, model_id: str) -> None:
    """Write one model's file, or the reason why it is rejected.

    Raises:
        OSError: the file cannot be written.
    """
    try:
        arrays = _arrays(recipe, model_id)
    except RejectedModelError as error:
        reject(recipe, model_id, str(error))
        return
    except Exception as error:  # one odd model must not end hours of work
        reject(recipe, model_id, f"{type(error).__name__}: {error}")
        return
    file = recipe.file(model_id)
    temporary = file.with_suffix(f".{os.getpid()}.tmp")
    with temporary.open("wb") as stream:
        np.savez(stream, **arrays)
    temporary.replace(file)


def reject(recipe: Recipe, model_id: str, reason: str) -> None:
    """Write down why a model is not in the set."""
    file = recipe.rejection(model_id)
    temporary = file.with_suffix(f".{os.getpid()}.tmp")
    temporary.write_text(" ".join(reason.split()), encoding="utf-8")
    temporary.replace(file)


def is_done(recipe: Recipe, model_id: str) -> bool:
    """Return whether a model is rejected or its file is there and whole; remove a broken file."""
    if recipe.rejection(model_id).exists():
        return True
    file = recipe.file(model_id)
    try:
        with zipfile.ZipFile(file) as archive:
            names = {name.removesuffix(".npy") for name in archive.namelist()}
            if names == _CONTENTS and archive.testzip() is None:
                return True
    except FileNotFoundError:
        return False
    except (zipfile.BadZipFile, EOFError, NotImplementedError):
        pass
    file.unlink()
    return False


def _arrays(recipe: Recipe, model_id: str) -> dict[str, Any]:
    """Load, normalise, sample and render one model; return what its file holds."""
    model = recipe.source.load(recipe.category, model_id)
    mesh = model.mesh.with_vertices(normalize(model.mesh.vertices, model.mesh.faces))
    # The id alone decides the draw, so that no model's sample depends on the others.
    key = hashlib.sha256(f"{recipe.category}/{model_id}".encode()).digest()
    points, face_ids = sample_surface(
        mesh.vertices, mesh.faces, recipe.num_points, np.random.default_rng(list(key))
    )
    images = _rendered(mesh, recipe.render) if model.images is None else model.images
    parts = mesh.face_parts
    if parts is None:
        parts = np.full(len(mesh.faces), UNKNOWN_PART, np.uint8)
    return {
        "images": images,
        "points": points.astype(np.float32),
        "face_ids": face_ids.astype(np.int32),
        "point_parts": parts[face_ids],
        "vertices": mesh.vertices.astype(np.float32),
        "faces": mesh.faces.astype(np.int32),
        "face_parts": parts,
        "face_colors": _plain_colors(mesh),
        "family": np.str_(model.family),
        "part_names": np.array(mesh.part_names, dtype=np.str_),
    }


def _rendered(mesh: Mesh, views: RenderConfig) -> NDArray[np.uint8]:
    """Return a mesh's images, (views, H, W, 4)."""
    images = [
        render(
            mesh,
            height=views.height,
            width=views.width,
            elevation=views.elevation,
            azimuth=azimuth,
            samples=views.samples,
        )
        for azimuth in views.azimuths
    ]
    return np.stack(images)


def _plain_colors(mesh: Mesh) -> NDArray[np.uint8]:
    """Return one colour per face, (F, 4) uint8: the mean of its texture at places all over it."""
    colors = mesh.face_colors.copy()
    if mesh.face_textures is None or mesh.face_uvs is None:
        return colors
    for index, texture in enumerate(mesh.textures):
        textured = mesh.face_textures == index
        height, width = texture.shape[:2]
        total = np.zeros((int(textured.sum()), 4))
        for place in _FACE_PLACES:  # not all at once: a face costs memory for each place
            u, v = np.einsum("c,fcd->df", place, mesh.face_uvs[textured]) % 1.0
            rows = np.minimum(((1 - v) * height).astype(int), height - 1)
            columns = np.minimum((u * width).astype(int), width - 1)
            total += texture[rows, columns]
        colors[textured] = np.round(total / len(_FACE_PLACES))
    return colors
