"""Drawing what one visitor looks at in three dimensions: it moves, and can be pulled at."""

from collections.abc import Callable
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ffd_lightning.geometry.ffd import lattice_edges
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import CameraPose
from ffd_lightning.inference.pieces import MeshColors, Piece, pieces
from ffd_lightning.inference.viewer.state import State

SPACING = 1.05
"""Between shapes, which stand side by side, in template units."""

_COLORS = 16  # of a mesh; each is a mesh of its own for the browser
_POINT, _PULLED = (0, 114, 178), (213, 94, 0)  # control points
_KNOT = 0.011  # their size in template units
_BEFORE = 0.62  # a label is so far before its shape


class Scene:
    """Template, reconstruction and ground truth in a row.

    Args:
        scene: viser's, of one client.
        view: of the camera that the page begins with: the row runs across it.
        refresh: called when a control point was pulled; it must return at once.
    """

    def __init__(self, scene: Any, view: CameraPose, refresh: Callable[[], None]) -> None:
        self._scene, self._refresh = scene, refresh
        self._look(view)
        self._builds, self._root = 0, ""
        self._pulls: dict[int, NDArray[np.float64]] = {}
        self.drawn: tuple[Any, ...] = ()
        self.nodes: dict[str, Any] = {}
        self.moving: list[tuple[Any, Piece]] = []

    def _look(self, view: CameraPose) -> None:
        """Have the row run across a view."""
        self._aside, toward = view.right, -view.forward * [1, 0, 1]
        self._toward = toward / np.linalg.norm(toward)

    def pulls(self) -> dict[int, NDArray[np.float64]]:
        """Return where control points were pulled since the last call: (3,) by their index."""
        pulls = {}
        while self._pulls:  # the server's thread may add to them meanwhile
            index, place = self._pulls.popitem()
            pulls[index] = place
        return pulls

    def pull(self, index: int, place: NDArray[np.float64]) -> None:
        """Pull a control point to a place in the template's coordinates, (3,)."""
        self._pulls[index] = place
        self._refresh()

    def show(self, state: State, colors: MeshColors, lattice: bool) -> None:
        """Draw a state, perhaps with its control lattice; only what has changed is sent."""
        drawn = (state, state.template, colors)
        if drawn != self.drawn:
            self._build(state, colors)
            self.drawn = drawn
        vertices = state.surface().vertices.astype(np.float32)
        for node, piece in self.moving:
            node.vertices = vertices[piece.vertices]
        places, (cage, knots) = state.control_points, self._lattice
        cage.points = places[lattice_edges(state.display.degrees)]
        knots.batched_positions = places
        knots.batched_colors = _knot_colors(state)
        cage.visible = knots.visible = lattice

    def _build(self, state: State, colors: MeshColors) -> None:
        # A browser keeps the place of a node that is made again: each time all have other names.
        earlier = self.nodes.get("")
        self._builds += 1
        self._root = f"/scene-{self._builds}"
        self._pulls.clear()
        self.nodes = {"": self._scene.add_frame(self._root, show_axes=False)}
        if (camera := state.reconstruction.camera) is not None:
            self._look(camera.pose)
        surface = state.reconstruction.colored(colors, state.surface())
        floor = surface.vertices[:, 1].min()
        side = 0.55 if state.truth is None else 1.0
        column = side if state.truth is None else 0.0
        self._stand("template", state.template_surface(), -side, floor, colors)
        self.moving = self._stand("reconstruction", surface, column, floor, colors)
        self._add_lattice(state)
        if state.truth is not None:
            self._stand("ground truth", state.truth.mesh, side, floor, colors)
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
            position=(0, floor - 0.005, 0),
        )
        if earlier is not None:
            earlier.remove()

    def _stand(
        self, name: str, mesh: Mesh, column: float, floor: float, colors: MeshColors
    ) -> list[tuple[Any, Piece]]:
        """Put a mesh on the floor, with its name before it; return a node for each piece."""
        up = floor - mesh.vertices[:, 1].min()
        path, scene = f"{self._root}/{name}", self._scene
        place = column * SPACING * self._aside + [0.0, up, 0.0]
        self.nodes[name] = scene.add_frame(path, show_axes=False, position=place)
        before = np.array([0.0, floor - up, 0.0]) + _BEFORE * self._toward
        scene.add_label(f"{path}/label", name, position=before, anchor="center-center")
        nodes = []
        # Viser moves vertices of plain meshes only, so each small face has its texture's colour.
        split = pieces(mesh.without_textures(), colors, _COLORS, by_part=False)
        for k, piece in enumerate(split):
            opacity = piece.rgba[3] / 255
            node = scene.add_mesh_simple(
                f"{path}/{k}",
                mesh.vertices[piece.vertices],
                piece.faces,
                color=piece.rgba[:3],
                opacity=opacity if opacity < 1 else None,
                flat_shading=True,
                side="double",
                receive_shadow=False,  # so small, shapes would be streaked by shadows of their own
            )
            nodes.append((node, piece))
        return nodes

    def _add_lattice(self, state: State) -> None:
        """Add the lattice and its control points, which can be dragged."""
        path, scene, build = f"{self._root}/reconstruction", self._scene, self._builds
        offset = np.asarray(self.nodes["reconstruction"].position)
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_KNOT)
        places = state.control_points
        cage = scene.add_line_segments(
            f"{path}/cage",
            places[lattice_edges(state.display.degrees)],
            tuple((c + 255) // 2 for c in _POINT),
            thickness=1.2,
            thickness_units="screen",
        )
        knots = scene.add_batched_meshes_simple(
            f"{path}/handles",
            ball.vertices,
            ball.faces,
            batched_wxyzs=np.tile([1.0, 0, 0, 0], (len(places), 1)),
            batched_positions=places,
            batched_colors=_knot_colors(state),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        self._lattice = cage, knots

        # Asynchronous: called in the order of the events, and it must not compute anything.
        @knots.on_drag
        async def _(event: Any) -> None:
            if build == self._builds:  # else it is of what was drawn before
                self.pull(event.instance_index, np.asarray(event.end_position) - offset)


def _knot_colors(state: State) -> NDArray[np.uint8]:
    return np.where(state.edited[:, None], _PULLED, _POINT).astype(np.uint8)
