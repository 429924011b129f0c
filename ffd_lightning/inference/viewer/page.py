"""One visitor's page of the viewer: the panel, and what its inputs do."""

from __future__ import annotations

import logging
import tempfile
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol, cast, get_args

import numpy as np

from ffd_lightning.errors import DataError, UserError
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.inference.files import MeshWriter
from ffd_lightning.inference.pieces import MeshColors
from ffd_lightning.inference.viewer.panel_text import (
    caption,
    category_labels,
    part_legend,
    score_table,
    template_labels,
    weight_bars,
)
from ffd_lightning.inference.viewer.scene import SPACING, DrawingOptions, Stage
from ffd_lightning.inference.viewer.session import Session

log = logging.getLogger(__name__)

_STEPS = {"previous": -1, "next": 1}


class Library(Protocol):
    """What all visitors share: the network, and the test shapes of its run."""

    title: str
    note: str
    shape_ids: tuple[str, ...]
    views: int
    camera: Camera

    def open_shape(self, shape_id: str, view: int) -> Session:
        """Reconstruct a test shape from one of its images."""
        ...

    def open_photo(self, path: Path) -> Session:
        """Reconstruct what a photograph shows."""
        ...


class Page:
    """Panel and scene of one visitor.

    Inputs only say that something changed. One thread then reads them all and brings the page up
    to date, so that what comes while it is busy is done at once afterwards, the newest alone.

    Args:
        client: viser's.
        library: the network and the test shapes.
    """

    def __init__(self, client: Any, library: Library) -> None:
        self._client, self._library = client, library
        self._session: Session | None = None
        self._upload: tuple[str, bytes] | None = None
        self._asked: object = None  # which input is shown
        self._wanted, self._closed = threading.Event(), False
        aside = library.camera.frame.right
        self._stage = Stage(client.scene, aside, self._wanted.set)
        self._build_panel(client.gui)
        self._view_from = 0.0, np.zeros(3)  # the window's aspect, and the camera's place for it
        self._look_as_input()
        client.camera.on_update(self._on_camera)
        self._wanted.set()
        self._worker = threading.Thread(target=self._work, daemon=True)
        self._worker.start()

    def close(self) -> None:
        """End what was begun for this visitor."""
        self._closed = True
        self._wanted.set()
        self._worker.join()

    # --- the panel -------------------------------------------------------------------------------

    def _build_panel(self, gui: Any) -> None:
        library = self._library
        gui.add_markdown(f"**{library.title}**" + (f"  \n{library.note}" if library.note else ""))
        with gui.add_folder("Input"):
            self._build_input(gui)
        with gui.add_folder("Template", visible=False) as template:
            self._category = gui.add_dropdown("Category", ("-",), hint="name, weight")
            self._bars = gui.add_html("")
            self._template = gui.add_dropdown("Template", ("-",), hint="rank, id, weight")
        with gui.add_folder("Deformation", visible=False) as deformation:
            self._amount = gui.add_slider(
                "Amount", 0.0, 1.5, 0.01, 1.0, hint="0 the template, 1 the network's deformation"
            )
            self._scores = gui.add_markdown("")
            gui.add_markdown(
                "Drag a red point to pull at the shape; click it for arrows along the axes."
            )
            reset = gui.add_button("Reset", icon="rotate", hint="amount 1, no point pulled")
        with gui.add_folder("Show", visible=False) as show:
            self._build_show(gui)
        save = gui.add_button("Save mesh (GLB)", icon="download", visible=False)
        self._parts = (template, deformation, show, save)
        for handle in (self._category, self._template, self._amount):
            handle.on_update(self._changed)
        reset.on_click(self._on_reset)
        save.on_click(self._guarded(self._on_save))

    def _build_input(self, gui: Any) -> None:
        ids = self._library.shape_ids
        if ids:
            self._shape = gui.add_dropdown("Test shape", ids, hint="type to search")
            step = gui.add_button_group("", ("previous", "next", "random"))
            self._view = gui.add_slider(
                "View", 1, max(2, self._library.views), 1, 1, visible=self._library.views > 1
            )
            self._shape.on_update(self._on_shape)
            self._view.on_update(self._on_shape)
            step.on_click(self._on_step)
        photo = gui.add_upload_button("Open a photo", icon="photo-up", mime_type="image/*")
        photo.on_upload(self._on_upload)
        self._image = gui.add_image(np.full((3, 4, 3), 255, np.uint8), visible=False)
        self._caption = gui.add_markdown("")

    def _build_show(self, gui: Any) -> None:
        self._layout = gui.add_dropdown("Arrange", ("side by side", "overlaid"))
        self._colors = gui.add_dropdown("Colours", list(get_args(MeshColors)))
        self._legend = gui.add_html("", visible=False)
        boxes = {
            "template": ("Template", True),
            "mesh": ("Deformed mesh", True),
            "cloud": ("Deformed cloud", False),
            "truth": ("Ground truth", True),
            "truth_cloud": ("Ground truth cloud", False),
            "cage": ("Control lattice", True),
            "first_cage": ("Lattice before", False),
            "handles": ("Control points", True),
        }
        self._boxes = {key: gui.add_checkbox(label, on) for key, (label, on) in boxes.items()}
        camera = gui.add_button("Camera as the input's", icon="camera")
        for handle in (self._layout, self._colors, *self._boxes.values()):
            handle.on_update(self._changed)
        camera.on_click(lambda _: self._look_as_input())

    # --- what inputs do --------------------------------------------------------------------------

    def _changed(self, _: Any) -> None:
        self._wanted.set()

    def _on_shape(self, _: Any) -> None:
        self._upload = None
        self._wanted.set()

    def _on_step(self, event: Any) -> None:
        ids = self._library.shape_ids
        step = _STEPS.get(event.target.value) or int(np.random.default_rng().integers(1, len(ids)))
        self._shape.value = ids[(ids.index(self._shape.value) + step) % len(ids)]

    def _on_upload(self, event: Any) -> None:
        file = event.target.value
        self._upload = (file.name, file.content)
        self._wanted.set()

    def _on_reset(self, _: Any) -> None:
        if self._session is not None:
            self._session.reset()
        self._amount.value = 1.0
        self._wanted.set()

    def _on_save(self, _: Any) -> None:
        if self._session is None:
            return
        shown = self._session.shown()
        content = MeshWriter(shown.bank, self._mesh_colors()).glb(shown)
        name = f"{shown.template_id}.glb".replace("/", "-")  # of several categories
        self._client.send_file_download(name, content, save_immediately=True)

    def _look_as_input(self) -> None:
        """Put the camera where the network's images are taken from, far enough to see the row."""
        camera, original = self._client.camera, self._library.camera
        frame, half = original.frame, original.half_height
        width = 2 * SPACING + 1.4  # the outer shapes are large themselves
        height = max(1.2, width / camera.aspect)
        distance = height / (2 * half)
        target = (
            -0.3 * height * frame.up if camera.aspect < 0.8 else np.zeros(3)
        )  # below lies the panel
        camera.fov = np.radians(original.field_of_view)
        camera.up_direction = (0.0, 1.0, 0.0)
        camera.position = target - frame.forward * distance
        camera.look_at = target
        self._view_from = camera.aspect, target - frame.forward * distance

    def _on_camera(self, camera: Any) -> None:
        """Fit the row in again where the window was resized, if the camera was not moved."""
        aspect, place = self._view_from
        still = np.allclose(camera.position, place, atol=1e-3)
        if still and not np.isclose(camera.aspect, aspect, rtol=1e-2):
            self._look_as_input()

    # --- bringing the page up to date ------------------------------------------------------------

    def _work(self) -> None:
        refresh = self._guarded(self._refresh)
        while self._wanted.wait() and not self._closed:
            self._wanted.clear()
            refresh()

    def _guarded(self, job: Callable[..., None]) -> Callable[..., None]:
        """Return a job whose errors are shown in the page."""

        def guarded(*arguments: Any) -> None:
            try:
                job(*arguments)
            except UserError as error:
                self._say(str(error))
            except Exception as error:
                log.exception("the viewer could not do this")
                self._say(f"{type(error).__name__}: {error}")

        return guarded

    def _say(self, message: str) -> None:
        self._client.add_notification(
            "This did not work", message, color="red", auto_close_seconds=20.0
        )

    def _refresh(self) -> None:
        if self._session is not None:
            for index, position in self._stage.pulls().items():
                self._session.move(index, position)
        self._open()
        session = self._session
        if session is None:
            return
        self._choose_category(session)
        labels = template_labels(session)
        session.template = int(session.reconstruction.ranking[labels.index(self._template.value)])
        session.amount = self._amount.value
        with self._client.atomic():
            self._stage.show(session, self._drawing_options())
        self._bars.content = weight_bars(session)
        self._scores.content = score_table(session.scores())
        self._legend.content = part_legend(session)
        self._legend.visible = self._mesh_colors() == "parts"

    def _open(self) -> None:
        """Open what is asked for, if it is not what is shown."""
        asked: object = self._upload
        if asked is None and self._library.shape_ids:
            asked = (self._shape.value, self._view.value)
        if asked is None or asked == self._asked:
            return
        self._asked = asked
        if self._upload is not None:
            session = self._open_upload(*self._upload)
        else:
            session = self._library.open_shape(self._shape.value, int(self._view.value) - 1)
        photo, categories = session.reconstruction.photo, category_labels(session)
        self._session = session
        self._category.options = categories
        self._category.value = categories[0]
        self._category.visible = len(categories) > 1
        self._list_templates(session)
        self._image.image = photo.image[..., :3]
        self._image.visible = True
        self._caption.content = caption(photo)
        for part in self._parts:
            part.visible = True
        for key in ("truth", "truth_cloud"):
            self._boxes[key].visible = session.truth is not None
        self._colors.visible = session.template_surface().face_parts is not None

    def _choose_category(self, session: Session) -> None:
        """Go over to the category that is asked for, if another is shown."""
        names = list(session.reconstruction.category_weights)
        asked = names[category_labels(session).index(self._category.value)]
        if asked != session.reconstruction.category:
            session.choose_category(asked)
            self._list_templates(session)

    def _list_templates(self, session: Session) -> None:
        labels = template_labels(session)
        self._template.options = labels
        self._template.value = labels[0]

    def _open_upload(self, name: str, content: bytes) -> Session:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / (Path(name).name or "photo")
            path.write_bytes(content)
            try:
                return self._library.open_photo(path)
            except UserError as error:
                raise DataError(str(error).replace(f"{folder}/", "")) from None

    def _mesh_colors(self) -> MeshColors:
        return cast(MeshColors, self._colors.value)

    def _drawing_options(self) -> DrawingOptions:
        boxes = {key: bool(box.value) for key, box in self._boxes.items()}
        return DrawingOptions(self._mesh_colors(), self._layout.value == "side by side", **boxes)
