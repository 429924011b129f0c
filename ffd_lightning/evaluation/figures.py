"""Pictures of reconstructions, drawn with the project's own renderer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from matplotlib import colormaps
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.config import RenderConfig
from ffd_lightning.data.mesh import Mesh
from ffd_lightning.data.prepared import PreparedSet
from ffd_lightning.data.rendering import contact_sheet, render
from ffd_lightning.data.templates import TemplateBank
from ffd_lightning.geometry.deformation import deform
from ffd_lightning.nn.network import TemplateFfdNetwork

_CLOUD_POINTS = 2048
_POINT_RADIUS = 0.006
_OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
_OCTAHEDRON_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
)


def cloud_mesh(points: ArrayLike, radius: float = _POINT_RADIUS) -> Mesh:
    """Turn a cloud (N, 3) into small octahedra coloured by height, so that it can be rendered."""
    centers = np.asarray(points, float)
    vertices = (centers[:, None] + radius * _OCTAHEDRON).reshape(-1, 3)
    faces = (6 * np.arange(len(centers))[:, None, None] + _OCTAHEDRON_FACES).reshape(-1, 3)
    height = centers[:, 1]
    shade = (height - height.min()) / max(float(np.ptp(height)), 1e-9)
    colors = np.round(255 * colormaps["viridis"](shade)).astype(np.uint8)
    return Mesh(vertices, faces, np.repeat(colors, len(_OCTAHEDRON_FACES), axis=0))


@torch.no_grad()
def reconstruction_figure(
    network: TemplateFfdNetwork,
    prepared: PreparedSet,
    bank: TemplateBank,
    rows: Sequence[int],
    view: RenderConfig,
) -> NDArray[np.uint8]:
    """Draw a row per model: input, selected template, deformed cloud, deformed mesh, truth.

    Args:
        network: put into evaluation mode here.
        prepared: where the models are.
        bank: the network's templates.
        rows: which models, by row of the prepared set.
        view: camera and size; the input's own first view.

    Returns:
        RGB image, (H, W, 3) uint8.
    """
    network.eval()
    device = next(network.parameters()).device
    inputs = np.stack([prepared.image(r)[..., :3] for r in rows])
    images = torch.from_numpy(inputs).permute(0, 3, 1, 2).to(device)
    prediction = network(images)
    selected = prediction.template_index.tolist()

    def draw(mesh: Mesh) -> NDArray[np.uint8]:
        return render(
            mesh,
            height=view.height,
            width=view.width,
            elevation=view.elevation,
            azimuth=view.azimuths[0],
            samples=2,
        )

    cells: list[NDArray[np.uint8]] = []
    labels: list[str] = []
    for k, (row, t) in enumerate(zip(rows, selected, strict=True)):
        offsets = prediction.offsets[k, t].cpu()
        cloud = deform(bank.deformation_matrix[t, :_CLOUD_POINTS], bank.control_points[t], offsets)
        cells += [
            inputs[k],
            draw(bank.meshes[t]),
            draw(cloud_mesh(cloud.numpy())),
            draw(bank.deformed_mesh(t, offsets)),
            draw(prepared.mesh(row)),
        ]
        weight = float(prediction.template_weights[k, t])
        labels += [
            f"input {prepared.ids[row]}",
            f"template {bank.ids[t]} ({weight:.2f})",
            "deformed cloud",
            "deformed mesh",
            "ground truth",
        ]
    return contact_sheet(cells, columns=5, labels=labels)
