"""One visitor's page of the viewer: what it has, what its inputs do, how it is kept up to date."""

from __future__ import annotations

import logging
import re
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast, get_args

import numpy as np

from ffd_lightning.errors import UserError
from ffd_lightning.inference.files import MeshWriter
from ffd_lightning.inference.pieces import MeshColors
from ffd_lightning.inference.viewer.scene import SPACING, DrawingOptions, Scene
from ffd_lightning.inference.viewer.shared import Photo, Shared
from ffd_lightning.inference.viewer.state import State
from ffd_lightning.inference.viewer.text import (
    category_labels,
    in_page,
    input_text,
    part_legend,
    score_table,
    template_labels,
)

log = logging.getLogger(__name__)

_STEPS = {"previous": -1, "next": 1}
_NARROW = 0.8  # width / height of a window whose lower half the panel takes
_BOXES = {
    "template": "Template",
    "mesh": "Deformed mesh",
    "truth": "Ground truth",
    "cage": "Control lattice",
    "handles": "Control points",
}


class Page:
    """Panel and scene of one visitor.

    Inputs only say that something changed. One thread then reads them all and brings the page up
    to date, so that what comes while it is busy is done at once afterwards, the newest alone.

    Args:
        client: viser's.
        shared: the network and the test shapes.

    Attributes:
        state: what is looked at, None before the first input.
    """

    def __init__(self, client: Any, shared: Shared) -> None:
        self._client, self._shared = client, shared
        self.state: State | None = None
        self._photo = shared.photo  # that is asked for, None for the test shape
        self._latest = shared.photo  # that was opened last, whether or not it could be used
        self._asked: object = None  # which input is shown
        self._notices: list[Any] = []  # what did not work
        self._wanted, self._closed = threading.Event(), False
        self.scene = Scene(client.scene, shared.camera.pose, self._wanted.set)
        self._add_panel(client.gui)
        self._view_from = 0.0, np.zeros(3)  # the window's aspect, and the camera's place for it
        self._look_as_at_first()
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

    def _add_panel(self, gui: Any) -> None:
        gui.add_markdown(f"**{self._shared.heading}**\n\n{self._shared.note}")
        with gui.add_folder("Input"):
            self._add_input(gui)
        with gui.add_folder("Template", visible=False) as template:
            self.category = gui.add_dropdown("Category", ("-",), hint="name, weight")
            self.template = gui.add_dropdown("Template", ("-",), hint="by weight")
            self.picture = gui.add_image(np.zeros((1, 1, 3), np.uint8))
        with gui.add_folder("Deformation", visible=False) as deformation:
            self.amount = gui.add_slider(
                "Amount", 0.0, 1.5, 0.01, 1.0, hint="0 the template, 1 the network's deformation"
            )
            self.scores = gui.add_markdown("")
            gui.add_markdown(
                "Drag a control point to pull at the shape; click it for arrows along the axes."
            )
            reset = gui.add_button("Reset", icon="rotate", hint="amount 1, no point pulled")
        with gui.add_folder("Show", visible=False) as show:
            self.colors = gui.add_dropdown("Colours", list(get_args(MeshColors)))
            self.legend = gui.add_html("", visible=False)
            self.boxes = {key: gui.add_checkbox(label, True) for key, label in _BOXES.items()}
            camera = gui.add_button("Camera as at first", icon="camera")
        self.save = gui.add_button("Save mesh (GLB)", icon="download", visible=False)
        self._parts = (template, deformation, show, self.save)
        for handle in (self.category, self.template, self.amount, self.colors):
            handle.on_update(lambda _: self._wanted.set())
        for handle in self.boxes.values():
            handle.on_update(lambda _: self._wanted.set())
        reset.on_click(self._on_reset)
        self.save.on_click(self._guarded(self._on_save))
        camera.on_click(lambda _: self._look_as_at_first())

    def _add_input(self, gui: Any) -> None:
        self.shape: Any = None
        if ids := self._shared.shape_ids:
            views = self._shared.views
            self.shape = gui.add_dropdown("Test shape", ids, hint="type to search")
            step = gui.add_button_group("", ("previous", "next", "random"))
            self.view = gui.add_slider("View", 1, max(2, views), 1, 1, visible=views > 1)
            self.back = gui.add_button("Back to the test shape", icon="arrow-left", visible=False)
            self.shape.on_update(self._on_shape)
            self.view.on_update(self._on_shape)
            self.back.on_click(self._on_shape)
            step.on_click(self._on_step)
        photo = gui.add_upload_button("Open a photo", icon="photo-up", mime_type="image/*")
        self.masking = gui.add_folder(None, visible=False)  # viser hides no upload button alone
        with self.masking:
            self.mask = gui.add_upload_button(
                "Open a mask",
                icon="mask",
                mime_type="image/*",
                hint="bright where its object is, of the photo's size",
            )
            self.unmask = gui.add_button("Without the mask", icon="mask-off", visible=False)
        self.seen = gui.add_image(np.zeros((1, 1, 3), np.uint8), label="What the network sees")
        self.input = gui.add_html("")
        photo.on_upload(self._on_photo)
        self.mask.on_upload(lambda event: self._open_photo_with(event.target.value.content))
        self.unmask.on_click(lambda _: self._open_photo_with(None))

    # --- what inputs do --------------------------------------------------------------------------

    def _on_shape(self, _: Any) -> None:
        self._photo = self._latest = None
        self._wanted.set()

    def _on_step(self, event: Any) -> None:
        ids = self._shared.shape_ids
        other = np.random.default_rng().integers(1, max(2, len(ids)))
        step = _STEPS.get(event.target.value, int(other))
        self.shape.value = ids[(ids.index(self.shape.value) + step) % len(ids)]

    def _on_photo(self, event: Any) -> None:
        file = event.target.value
        name = file.name.replace("\\", "/").rpartition("/")[2] or "photo"  # it may be any path
        self._photo = self._latest = Photo(name, file.content)
        self._wanted.set()

    def _open_photo_with(self, mask: bytes | None) -> None:
        if self._latest is not None:
            self._photo = self._latest = replace(self._latest, mask=mask)
            self._wanted.set()

    def _on_reset(self, _: Any) -> None:
        self.scene.pulls()  # those that wait to be shown are forgotten, too
        if self.state is not None:
            self.state.reset()
        self.amount.value = 1.0
        self._wanted.set()

    def _on_save(self, _: Any) -> None:
        assert self.state is not None
        shown = self.state.shown()
        content = MeshWriter(shown.bank, self._mesh_colors()).glb(shown)
        # Shapes of several categories have a slash.
        name = re.sub(r"[^\w.-]+", "-", self.state.name)
        self._client.send_file_download(f"{name}.glb", content, save_immediately=True)

    def _look_as_at_first(self) -> None:
        """Put the camera where the network's images are taken from, far enough to see all."""
        camera, original = self._client.camera, self._shared.camera
        frame, half = original.pose, original.half_height
        width = 2 * SPACING + 1.4  # the outer shapes are large themselves
        height = max(1.2, width / camera.aspect)
        target = (
            -0.3 * height * frame.up if camera.aspect < _NARROW else np.zeros(3)
        )  # below lies the panel
        camera.fov = np.radians(original.field_of_view)
        camera.up_direction = (0.0, 1.0, 0.0)
        camera.position = target - frame.forward * height / (2 * half)
        camera.look_at = target
        self._view_from = camera.aspect, np.asarray(camera.position)

    def _on_camera(self, camera: Any) -> None:
        """Fit all in again where the window was resized, if the camera was not moved."""
        aspect, place = self._view_from
        still = np.allclose(camera.position, place, atol=1e-3)
        if still and not np.isclose(camera.aspect, aspect, rtol=1e-2):
            self._look_as_at_first()

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
                self._say(in_page(str(error)))
            except Exception as error:
                log.exception("the viewer could not do this")
                self._say(f"{type(error).__name__}: {error}")

        return guarded

    def _say(self, message: str) -> None:
        notice = self._client.add_notification(
            "This did not work", message, color="red", auto_close_seconds=20.0
        )
        self._notices.append(notice)

    def _refresh(self) -> None:
        if self.state is not None:
            for index, position in self.scene.pulls().items():
                self.state.move(index, position)
        try:
            self._open()
        finally:  # a photograph that cannot be used may be of use with a mask
            self._show_photo()
        state = self.state
        if state is None:
            return
        self._choose(state)
        state.amount = self.amount.value
        boxes = {key: bool(box.value) for key, box in self.boxes.items()}
        with self._client.atomic():
            self.scene.show(state, DrawingOptions(self._mesh_colors(), **boxes))
        self.picture.image = self._shared.picture(state.template)
        self.scores.content = score_table(state.scores())
        self.legend.content = part_legend(state)
        self.legend.visible = self._mesh_colors() == "parts"

    def _mesh_colors(self) -> MeshColors:
        return cast(MeshColors, self.colors.value)

    def _open(self) -> None:
        """Open what is asked for, if it is not what is shown, and forget all of what was."""
        photo, earlier = self._photo, self._asked
        asked: object = photo
        if photo is None and self.shape is not None:
            asked = (self.shape.value, self.view.value)
        if asked is None or asked == earlier:
            return
        self._asked = asked
        while self._notices:
            self._notices.pop().remove()
        try:
            if photo is not None:
                state = self._shared.open_photo(photo)
            else:
                state = self._shared.open_shape(self.shape.value, int(self.view.value) - 1)
        except Exception:
            if photo is not None and photo is self._photo:  # what was shown before stays
                self._photo = earlier if isinstance(earlier, Photo) else None
                self._asked = earlier
            raise
        found = state.reconstruction
        self.category.options = category_labels(found)
        self.category.value = self.category.options[0]
        self.category.visible = len(self.category.options) > 1
        self._list_templates(state)
        self.amount.value = 1.0
        self.seen.image = found.photo.image[..., :3]
        self.input.content = input_text(found.photo)
        for part in self._parts:
            part.visible = True
        self.boxes["truth"].visible = state.truth is not None
        self.colors.visible = bool(found.part_names)
        self.state = state

    def _list_templates(self, state: State) -> None:
        """List the templates of a category, of which the best is chosen."""
        self.template.options = template_labels(state.reconstruction)
        self.template.value = self.template.options[0]

    def _choose(self, state: State) -> None:
        """Show the template that is chosen."""
        asked = list(state.reconstruction.category_weights)[_chosen(self.category)]
        if asked != state.reconstruction.category:
            state.choose_category(asked)
            self._list_templates(state)
        state.template = int(state.reconstruction.ranking[_chosen(self.template)])

    def _show_photo(self) -> None:
        """Show what can be done with the photograph that was opened last, if there is one."""
        photo = self._latest
        self.masking.visible = photo is not None
        if photo is not None:
            self.mask.label = f"Open a mask for {photo.name}"
            self.unmask.visible = photo.mask is not None
        if self.shape is not None:
            self.back.visible = photo is not None


def _chosen(dropdown: Any) -> int:
    """Return which option is chosen: the first where it is one of a list that is gone."""
    value, options = dropdown.value, dropdown.options
    return options.index(value) if value in options else 0
