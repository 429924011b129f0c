"""Drawing a session in three dimensions, for one visitor."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import trimesh
from matplotlib import colormaps
from numpy.typing import NDArray

from ffd_lightning.geometry.lattice import lattice_edges
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.inference.pieces import MeshColors, Piece, pieces
from ffd_lightning.inference.viewer.session import Session

SPACING = 1.05
"""Between shapes that stand side by side, in template units."""

_GREY, _BLUE, _RED, _ORANGE = (150, 150, 150), (70, 130, 220), (214, 39, 40), (255, 150, 0)
_WIRE = (232, 120, 118)
_PALETTE = 16  # colours of a mesh; each is a mesh of its own for the browser
_GHOST = 90  # opacity, of 255, of what is laid over the reconstruction
_KNOT, _GIZMO, _POINT = 0.011, 0.16, 0.008  # sizes in template units


@dataclass(frozen=True)
class DrawingOptions:
    """What is drawn, and how.

    Attributes:
        colors: what the colours of meshes say.
        beside: shapes stand side by side, not in one place.
        template: the template as it is.
        mesh, cloud: the reconstruction's.
        truth, truth_cloud: the ground truth's mesh and cloud.
        cage, first_cage: the control lattice, deformed and as it was.
        handles: the control points.
    """

    colors: MeshColors
    beside: bool
    template: bool
    mesh: bool
    cloud: bool
    truth: bool
    truth_cloud: bool
    cage: bool
    first_cage: bool
    handles: bool


def _lowest(mesh: Mesh) -> float:
    return float(mesh.vertices[:, 1].min())


class Stage:
    """The three-dimensional part of one visitor's page.

    Args:
        scene: viser's, of one client.
        aside: the direction in which shapes stand side by side, (3,).
        refresh: called when a control point was picked or pulled; it must return at once.
    """

    def __init__(self, scene: Any, aside: NDArray[np.float64], refresh: Callable[[], None]) -> None:
        self._scene, self._aside, self._refresh = scene, aside, refresh
        self._drawn: tuple[Any, ...] = ()
        self._picked: int | None = None
        self._held = False  # arrows that are being dragged must not be moved from here
        self._pulls: dict[int, NDArray[np.float64]] = {}
        self._root, self._builds = "", 0
        self._nodes: dict[str, Any] = {}
        self._moving: list[tuple[Any, Piece]] = []

    def pulls(self) -> dict[int, NDArray[np.float64]]:
        """Return where control points were pulled since the last call: (3,) by their index."""
        pulls, self._pulls = self._pulls, {}
        return pulls

    def show(self, session: Session, options: DrawingOptions) -> None:
        """Draw a session; only what has changed is sent."""
        drawn = (session, session.template, options.colors, options.beside)
        if drawn != self._drawn:
            self._build(session, options)
            self._drawn = drawn
        self._update(session, options)
        self._toggle(session, options)
        gizmo = self._nodes["gizmo"]
        gizmo.visible = options.handles and self._picked is not None
        if self._picked is not None and not self._held:
            gizmo.position = session.control_points[self._picked].astype(float)

    def _build(self, session: Session, options: DrawingOptions) -> None:
        # A browser keeps the place of a node that is made again: each time all have other names.
        earlier, self._builds = self._nodes.get("root"), self._builds + 1
        self._root, self._nodes, self._picked = f"/scene-{self._builds}", {}, None
        self._nodes["root"] = self._scene.add_frame(self._root, show_axes=False)
        resting, surface = session.template_surface(), session.surface()
        ghosts = (None, None) if options.beside else (_GREY, _BLUE)
        floor = _lowest(surface)

        def place(mesh: Mesh, side: int) -> NDArray[np.float64]:
            """Return where a shape stands: beside the reconstruction, on the same floor."""
            up = np.array([0.0, floor - _lowest(mesh), 0.0])
            return side * SPACING * self._aside + up if options.beside else np.zeros(3)

        self._frame("template", place(resting, -1), "template")
        self._mesh("template/mesh", resting, options.colors, ghosts[0])
        self._frame("shown", np.zeros(3), "reconstruction")
        self._frame("shown/mesh")
        self._moving = self._mesh("shown/mesh/surface", surface, options.colors)
        self._cloud("shown/cloud", session.points())
        self._cages(session)
        truth = session.truth
        if truth is not None:
            self._frame("truth", place(truth.mesh, 1), "ground truth")
            self._frame("truth/mesh")
            self._mesh("truth/mesh/surface", truth.mesh, options.colors, ghosts[1])
            self._cloud("truth/cloud", truth.points)
        self._floor(floor - 0.005)
        if earlier is not None:
            earlier.remove()

    def _frame(self, name: str, position: Any = (0, 0, 0), label: str = "") -> None:
        self._nodes[name] = self._scene.add_frame(
            f"{self._root}/{name}", show_axes=False, position=position
        )
        if label:
            self._nodes[f"{name}/label"] = self._scene.add_label(
                f"{self._root}/{name}/label",
                label,
                position=(0, 0.62 - float(position[1]), 0),  # all at one height
                anchor="center-center",
            )

    def _mesh(
        self, name: str, mesh: Mesh, colors: MeshColors, ghost: tuple[int, ...] | None = None
    ) -> list[tuple[Any, Piece]]:
        if ghost:
            rgba = np.tile(np.array((*ghost, _GHOST), np.uint8), (len(mesh.faces), 1))
            mesh, colors = replace(mesh, face_colors=rgba), "material"
        nodes = []
        # Viser moves vertices of plain meshes only, so each small face has its texture's colour.
        split = pieces(mesh.without_textures(), colors, _PALETTE, by_part=False)
        for k, piece in enumerate(split):
            opacity = piece.rgba[3] / 255
            node = self._scene.add_mesh_simple(
                f"{self._root}/{name}/{k}",
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

    def _cloud(self, name: str, points: NDArray[np.float32]) -> None:
        height = points[:, 1]
        shade = (height - height.min()) / max(float(np.ptp(height)), 1e-9)
        self._nodes[name] = self._scene.add_point_cloud(
            f"{self._root}/{name}",
            points,
            np.round(255 * colormaps["viridis"](shade)[:, :3]).astype(np.uint8),
            point_size=_POINT,
            point_shape="circle",
        )

    def _cages(self, session: Session) -> None:
        self._edges = lattice_edges(session.display.degrees)
        for name, points, color in (
            ("shown/first_cage", session.rest, _GREY),
            ("shown/cage", session.control_points, _WIRE),
        ):
            self._nodes[name] = self._scene.add_line_segments(
                f"{self._root}/{name}",
                points[self._edges],
                color,
                thickness=1.2,
                thickness_units="screen",
            )
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_KNOT)
        places = session.control_points
        knots = self._scene.add_batched_meshes_simple(
            f"{self._root}/shown/handles",
            ball.vertices,
            ball.faces,
            batched_wxyzs=np.tile([1.0, 0, 0, 0], (len(places), 1)),
            batched_positions=places,
            batched_colors=self._knot_colors(session),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        gizmo = self._scene.add_transform_controls(
            f"{self._root}/shown/gizmo",
            _GIZMO,
            disable_rotations=True,
            depth_test=False,
            visible=False,
        )
        self._nodes["handles"], self._nodes["gizmo"] = knots, gizmo
        knots.on_click(self._on_click)
        knots.on_drag(self._on_drag)
        gizmo.on_update(self._on_gizmo)

    def _floor(self, height: float) -> None:
        self._scene.add_grid(
            f"{self._root}/floor",
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

    def _update(self, session: Session, options: DrawingOptions) -> None:
        """Move what moves."""
        vertices = session.surface().vertices.astype(np.float32)
        for node, piece in self._moving:
            node.vertices = vertices[piece.vertices]
        if options.cloud:
            self._nodes["shown/cloud"].points = session.points().astype(np.float16)
        places = session.control_points
        self._nodes["shown/cage"].points = places[self._edges]
        knots = self._nodes["handles"]
        knots.batched_positions = places
        knots.batched_colors = self._knot_colors(session)

    def _toggle(self, session: Session, options: DrawingOptions) -> None:
        visible = {
            "template": options.template,
            "shown/mesh": options.mesh,
            "shown/cloud": options.cloud,
            "shown/cage": options.cage,
            "shown/first_cage": options.first_cage,
            "handles": options.handles,
            "template/label": options.beside,
            "shown/label": options.beside,
        }
        if session.truth is not None:
            visible["truth"] = options.truth or options.truth_cloud
            visible["truth/mesh"], visible["truth/cloud"] = options.truth, options.truth_cloud
            visible["truth/label"] = options.beside
        for name, on in visible.items():
            self._nodes[name].visible = on

    def _knot_colors(self, session: Session) -> NDArray[np.uint8]:
        colors = np.where(session.edited[:, None], _ORANGE, _RED).astype(np.uint8)
        if self._picked is not None:
            colors[self._picked] = _BLUE
        return colors

    # Asynchronous: called in the order of the events, and they must not compute anything.
    async def _on_click(self, event: Any) -> None:
        self._picked = event.instance_index
        self._refresh()

    async def _on_drag(self, event: Any) -> None:
        self._picked = event.instance_index
        self._pulls[event.instance_index] = np.asarray(event.end_position)
        self._refresh()

    async def _on_gizmo(self, event: Any) -> None:
        self._held = event.phase != "end"
        if self._picked is not None:
            self._pulls[self._picked] = np.asarray(event.target.position)
            self._refresh()
