"""One visitor's page of the viewer: what its inputs do, and how it is brought up to date."""

from __future__ import annotations

import logging
import re
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ffd_lightning.errors import UserError
from ffd_lightning.inference.files import MeshWriter
from ffd_lightning.inference.viewer.library import Library
from ffd_lightning.inference.viewer.panel import Panel
from ffd_lightning.inference.viewer.panel_text import (
    in_page,
    input_block,
    part_legend,
    scene_label,
    score_table,
)
from ffd_lightning.inference.viewer.photo import File, Photo
from ffd_lightning.inference.viewer.scene import ROWS, SPACING, Stage
from ffd_lightning.inference.viewer.session import Session

log = logging.getLogger(__name__)

_STEPS = {"previous": -1, "next": 1}
_NARROW = 0.8  # width / height of a window whose lower half the panel takes


class Page:
    """Panel and scene of one visitor.

    Inputs only say that something changed. One thread then reads them all and brings the page up
    to date, so that what comes while it is busy is done at once afterwards, the newest alone.

    Args:
        client: viser's.
        library: the networks and the test shapes.
    """

    def __init__(self, client: Any, library: Library) -> None:
        self._client, self._library = client, library
        self.sessions: tuple[Session, ...] = ()
        self._photo = library.photo  # that is asked for, None for the test shape
        self._latest = library.photo  # that was opened last, whether or not it could be used
        self._asked: object = None  # which input is shown
        self._notices: list[Any] = []  # what did not work
        self._wanted, self._closed = threading.Event(), False
        self.stage = Stage(client.scene, library.camera.frame, self._wanted.set)
        self.panel = Panel(client.gui, library, self._wanted.set)
        self._listen()
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

    # --- what inputs do --------------------------------------------------------------------------

    def _listen(self) -> None:
        panel = self.panel
        if panel.shape is not None:
            panel.shape.on_update(self._on_shape)
            panel.view.on_update(self._on_shape)
            panel.back.on_click(self._on_shape)
            panel.step.on_click(self._on_step)
        panel.photo.on_upload(self._on_photo)
        panel.mask.on_upload(self._on_mask)
        panel.unmask.on_click(lambda _: self._open_photo_with(None))
        panel.reset.on_click(self._on_reset)
        panel.save.on_click(self._guarded(self._on_save))
        panel.camera.on_click(lambda _: self._look_as_at_first())

    def _on_shape(self, _: Any) -> None:
        self._photo = self._latest = None
        self._wanted.set()

    def _on_step(self, event: Any) -> None:
        ids = self._library.shape_ids
        other = np.random.default_rng().integers(1, max(2, len(ids)))
        step = _STEPS.get(event.target.value, int(other))
        self.panel.shape.value = ids[(ids.index(self.panel.shape.value) + step) % len(ids)]

    def _on_photo(self, event: Any) -> None:
        file = event.target.value
        self._photo = self._latest = Photo(File(file.name, file.content))
        self._wanted.set()

    def _on_mask(self, event: Any) -> None:
        file = event.target.value
        self._open_photo_with(File(file.name, file.content))

    def _open_photo_with(self, mask: File | None) -> None:
        if self._latest is not None:
            self._photo = self._latest = replace(self._latest, mask=mask)
            self._wanted.set()

    def _on_reset(self, _: Any) -> None:
        self.stage.pulls()  # those that wait to be shown are forgotten, too
        for session in self.sessions:
            session.reset()
        self.panel.amount.value = 1.0
        self._wanted.set()

    def _on_save(self, _: Any) -> None:
        for session in self.sessions:
            shown = session.shown()
            content = MeshWriter(shown.bank, self.panel.mesh_colors()).glb(shown)
            name = (
                session.name if len(self.sessions) == 1 else f"{session.name}-{session.title.text}"
            )
            name = re.sub(r"[^\w.-]+", "-", name)  # shapes of several categories have a slash
            self._client.send_file_download(f"{name}.glb", content, save_immediately=True)

    def _look_as_at_first(self) -> None:
        """Put the camera where the networks' images are taken from, far enough to see all."""
        camera, original = self._client.camera, self._library.camera
        frame, half = original.frame, original.half_height
        width = 2 * SPACING + 1.4  # the outer shapes are large themselves
        deep = ROWS / 2 * (len(self._library.titles) - 1)  # to the row in front, and behind
        up, along = abs(float(frame.forward[1])), abs(float(frame.up[1]))
        height = max(1.2 + 2 * deep * up, width / camera.aspect)
        distance = height / (2 * half) + deep * along
        target = (
            -0.3 * height * frame.up if camera.aspect < _NARROW else np.zeros(3)
        )  # below lies the panel
        camera.fov = np.radians(original.field_of_view)
        camera.up_direction = (0.0, 1.0, 0.0)
        camera.position = target - frame.forward * distance
        camera.look_at = target
        self._view_from = camera.aspect, target - frame.forward * distance

    def _on_camera(self, camera: Any) -> None:
        """Fit all in again where the window was resized, if the camera was not moved."""
        aspect, place = self._view_from
        still = np.allclose(camera.position, place, atol=1e-3)
        if still and not np.isclose(camera.aspect, aspect, rtol=1e-2):
            self._look_as_at_first()
            self._wanted.set()  # labels are as long as there is room

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
        for session, pulls in zip(self.sessions, self.stage.pulls(), strict=False):
            for index, position in pulls.items():
                session.move(index, position)
        panel = self.panel
        try:
            self._open()
        finally:  # a photograph that cannot be used may be of use with a mask
            panel.show_photo(self._latest)
        if not self.sessions:
            return
        for chosen, session in zip(panel.lists, self.sessions, strict=True):
            chosen.apply(session)
            session.amount = panel.amount.value
        scores = [session.scores() for session in self.sessions]
        labels = ["reconstruction"]
        if len(self.sessions) > 1:
            room = self._client.camera.aspect > _NARROW
            labels = [
                scene_label(session.title, own if room else {})
                for session, own in zip(self.sessions, scores, strict=True)
            ]
        with self._client.atomic():
            self.stage.show(self.sessions, panel.drawing_options(), labels)
        for chosen, session in zip(panel.lists, self.sessions, strict=True):
            chosen.refresh(session)
        panel.scores.content = score_table(self._library.titles, scores)
        panel.legend.content = part_legend(self.sessions)
        panel.legend.visible = panel.mesh_colors() == "parts"

    def _open(self) -> None:
        """Open what is asked for, if it is not what is shown, and forget all of what was."""
        photo, earlier, panel = self._photo, self._asked, self.panel
        asked: object = photo
        if photo is None and panel.shape is not None:
            asked = (panel.shape.value, panel.view.value)
        if asked is None or asked == earlier:
            return
        self._asked = asked
        while self._notices:
            self._notices.pop().remove()
        try:
            if photo is not None:
                sessions = self._library.open_photo(photo)
            else:
                sessions = self._library.open_shape(panel.shape.value, int(panel.view.value) - 1)
        except Exception:
            if photo is not None and photo is self._photo:  # what was shown before stays
                self._photo = earlier if isinstance(earlier, Photo) else None
                self._asked = earlier
            raise
        self.sessions = sessions
        for chosen, session in zip(panel.lists, sessions, strict=True):
            chosen.open(session)
        panel.amount.value = 1.0
        panel.input.content = input_block(sessions[0].reconstruction.photo)
        parts = any(s.template_surface().face_parts is not None for s in sessions)
        panel.show_all(sessions[0].truth is not None, parts)
