"""Pictures of reconstructions, drawn with the project's own renderer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.rendering import render
from ffd_lightning.imaging.sheet import contact_sheet, text_width
from ffd_lightning.nn.network import TemplateFfdNetwork

_CLOUD_POINTS = 2048
_CELL = (192, 256)  # pixels, of a template
_FONT = 12
_COLUMNS = ("input", "template", "deformed cloud", "deformed mesh", "ground truth")
_POINT_RADIUS = 0.006
_OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
_OCTAHEDRON_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
)


def cloud_mesh(
    points: ArrayLike, radius: float = _POINT_RADIUS, colors: NDArray[np.uint8] | None = None
) -> Mesh:
    """Turn a cloud into small octahedra, so that it can be rendered.

    Args:
        points: (N, 3).
        radius: of an octahedron, from its centre to its corners.
        colors: of the points, (N, 4) uint8 RGBA; by height where it is None.
    """
    centers = np.asarray(points, float)
    vertices = (centers[:, None] + radius * _OCTAHEDRON).reshape(-1, 3)
    faces = (6 * np.arange(len(centers))[:, None, None] + _OCTAHEDRON_FACES).reshape(-1, 3)
    if colors is None:
        from matplotlib import colormaps

        height = centers[:, 1]
        shade = (height - height.min()) / max(float(np.ptp(height)), 1e-9)
        # The lightest of viridis would be lost on white.
        colors = np.round(255 * colormaps["viridis"](0.85 * shade)).astype(np.uint8)
    return Mesh(vertices, faces, np.repeat(colors, len(_OCTAHEDRON_FACES), axis=0))


@torch.no_grad()
def reconstruction_figure(
    network: TemplateFfdNetwork,
    prepared: PreparedSet,
    bank: TemplateBank,
    rows: Sequence[int],
) -> NDArray[np.uint8]:
    """Draw a row per shape: input, selected template, deformed cloud, deformed mesh, truth.

    All are seen by the camera that took the input, and in its size. Below the deformed mesh: the
    Chamfer distance that training reports on its way (`template_scores`), of the cloud, x 1000.

    Args:
        network: put into evaluation mode here.
        prepared: where the shapes are.
        bank: the network's templates.
        rows: which shapes, by row of the prepared set.

    Returns:
        RGB image, (H, W, 3) uint8.
    """
    network.eval()
    device = next(network.parameters()).device
    inputs = np.stack([prepared.image(r)[..., :3] for r in rows])
    images = torch.from_numpy(inputs).permute(0, 3, 1, 2).to(device)
    prediction = network(images)
    selected = prediction.template_index.tolist()
    _, height, width, _ = prepared.image_shape

    cells: list[NDArray[np.uint8]] = []
    labels: list[str] = []
    for k, (row, t) in enumerate(zip(rows, selected, strict=True)):
        offsets = prediction.offsets[k, t].cpu()
        cloud = deform(bank.deformation_matrix[t], bank.control_points[t], offsets)
        truth = torch.from_numpy(prepared.cloud(row, len(cloud)))
        score = 1000 * float(chamfer_distance(cloud, truth, "mean"))
        meshes = (
            bank.meshes[t],
            cloud_mesh(cloud[:_CLOUD_POINTS].numpy()),
            bank.deformed_mesh(t, offsets),
            prepared.mesh(row),
        )
        cells.append(inputs[k])
        cells += [render(mesh, prepared.camera(row), height=height, width=width) for mesh in meshes]
        weight = float(prediction.template_weights[k, t])
        labels += [
            _in_lines(prepared.ids[row]),
            f"{_in_lines(bank.ids[t])}\nweight {weight:.2f}",
            "",
            f"box Chamfer x 1000: {score:.1f}",
            "",
        ]
    return contact_sheet(cells, len(_COLUMNS), labels, headings=_COLUMNS, font_size=_FONT)


def template_figure(bank: TemplateBank, notes: Sequence[str] | None = None) -> NDArray[np.uint8]:
    """Draw all templates, each with its number and id below it, and what else is to be said of it.

    Args:
        bank: T templates.
        notes: one line for each.

    Returns:
        RGB image, (H, W, 3) uint8.
    """
    height, width = _CELL
    cells = [render(mesh, height=height, width=width) for mesh in bank.meshes]
    labels = [_in_lines(shape_id, f"{t + 1}  ") for t, shape_id in enumerate(bank.ids)]
    if notes is not None:
        labels = [f"{label}\n{note}" for label, note in zip(labels, notes, strict=True)]
    columns = min(len(bank), 4 if len(bank) <= 16 else 6)
    return contact_sheet(cells, columns, labels, font_size=_FONT)


def _in_lines(shape_id: str, before: str = "") -> str:
    """Return an id in one line, or two: it is known by what is behind its category."""
    line = before + shape_id
    if text_width(line, _FONT) <= _CELL[1]:
        return line
    category, _, own = shape_id.rpartition("/")  # as it is where there are several categories
    return f"{before}{category}".rstrip() + f"\n{own}"
