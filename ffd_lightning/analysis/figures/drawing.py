"""What the paper's figures are drawn with: voxels and edges as meshes, one scale for a row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render
from ffd_lightning.imaging.sheet import Line, Picture, Sheet, text_width

Color = tuple[int, int, int]
"""sRGB, 0 to 255."""

_MARGIN = 0.97  # of the way from the middle of an image to its border
_SEAM = 0.07  # of a voxel's side: the darker rim that tells it from its neighbours
_SEAM_SHADE = 0.55
_RIM_WIDTH = 0.05  # of a triangle's height
_TEXELS = 64

# A face of a voxel: corners 0 to 3 around it, 4 to 7 around what its rim leaves. Two triangles fill
# the middle, eight the rim.
_MIDDLE = [[4, 5, 6], [4, 6, 7]]
_RIM = [[k, (k + 1) % 4, 4 + k] for k in range(4)]
_RIM += [[4 + k, (k + 1) % 4, 4 + (k + 1) % 4] for k in range(4)]
_SIDES = [[k, (k + 1) % 3, 3 + k] for k in range(3)]  # of a bar: corners 0 to 2, then 3 to 5
_SIDES += [[3 + k, (k + 1) % 3, 3 + (k + 1) % 3] for k in range(3)]


@dataclass(frozen=True)
class View:
    """From where shapes are seen, and how large.

    Attributes:
        camera: that sees them.
        height, width: pixels.
    """

    camera: Camera
    height: int
    width: int


def draw_row(
    meshes: Sequence[Mesh], view: View, cameras: Sequence[Camera] | None = None
) -> list[Picture]:
    """Render shapes at one scale: that of the input image, or less where one would be cut off.

    Args:
        meshes: in the frame of prepared shapes.
        view: camera and size.
        cameras: of each shape, where it is not the view's.
    """
    views = [replace(view, camera=c) for c in cameras or [view.camera] * len(meshes)]
    scale = min(
        fitting_scale(mesh.used_vertices(), seen) for mesh, seen in zip(meshes, views, strict=True)
    )
    return [draw(m, seen, scale)[..., :3] for m, seen in zip(meshes, views, strict=True)]


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


def painted(surface: tuple[NDArray[np.float64], NDArray[np.int64]], color: Color) -> Mesh:
    """Return a surface, vertices (V, 3) and faces (F, 3), all of one colour."""
    vertices, faces = surface
    return Mesh(vertices, faces, rgba([color] * len(faces)))


def rgba(colors: Sequence[Color] | NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return colours, (n, 3), as opaque ones, (n, 4) uint8."""
    plain = np.asarray(colors, np.uint8).reshape(-1, 3)
    return np.insert(plain, 3, 255, axis=1)


def with_bars(mesh: Mesh, radius: float, color: Color) -> Mesh:
    """Return a mesh with its edges as thin three-sided bars, all equally thick.

    Args:
        mesh: without textures; an edge that faces share has one bar, one without length none.
        radius: of a bar, from the edge to its corners.
        color: of the bars.
    """
    pairs = np.sort(mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    return joined([mesh, bars(mesh.vertices[np.unique(pairs, axis=0)], radius, color)])


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
    faces = (6 * np.arange(len(ends))[:, None, None] + np.array(_SIDES)).reshape(-1, 3)
    return painted((corners, faces), color)


def joined(meshes: Sequence[Mesh]) -> Mesh:
    """Return meshes without textures as one."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + k for mesh, k in zip(meshes, first, strict=True)]),
        np.concatenate([mesh.face_colors for mesh in meshes]),
    )


def with_rims(mesh: Mesh, color: Color) -> Mesh:
    """Return a mesh whose faces, all of one colour, have a rim of another.

    A rim is as wide as its face allows, so that many and thin faces don't turn black, and costs no
    triangle: it is a texture.
    """
    u, v = np.meshgrid((np.arange(_TEXELS) + 0.5) / _TEXELS, (np.arange(_TEXELS) + 0.5) / _TEXELS)
    on_rim = np.minimum(np.minimum(u, v), 1 - u - v) < _RIM_WIDTH
    fill = mesh.face_colors[0] if len(mesh.faces) else rgba([color])[0]
    picture = np.where(on_rim[::-1, :, None], rgba([color]), fill).astype(np.uint8)
    corners = np.array([[0, 0], [1, 0], [0, 1]], np.float32)
    return replace(
        mesh,
        textures=(picture,),
        face_textures=np.zeros(len(mesh.faces), np.int16),
        face_uvs=np.broadcast_to(corners, (len(mesh.faces), 3, 2)).copy(),
    )


def voxel_mesh(
    kinds: NDArray[np.integer], colors: Sequence[Color], low: float = -0.5, high: float = 0.5
) -> Mesh:
    """Turn voxels into cubes; of these only faces that touch no other voxel, with a darker rim.

    Args:
        kinds: (R, R, R) indexed [x, y, z]: 0 for an empty voxel, k for one of the k-th colour.
        colors: of the kinds from 1 on.
        low: lower end of the grid along each axis.
        high: upper end.

    Returns:
        10 triangles for each face that can be seen, 2 of them of the colour itself.
    """
    filled = kinds > 0
    padded = np.pad(filled, 1)
    around = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    corners, found = [np.zeros((0, 8, 3))], [np.zeros(0, np.int64)]
    for axis in range(3):
        for side in (0, 1):
            beside = np.roll(padded, 1 - 2 * side, axis)[1:-1, 1:-1, 1:-1]
            cells = np.argwhere(filled & ~beside)
            square = np.full((8, 3), float(side))
            others = [k for k in range(3) if k != axis]
            square[:, others] = np.concatenate([around, _SEAM + (1 - 2 * _SEAM) * around])
            corners.append(cells[:, None] + square)
            found.append(kinds[tuple(cells.T)].astype(np.int64))
    squares, kind = np.concatenate(corners), np.concatenate(found)
    vertices = low + (high - low) / len(kinds) * squares.reshape(-1, 3)
    faces = (8 * np.arange(len(squares))[:, None, None] + np.array(_MIDDLE + _RIM)).reshape(-1, 3)
    shade = np.repeat([1.0, _SEAM_SHADE], [len(_MIDDLE), len(_RIM)])
    tones = np.asarray(colors, float)[kind - 1][:, None] * shade[:, None]
    return Mesh(vertices, faces, rgba(np.round(tones).astype(np.uint8)))


def legend(entries: Sequence[tuple[str, Color]], width: int, font_size: int) -> Sheet:
    """Lay out words with a square of their colour before each, in as many lines as it takes.

    Args:
        entries: words and their colours.
        width: of the sheet, in pixels.
        font_size: in pixels.
    """
    line, margin = 2 * font_size, font_size // 2
    squares: list[tuple[Picture, int, int]] = []
    words: list[Line] = []
    x, y = margin, margin
    for text, color in entries:
        length = round(text_width(text, font_size)) + 3 * font_size
        if x > margin and x + length > width:
            x, y = margin, y + line
        square = np.full((font_size, font_size, 3), color, np.uint8)
        squares.append((square, x, y))
        words.append(Line(text, x + 1.5 * font_size, y + font_size / 2, font_size))
        x += length
    return Sheet(y + line, width, tuple(squares), tuple(words))
