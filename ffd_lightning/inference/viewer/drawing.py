"""Meshes, clouds and labels as nodes of a browser's scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib import colormaps
from numpy.typing import ArrayLike, NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.inference.pieces import MeshColors, Piece, pieces

Rgb = tuple[int, int, int]

_COLORS = 16  # of a mesh; each is a mesh of its own for the browser
_GHOST = 90  # opacity, of 255, of what is laid over a reconstruction
_POINT = 0.008  # size in template units
_RING = 0.5  # radius, that of the sphere which a shape lies in


def rgb_of(color: str) -> Rgb:
    """Return the channels of #rrggbb.

    >>> rgb_of("#0072B2")
    (0, 114, 178)
    """
    red, green, blue = bytes.fromhex(color.lstrip("#"))
    return red, green, blue


class Drawing:
    """Draws below one node of a scene.

    Args:
        scene: viser's, of one client.
        root: name of the node, which is made.

    Attributes:
        nodes: what can be shown or hidden, by its name below the root.
    """

    def __init__(self, scene: Any, root: str) -> None:
        self.scene, self.root = scene, root
        self.nodes: dict[str, Any] = {"": scene.add_frame(root, show_axes=False)}

    def remove(self) -> None:
        """Take everything away."""
        self.nodes[""].remove()

    def path(self, name: str) -> str:
        """Return a node's name in the scene."""
        return f"{self.root}/{name}"

    def frame(self, name: str, position: ArrayLike = (0, 0, 0)) -> None:
        """Make a place for other nodes."""
        self.nodes[name] = self.scene.add_frame(
            self.path(name), show_axes=False, position=np.asarray(position, float)
        )

    def label(self, name: str, text: str, position: ArrayLike) -> None:
        """Write a line of text."""
        self.nodes[name] = self.scene.add_label(
            self.path(name), text, position=np.asarray(position, float), anchor="center-center"
        )

    def mesh(
        self, name: str, mesh: Mesh, colors: MeshColors, ghost: Rgb | None = None
    ) -> list[tuple[Any, Piece]]:
        """Draw a mesh, in its colours or see-through in one.

        Returns:
            A node for each piece: what moves the mesh moves their vertices.
        """
        if ghost:
            rgba = np.tile(np.array((*ghost, _GHOST), np.uint8), (len(mesh.faces), 1))
            mesh, colors = replace(mesh, face_colors=rgba), "material"
        nodes = []
        # Viser moves vertices of plain meshes only, so each small face has its texture's colour.
        split = pieces(mesh.without_textures(), colors, _COLORS, by_part=False)
        for k, piece in enumerate(split):
            opacity = piece.rgba[3] / 255
            node = self.scene.add_mesh_simple(
                self.path(f"{name}/{k}"),
                mesh.vertices[piece.vertices],
                piece.faces,
                color=piece.rgba[:3],
                opacity=opacity if opacity < 1 else None,
                flat_shading=True,
                side="double",
                cast_shadow=ghost is None,
                receive_shadow=False,  # so small, shapes would be streaked by shadows of their own
            )
            nodes.append((node, piece))
        return nodes

    def cloud(self, name: str, points: NDArray[np.float32]) -> None:
        """Draw points, coloured by their height."""
        height = points[:, 1]
        shade = (height - height.min()) / max(float(np.ptp(height)), 1e-9)
        self.nodes[name] = self.scene.add_point_cloud(
            self.path(name),
            points,
            np.round(255 * colormaps["viridis"](shade)[:, :3]).astype(np.uint8),
            point_size=_POINT,
            point_shape="circle",
        )

    def lines(
        self, name: str, segments: NDArray[np.floating], color: Sequence[int], thickness: float
    ) -> None:
        """Draw segments (n, 2, 3), as thick as so many pixels."""
        self.nodes[name] = self.scene.add_line_segments(
            self.path(name), segments, color, thickness=thickness, thickness_units="screen"
        )

    def ring(self, name: str, height: float, color: Rgb) -> None:
        """Draw a circle on the floor, to tell by its colour whose shape stands in it."""
        turn = np.linspace(0, 2 * np.pi, 65)
        circle = np.stack([_RING * np.sin(turn), np.full(65, height), _RING * np.cos(turn)], 1)
        self.lines(name, np.stack([circle[:-1], circle[1:]], 1), color, 3.0)

    def floor(self, height: float) -> None:
        """Draw the floor that shapes stand on, and the shadows on it."""
        self.scene.add_grid(
            self.path("floor"),
            plane="xz",
            infinite_grid=True,
            cell_size=0.1,
            section_size=1.0,
            cell_color=(228, 230, 234),
            section_color=(205, 208, 214),
            fade_distance=5.0,
            fade_from="origin",
            shadow_opacity=0.18,
            position=(0, height, 0),
        )
