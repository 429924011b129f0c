"""One visitor's page of the viewer: what it has, what its inputs do, how it is kept up to date."""

import logging
import re
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ffd_lightning.errors import UserError
from ffd_lightning.inference.scenes import glb, mesh_scene
from ffd_lightning.inference.viewer.scene import SPACING, Scene
from ffd_lightning.inference.viewer.shared import Photo, Shared
from ffd_lightning.inference.viewer.state import State
from ffd_lightning.inference.viewer.text import in_page, input_text, part_legend, score_table

log = logging.getLogger(__name__)

_STEPS = {"previous": -1, "next": 1}
_WHOLE = (5, 95)  # of a photograph's width or height, %: the box to begin with
_NARROW = 0.55  # width / height of a window whose lower half the panel takes


class Page:
    """Panel and scene of one visitor.

    Inputs only say that something changed. One thread then reads them all and brings the page up
    to date, so that what comes while it is busy is done at once afterwards, the newest alone.

    Attributes:
        state: what is looked at, None before the first input.
    """

    def __init__(self, client: Any, shared: Shared) -> None:
        self._client, self._shared = client, shared
        self.state: State | None = None
        self._photo = shared.photo  # that is asked for, None for the test shape
        self._opened: object = None  # the input that was opened last, whether or not it could be
        self._wanted, self._closed = threading.Event(), False
        self.scene = Scene(client.scene, shared.camera.pose, self._wanted.set)
        self._add_panel(client.gui)
        self._place_camera()
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
            gui.add_markdown("Drag a control point to pull at the shape.")
            reset = gui.add_button("Reset", icon="rotate", hint="amount 1, no point pulled")
        with gui.add_folder("Show", visible=False) as show:
            self.colors = gui.add_dropdown("Colours", self._shared.colors)
            self.legend = gui.add_html("", visible=False)
            self.lattice = gui.add_checkbox("Control lattice", True)
            camera = gui.add_button("Camera as at first", icon="camera")
        self.save = gui.add_button("Save mesh (GLB)", icon="download", visible=False)
        self._later = (template, deformation, show, self.save)
        for handle in (self.category, self.template, self.amount, self.colors, self.lattice):
            handle.on_update(lambda _: self._wanted.set())
        reset.on_click(self._on_reset)
        self.save.on_click(self._guarded(self._on_save))
        camera.on_click(lambda _: self._place_camera())

    def _add_input(self, gui: Any) -> None:
        self.shape: Any = None
        if ids := self._shared.shape_ids:
            views = self._shared.views
            self.shape = gui.add_dropdown("Test shape", ids, hint="type to search")
            step = gui.add_button_group("", ("previous", "next", "random"))
            self.view = gui.add_slider("View", 1, max(2, views), 1, 1, visible=views > 1)
            self.back = gui.add_button("Back to the test shape", icon="arrow-left", visible=False)
            for handle in (self.shape.on_update, self.view.on_update, self.back.on_click):
                handle(lambda _: self._ask_for(None))
            step.on_click(self._on_step)
        photo = gui.add_upload_button("Open a photo", icon="photo-up", mime_type="image/*")
        self.masking = gui.add_folder(None, visible=False)  # viser hides no upload button alone
        with self.masking:
            mask = gui.add_upload_button(
                "Open a mask for it",
                icon="mask",
                mime_type="image/*",
                hint="bright where its object is, of the photo's size",
            )
            sides = ("Box, across", "Box, down")
            self.box = [gui.add_multi_slider(side, 0, 100, 1, _WHOLE) for side in sides]
            self.boxed = gui.add_image(np.zeros((1, 1, 3), np.uint8), visible=False)
            boxing = gui.add_button("Cut out what is in the box", icon="crop")
        self.seen = gui.add_image(np.zeros((1, 1, 3), np.uint8), label="What the network sees")
        self.input = gui.add_html("")
        photo.on_upload(self._on_photo)
        mask.on_upload(self._on_mask)
        for slider in self.box:
            slider.on_update(self._guarded(lambda _: self._show_box()))
        boxing.on_click(lambda _: self._ask_for(self._in_box()))

    # --- what inputs do --------------------------------------------------------------------------

    def _ask_for(self, photo: Photo | None) -> None:
        self._photo, self._opened = photo, None  # what could not be opened is tried again, and said
        self._wanted.set()

    def _on_step(self, event: Any) -> None:
        ids = self._shared.shape_ids
        other = np.random.default_rng().integers(1, max(2, len(ids)))
        step = _STEPS.get(event.target.value, int(other))
        self.shape.value = ids[(ids.index(self.shape.value) + step) % len(ids)]

    def _on_photo(self, event: Any) -> None:
        file = event.target.value
        name = file.name.replace("\\", "/").rpartition("/")[2] or "photo"  # it may be any path
        self.boxed.visible = False  # of the photo before
        self._ask_for(Photo(name, file.content))

    def _on_mask(self, event: Any) -> None:
        if self._photo is not None:
            self._ask_for(replace(self._photo, mask=event.target.value.content, box=None))

    def _in_box(self) -> Photo | None:
        (left, right), (top, bottom) = (slider.value for slider in self.box)
        box = left, top, right, bottom
        return self._photo and replace(self._photo, mask=None, box=box)

    def _show_box(self) -> None:
        if (photo := self._in_box()) is not None:
            self.boxed.image, self.boxed.visible = photo.boxed(), True

    def _on_reset(self, _: Any) -> None:
        self.scene.pulls()  # those that wait to be drawn are forgotten, too
        if self.state is not None:
            self.state.reset()
        self.amount.value = 1.0
        self._wanted.set()

    def _on_save(self, _: Any) -> None:
        assert self.state is not None
        result = self.state.result()
        colors = self.colors.value
        content = glb(mesh_scene(result.colored(colors), colors))
        # Shapes of several categories have a slash.
        name = re.sub(r"[^\w.-]+", "-", self.state.name)
        self._client.send_file_download(f"{name}.glb", content, save_immediately=True)

    def _place_camera(self) -> None:
        """Put the camera where the input was taken from, if that is known, and see all."""
        camera, original = self._client.camera, self._shared.camera
        if self.state is not None:
            original = self.state.reconstruction.camera or original
        pose, width = original.pose, 2 * SPACING + 1.4  # the outer shapes are large themselves
        height = max(1.2, width / camera.aspect)
        # In narrow windows the panel lies below.
        target = -0.3 * height * pose.up if camera.aspect < _NARROW else np.zeros(3)
        camera.fov = np.radians(original.field_of_view)
        camera.up_direction = (0.0, 1.0, 0.0)
        camera.position = target - pose.forward * height / (2 * original.half_height)
        camera.look_at = target
        self._placed = camera.aspect, np.asarray(camera.position)

    def _on_camera(self, camera: Any) -> None:
        """Show all again where the window changed, as by the panel, and nobody moved the camera."""
        aspect, place = self._placed
        if camera.aspect != aspect and np.allclose(camera.position, place, atol=1e-3):
            self._place_camera()

    # --- bringing the page up to date ------------------------------------------------------------

    def _work(self) -> None:
        refresh = self._guarded(self._refresh)
        while self._wanted.wait() and not self._closed:
            self._wanted.clear()
            refresh()

    def _guarded(self, job: Callable[..., None]) -> Callable[..., None]:
        """Return a job whose errors are written in the page."""

        def guarded(*arguments: Any) -> None:
            try:
                job(*arguments)
            except Exception as error:
                message = f"{type(error).__name__}: {error}"
                if isinstance(error, UserError):
                    message = in_page(str(error))
                else:
                    log.exception("the viewer could not do this")
                self._client.add_notification(
                    "This did not work", message, color="red", auto_close_seconds=20.0
                )

        return guarded

    def _refresh(self) -> None:
        if self.state is not None:
            for index, position in self.scene.pulls().items():
                self.state.move(index, position)
        self._open()
        state = self.state
        if state is None:
            return
        asked = list(state.reconstruction.category_weights)[_chosen(self.category)]
        if asked != state.reconstruction.category:
            state.reconstruction = state.reconstruction.of_category(asked)
            self._list_templates(state)
        state.template = int(state.reconstruction.ranking[_chosen(self.template)])
        state.amount = self.amount.value
        with self._client.atomic():
            self.scene.show(state, self.colors.value, self.lattice.value)
        self.picture.image = self._shared.picture(state.template)
        self.scores.content = score_table(state.scores())
        self.legend.content = part_legend(state.template_surface())
        self.legend.visible = self.colors.value == "parts"

    def _open(self) -> None:
        """Open the input that is asked for; where it cannot be used, what was there stays."""
        asked: Any = self._photo
        if asked is None and self.shape is not None:
            asked = (self.shape.value, int(self.view.value) - 1)
        if asked is None or asked == self._opened:
            return
        self._opened, is_photo = asked, isinstance(asked, Photo)
        self.masking.visible = is_photo  # a photo that cannot be used may be of use with a mask
        if self.shape is not None:
            self.back.visible = is_photo
        state = self._shared.open_photo(asked) if is_photo else self._shared.open_shape(*asked)
        found = state.reconstruction
        weights = found.category_weights.items()
        self.category.options = [f"{name} ({weight:.1%})" for name, weight in weights]
        self.category.value = self.category.options[0]
        self.category.visible = len(self.category.options) > 1
        self._list_templates(state)
        self.amount.value = 1.0
        self.seen.image = found.photo.image[..., :3]
        self.input.content = input_text(found.photo)
        for part in self._later:
            part.visible = True
        self.colors.visible = len(self._shared.colors) > 1
        self.state = state
        self._place_camera()

    def _list_templates(self, state: State) -> None:
        """List the templates of a category by rank, of which the best is chosen."""
        found = state.reconstruction
        self.template.options = [
            f"{rank}: {found.bank.ids[t]} ({found.weights[t]:.1%})"
            for rank, t in enumerate(found.ranking, start=1)
        ]
        self.template.value = self.template.options[0]


def _chosen(dropdown: Any) -> int:
    """Return which option is chosen: the first where it is one of a list that is gone."""
    value, options = dropdown.value, dropdown.options
    return options.index(value) if value in options else 0
