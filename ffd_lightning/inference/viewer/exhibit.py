"""The reconstruction of one network in the scene: it moves, and can be pulled at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray

from ffd_lightning.geometry.lattice import lattice_edges
from ffd_lightning.inference.pieces import MeshColors
from ffd_lightning.inference.viewer.drawing import Drawing, Rgb, rgb_of
from ffd_lightning.inference.viewer.session import Session
from ffd_lightning.palette import COLORS

GREY: Rgb = (150, 150, 150)
_PULLED, _PICKED = rgb_of(COLORS[-2]), rgb_of(COLORS[-1])  # those of no regime
_KNOT, _GIZMO = 0.011, 0.16  # sizes in template units


@dataclass(frozen=True)
class DrawingOptions:
    """What is drawn, and how.

    Attributes:
        colors: what the colours of meshes say.
        beside: shapes stand beside one another, not in one place.
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


class Exhibit:
    """A session's mesh, cloud, lattice and control points.

    Args:
        drawing: where they are drawn.
        name: of their node.
        session: what is drawn.
        place: of the template's origin, (3,).
        colors: what the colours of the mesh say.
        refresh: called when a control point was picked or pulled; it must return at once.
    """

    def __init__(
        self,
        drawing: Drawing,
        name: str,
        session: Session,
        place: NDArray[np.float64],
        colors: MeshColors,
        refresh: Callable[[], None],
    ) -> None:
        self._drawing, self._name, self._place = drawing, name, place
        self._refresh, self._color = refresh, rgb_of(session.title.color)
        self.picked: int | None = None
        self._held = False  # arrows that are being dragged must not be moved from here
        self._pulls: dict[int, NDArray[np.float64]] = {}
        drawing.frame(name, place)
        drawing.frame(f"{name}/mesh")
        self.moving = drawing.mesh(f"{name}/mesh/surface", session.surface(), colors)
        drawing.cloud(f"{name}/cloud", session.points())
        self._edges = lattice_edges(session.display.degrees)
        for lattice, points, color in (
            ("first_cage", session.rest, GREY),
            ("cage", session.control_points, tuple((c + 255) // 2 for c in self._color)),
        ):
            drawing.lines(f"{name}/{lattice}", points[self._edges], color, 1.2)
        self._knots, self._gizmo = self._add_handles(session)

    def pulls(self) -> dict[int, NDArray[np.float64]]:
        """Return where control points were pulled since the last call: (3,) by their index."""
        pulls = {}
        while self._pulls:  # the server's thread may add to them meanwhile
            index, place = self._pulls.popitem()
            pulls[index] = place
        return pulls

    def pull(self, index: int, place: NDArray[np.float64]) -> None:
        """Pick a control point and pull it to a place in the exhibit, (3,)."""
        self.picked, self._pulls[index] = index, place
        self._refresh()

    def update(self, session: Session, options: DrawingOptions) -> None:
        """Move what moves, and show what is to be seen."""
        nodes, name = self._drawing.nodes, self._name
        vertices = session.surface().vertices.astype(np.float32)
        for node, piece in self.moving:
            node.vertices = vertices[piece.vertices]
        if options.cloud:
            nodes[f"{name}/cloud"].points = session.points().astype(np.float16)
        places = session.control_points
        nodes[f"{name}/cage"].points = places[self._edges]
        self._knots.batched_positions = places
        self._knots.batched_colors = self._knot_colors(session)
        for part in ("mesh", "cloud", "cage", "first_cage"):
            nodes[f"{name}/{part}"].visible = getattr(options, part)
        self._knots.visible = options.handles
        self._gizmo.visible = options.handles and self.picked is not None
        if self.picked is not None and not self._held:
            self._gizmo.position = places[self.picked].astype(float)

    def _add_handles(self, session: Session) -> tuple[Any, Any]:
        """Return the control points, and the arrows of the one that is picked."""
        scene, path = self._drawing.scene, self._drawing.path(self._name)
        ball = trimesh.creation.icosphere(subdivisions=2, radius=_KNOT)
        places = session.control_points
        knots = scene.add_batched_meshes_simple(
            f"{path}/handles",
            ball.vertices,
            ball.faces,
            batched_wxyzs=np.tile([1.0, 0, 0, 0], (len(places), 1)),
            batched_positions=places,
            batched_colors=self._knot_colors(session),
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
        )
        gizmo = scene.add_transform_controls(
            f"{path}/gizmo", _GIZMO, disable_rotations=True, depth_test=False, visible=False
        )
        knots.on_click(self._on_click)
        knots.on_drag(self._on_drag)
        gizmo.on_update(self._on_gizmo)
        return knots, gizmo

    def _knot_colors(self, session: Session) -> NDArray[np.uint8]:
        colors = np.where(session.edited[:, None], _PULLED, self._color).astype(np.uint8)
        if self.picked is not None:
            colors[self.picked] = _PICKED
        return colors

    # Asynchronous: called in the order of the events, and they must not compute anything.
    async def _on_click(self, event: Any) -> None:
        self.picked = event.instance_index
        self._refresh()

    async def _on_drag(self, event: Any) -> None:
        # The scene's coordinates, where the arrows' are the exhibit's own.
        self.pull(event.instance_index, np.asarray(event.end_position) - self._place)

    async def _on_gizmo(self, event: Any) -> None:
        self._held = event.phase != "end"
        if self.picked is not None:
            self.pull(self.picked, np.asarray(event.target.position))
