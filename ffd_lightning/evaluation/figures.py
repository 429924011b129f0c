"""Pictures of reconstructions and templates, drawn with the project's own renderer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import Degrees, deform, lattice_edges
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.grid import Color, Picture, grid, text_width
from ffd_lightning.imaging.rendering import render
from ffd_lightning.nn.network import TemplateFfdNetwork

_CLOUD_POINTS = 2048
_CELL = (192, 256)  # pixels, of a template
_FONT = 12
_COLUMNS = ("input", "template", "deformed cloud", "deformed mesh", "ground truth")
_MARGIN = 0.97  # of the way from the middle of an image to its border
_OCTAHEDRON = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1.0]])
_OCTAHEDRON_FACES = np.array(
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]
)
_BAR = [[k, (k + 1) % 3, 3 + k] for k in range(3)]  # corners 0 to 2, then 3 to 5
_BAR += [[3 + k, (k + 1) % 3, 3 + (k + 1) % 3] for k in range(3)]
_LATTICE, _POINT = (110, 116, 132), (30, 34, 46)
_LINE_RADIUS, _POINT_RADIUS = 0.0035, 0.011


@dataclass(frozen=True)
class View:
    """A camera, and the size of its pictures in pixels."""

    camera: Camera
    height: int
    width: int

    @classmethod
    def of(cls, prepared: PreparedSet, sample: Sample, width: int | None = None) -> View:
        """Return that of a prepared image, for pictures of its own width or another."""
        _, rows, columns, _ = prepared.image_shape
        width = width or columns
        return cls(prepared.camera(*sample), round(width * rows / columns), width)


def reconstruction_row(
    image: Picture, meshes: Sequence[Mesh], view: View, cameras: Sequence[Camera] | None = None
) -> list[Picture]:
    """Draw an input image, of any size, and shapes beside it, as its camera or their own sees them.

    Meshes are in the frame of prepared shapes. All are drawn at one scale: that of the image, or
    less where one would be cut off.
    """
    views = [replace(view, camera=c) for c in cameras or [view.camera] * len(meshes)]
    pairs = list(zip(meshes, views, strict=True))
    scale = min(fitting_scale(mesh.used_vertices(), seen) for mesh, seen in pairs)
    size = view.width, view.height
    seen = Image.fromarray(image[..., :3]).resize(size, Image.Resampling.LANCZOS)
    return [np.asarray(seen), *(draw(mesh, own, scale)[..., :3] for mesh, own in pairs)]


def draw(mesh: Mesh, view: View, scale: float) -> Picture:
    """Render a shape shrunk about the origin, (height, width, 4)."""
    shrunk = mesh.with_vertices(scale * mesh.vertices)
    return render(shrunk, view.camera, height=view.height, width=view.width)


def fitting_scale(points: NDArray[np.float64], view: View) -> float:
    """Return by how much points, (N, 3), must shrink about the origin to be seen whole.

    As much as by a camera that steps back: 1 where all are in the image, with a little margin.
    """
    frame = view.camera.pose
    across = np.stack([frame.right, frame.up], axis=1)
    slope = _MARGIN * view.camera.half_height * np.array([view.width / view.height, 1.0])
    # Shrunk by s, a point x off the origin to the side and z nearer is seen at the slope
    # (s x + off) / (depth - s z), where off and depth are the origin's: at most `slope` where
    # s (x + slope z) <= slope depth - off.
    room = slope * -(frame.position @ frame.forward) - np.abs(frame.position @ across)
    reach = np.abs(points @ across) - slope * (points @ frame.forward)[:, None]
    return float((room / np.maximum(reach, room)).min(initial=1.0))


def cloud_mesh(
    points: ArrayLike, radius: float = 0.006, colors: NDArray[np.uint8] | None = None
) -> Mesh:
    """Turn a cloud, (N, 3), into small octahedra, so that it can be rendered.

    Its points have colors, (N, 4) uint8 RGBA, or are coloured by height.
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


def painted(surface: tuple[NDArray[np.float64], NDArray[np.int64]], color: Color) -> Mesh:
    """Return a surface, vertices (V, 3) and faces (F, 3), all of one colour."""
    vertices, faces = surface
    return Mesh(vertices, faces, rgba([color] * len(faces)))


