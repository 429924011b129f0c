"""Still pictures of meshes, as small as the page needs them."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.analysis.report.meshes import PackedMesh
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render

DEFORMED, TRUTH = (92, 158, 237), (199, 196, 189)
"""sRGB of reconstructions and of what is true; the page's script draws in the same."""

_SIZE = 180, 240  # height and width of a still: twice what a wide screen shows
_THUMBNAIL = 84, 112
_COLORS = 48  # of a flat-shaded picture's palette


def still(mesh: PackedMesh, color: tuple[int, int, int], camera: Camera, fit: float) -> bytes:
    """Return a mesh as the page's script draws it first, as PNG on nothing.

    Args:
        mesh: what is seen.
        color: of all its faces.
        camera: from where.
        fit: by how much the mesh is shrunk.
    """
    vertices = mesh.vertices.astype(np.float64) * (mesh.scale * fit / 32767)
    colors = np.tile(np.array([*color, 255], np.uint8), (len(mesh.faces), 1))
    shape = Mesh(vertices, mesh.faces.astype(np.int64), colors)
    height, width = _SIZE
    return _png(render(shape, camera, height=height, width=width, samples=2))


def thumbnail(mesh: Mesh, camera: Camera) -> bytes:
    """Return a small picture of a template, as PNG on nothing."""
    height, width = _THUMBNAIL
    return _png(render(mesh, camera, height=height, width=width, samples=2))


def _png(image: NDArray[np.uint8]) -> bytes:
    """Return a rendered image, (H, W, 4), without the white that it was rendered over."""
    alpha = image[..., 3:].astype(np.float64) / 255
    colors = (image[..., :3] - 255 * (1 - alpha)) / np.maximum(alpha, 1 / 255)
    clear = np.concatenate([colors.clip(0, 255).round().astype(np.uint8), image[..., 3:]], axis=2)
    small = Image.fromarray(clear).quantize(_COLORS, Image.Quantize.FASTOCTREE)
    buffer = io.BytesIO()
    small.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
