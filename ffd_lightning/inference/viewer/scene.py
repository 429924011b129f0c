"""Drawing what one visitor looks at in three dimensions, of one network or of two."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import CameraFrame
from ffd_lightning.inference.viewer.drawing import Drawing, rgb_of
from ffd_lightning.inference.viewer.exhibit import GREY, DrawingOptions, Exhibit
from ffd_lightning.inference.viewer.session import Session
from ffd_lightning.palette import COLORS

SPACING = 1.05
"""Between shapes that stand side by side, in template units."""
ROWS = 1.5
"""Between the reconstructions of two networks and their templates behind them."""

_TRUTH = rgb_of(COLORS[-1])  # laid over a reconstruction
_BEFORE, _OVER = 0.62, 0.28  # a label is so far before its shape, or over it


class Layout(NamedTuple):
    """Where shapes stand, each (columns to the right, rows to the back).

    Attributes:
        templates: of each network.
        shown: the reconstruction of each network.
        truths: copies of the ground truth.
    """

    templates: tuple[tuple[float, float], ...]
    shown: tuple[tuple[float, float], ...]
    truths: tuple[tuple[float, float], ...]


def layout(networks: int, truth: bool, beside: bool) -> Layout:
    """Return where shapes stand.

    One network's stand in a row: template, reconstruction, ground truth. The reconstructions of two
    stand in one row with the ground truth between them, and each template behind its own. Shapes
    that are laid over one another are so for each network.

    Args:
        networks: 1 or 2.
        truth: whether the ground truth is known.
        beside: whether shapes stand beside one another.

    >>> layout(1, True, True).truths
    ((1.0, 0.0),)
    """
    one: tuple[tuple[float, float], ...]
    if networks == 1:
        one = ((0.0, 0.0),)
        if not beside:
            return Layout(one, one, one if truth else ())
        if not truth:
            return Layout(((-0.55, 0.0),), ((0.55, 0.0),), ())
        return Layout(((-1.0, 0.0),), one, ((1.0, 0.0),))
    side = 1.0 if truth and beside else 0.6
    one = ((-side, 0.0), (side, 0.0))
    if not beside:
        return Layout(one, one, one if truth else ())
    front, back = (tuple((x, y) for x, _ in one) for y in (-0.5, 0.5))
    return Layout(back, front, ((0.0, -0.5),) if truth else ())


def _lowest(mesh: Mesh) -> float:
    return float(mesh.vertices[:, 1].min())


class Stage:
    """The three-dimensional part of one visitor's page.

    Args:
        scene: viser's, of one client.
        view: the camera that the page begins with: rows run across it.
        refresh: called when a control point was picked or pulled; it must return at once.
    """

    def __init__(self, scene: Any, view: CameraFrame, refresh: Callable[[], None]) -> None:
        self._scene, self._refresh = scene, refresh
        self._aside, back = view.right, view.forward * [1, 0, 1]
        self._back = back / np.linalg.norm(back)
        self._drawn: tuple[Any, ...] = ()
        self._builds = 0
        self.drawing: Drawing | None = None
        self.exhibits: list[Exhibit] = []

    def pulls(self) -> list[dict[int, NDArray[np.float64]]]:
        """Return where each exhibit's control points were pulled; see `Exhibit.pulls`."""
        return [exhibit.pulls() for exhibit in self.exhibits]

    def show(
        self, sessions: Sequence[Session], options: DrawingOptions, labels: Sequence[str]
    ) -> None:
        """Draw the session of each network; only what has changed is sent.

        Args:
            sessions: of the same input.
            options: what is drawn.
            labels: of the reconstructions.
        """
        templates = [session.template for session in sessions]
        drawn = (*sessions, *templates, options.colors, options.beside)
        if drawn != self._drawn:
            self._build(sessions, options)
            self._drawn = drawn
        assert self.drawing is not None
        for k, (exhibit, session) in enumerate(zip(self.exhibits, sessions, strict=True)):
            exhibit.update(session, options)
            self.drawing.nodes[f"shown-{k}/label"].text = labels[k]
        self._toggle(options)

    def _build(self, sessions: Sequence[Session], options: DrawingOptions) -> None:
        # A browser keeps the place of a node that is made again: each time all have other names.
        earlier, self._builds = self.drawing, self._builds + 1
        self.drawing = drawing = Drawing(self._scene, f"/scene-{self._builds}")
        truth = sessions[0].truth
        spots = layout(len(sessions), truth is not None, options.beside)
        floor = _lowest(sessions[0].surface())
        ghosts = (None, None) if options.beside else (GREY, _TRUTH)

        def place(spot: tuple[float, float], mesh: Mesh) -> NDArray[np.float64]:
            """Return where a shape's origin is: on the floor, where it is not laid over another."""
            up = np.array([0.0, floor - _lowest(mesh) if options.beside else 0.0, 0.0])
            return spot[0] * SPACING * self._aside + spot[1] * ROWS * self._back + up

        self.exhibits = []
        for k, session in enumerate(sessions):
            surface, resting = session.surface(), session.template_surface()
            own, behind = place(spots.shown[k], surface), place(spots.templates[k], resting)
            self.exhibits.append(
                Exhibit(drawing, f"shown-{k}", session, own, options.colors, self._refresh)
            )
            drawing.label(f"shown-{k}/label", "", self._before(own, floor))
            drawing.frame(f"template-{k}", behind)
            drawing.mesh(f"template-{k}/mesh", resting, options.colors, ghosts[0])
            if len(sessions) == 1:
                drawing.label(f"template-{k}/label", "template", self._before(behind, floor))
            else:  # what is before it stands on the reconstruction
                over = (0, resting.vertices[:, 1].max() + _OVER, 0)
                drawing.label(f"template-{k}/label", f"template of {session.title.text}", over)
                drawing.ring(f"shown-{k}/ring", floor - own[1], rgb_of(session.title.color))
        for k, spot in enumerate(spots.truths if truth is not None else ()):
            assert truth is not None
            own = place(spot, truth.mesh)
            drawing.frame(f"truth-{k}", own)
            drawing.frame(f"truth-{k}/mesh")
            drawing.mesh(f"truth-{k}/mesh/surface", truth.mesh, options.colors, ghosts[1])
            drawing.cloud(f"truth-{k}/cloud", truth.points)
            drawing.label(f"truth-{k}/label", "ground truth", self._before(own, floor))
        drawing.floor(floor - 0.005)
        if earlier is not None:
            earlier.remove()

    def _before(self, place: NDArray[np.float64], floor: float) -> NDArray[np.float64]:
        """Return where on the floor the label of a shape lies, from the shape's origin."""
        return np.array([0.0, floor - place[1], 0.0]) - _BEFORE * self._back

    def _toggle(self, options: DrawingOptions) -> None:
        """Show what is to be seen beside the reconstructions."""
        assert self.drawing is not None
        for name, node in self.drawing.nodes.items():
            kind, _, part = name.partition("/")
            if kind.startswith("template"):
                node.visible = options.beside if part == "label" else options.template
            elif kind.startswith("truth"):
                node.visible = {
                    "": options.truth or options.truth_cloud,
                    "mesh": options.truth,
                    "cloud": options.truth_cloud,
                    "label": options.beside,
                }[part]