def rgba(colors: Sequence[Color] | NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return colours, (n, 3), as opaque ones, (n, 4) uint8."""
    plain = np.asarray(colors, np.uint8).reshape(-1, 3)
    return np.insert(plain, 3, 255, axis=1)


def united(meshes: Sequence[Mesh]) -> Mesh:
    """Return meshes without textures as one."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + k for mesh, k in zip(meshes, first, strict=True)]),
        np.concatenate([mesh.face_colors for mesh in meshes]),
    )


def bars(ends: NDArray[np.float64], radius: float, color: Color) -> Mesh:
    """Return straight lines as thin three-sided bars, all equally thick.

    Args:
        ends: of the lines, (n, 2, 3); a line without length has no bar.
        radius: of a bar, from its middle to its corners.
        color: of the bars.
    """
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    ends, along = ends[length > 0], along[length > 0] / length[length > 0, None]
    # Crossed with the axis that is least along the edge, so that the product is never near zero.
    across = np.cross(along, np.eye(3)[np.abs(along).argmin(axis=1)])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    turns = 2 * np.pi / 3 * np.arange(3)[:, None]
    ring = np.cos(turns) * across[:, None] + np.sin(turns) * np.cross(along, across)[:, None]
    corners = (ends[:, :, None] + radius * ring[:, None]).reshape(-1, 3)
    faces = (6 * np.arange(len(ends))[:, None, None] + np.array(_BAR)).reshape(-1, 3)
    return painted((corners, faces), color)


def lattice_mesh(points: NDArray[np.float64], degrees: Degrees) -> Mesh:
    """Return control points, (M, 3), as dots, and lines between neighbours."""
    dots = cloud_mesh(points, _POINT_RADIUS, rgba([_POINT] * len(points)))
    return united([dots, bars(points[lattice_edges(degrees)], _LINE_RADIUS, _LATTICE)])


def reconstruction_figure(
    network: TemplateFfdNetwork, prepared: PreparedSet, bank: TemplateBank, rows: Sequence[int]
) -> Image.Image:
    """Draw a row per shape: input, selected template, deformed cloud, deformed mesh, truth.

    Below the deformed mesh: the Chamfer distance that training reports on its way
    (`template_scores`), of the cloud, x 1000. The network is put into evaluation mode.
    """
    samples = [Sample(row) for row in rows]
    prediction = predict(network, prepared, samples)
    cells: list[Picture] = []
    labels: list[str] = []
    for k, sample in enumerate(samples):
        t = int(prediction.selected[k])
        offsets = torch.from_numpy(prediction.offsets[k, t])
        cloud = deform(bank.deformation_matrix[t], bank.control_points[t], offsets)
        truth = torch.from_numpy(prepared.cloud(sample.row, len(cloud)))
        score = 1000 * float(chamfer_distance(cloud, truth, "mean"))
        meshes = (
            bank.meshes[t],
            cloud_mesh(cloud[:_CLOUD_POINTS].numpy()),
            bank.deformed_mesh(t, offsets),
            prepared.mesh(sample.row),
        )
        cells += reconstruction_row(prepared.image(*sample), meshes, View.of(prepared, sample))
        below = f"{_in_lines(bank.ids[t])}\nweight {prediction.weights[k, t]:.2f}"
        name = _in_lines(prepared.ids[sample.row])
        labels += [name, below, "", f"box Chamfer x 1000: {score:.1f}", ""]
    return grid(cells, len(_COLUMNS), labels, _COLUMNS, _FONT)


def template_figure(bank: TemplateBank, notes: Sequence[str] | None = None) -> Image.Image:
    """Draw all templates, each with its number and id below it, and a note of one line, if any."""
    height, width = _CELL
    cells = [render(mesh, height=height, width=width) for mesh in bank.meshes]
    labels = [_in_lines(shape_id, f"{t + 1}  ") for t, shape_id in enumerate(bank.ids)]
    if notes is not None:
        labels = [f"{label}\n{note}" for label, note in zip(labels, notes, strict=True)]
    return grid(cells, 4 if len(bank) <= 16 else 6, labels, font_size=_FONT)


def _in_lines(shape_id: str, before: str = "") -> str:
    """Return an id in one line, or two: it is known by what is behind its category."""
    line = before + shape_id
    if text_width(line, _FONT) <= _CELL[1]:
        return line
    category, _, own = shape_id.rpartition("/")  # as it is where there are several categories
    return f"{before}{category}".rstrip() + f"\n{own}"
