"""What all visitors of the viewer share: the networks and the test shapes, and their server."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.imaging.framing import FramedPhoto
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.page import Page
from ffd_lightning.inference.viewer.photo import Photo
from ffd_lightning.inference.viewer.session import NetworkTitle, Session, Truth, display_bank
from ffd_lightning.inference.viewer.thumbnails import Thumbnails

_BRAND = (52, 73, 94)  # of no regime
_OVERVIEW = 30.0  # degrees


@dataclass(frozen=True)
class HeldOutShapes:
    """The test shapes of a run.

    Attributes:
        prepared: the set that they are in.
        ids: theirs, in the order in which they are listed.
    """

    prepared: PreparedSet
    ids: tuple[str, ...]


class Studio:
    """The networks and the test shapes that all visitors share.

    Args:
        predictors: one network, or two that see the same images.
        titles: how each of them is called.
        view: how the networks' images are rendered; the page's camera starts at theirs,
            or at three quarters where they have several.
        shapes: the test shapes, None for photographs alone.
        heading: what is looked at, in a line.
        note: what visitors should know, shown at the top.
        photo: that visitors see first, None for the first test shape.
    """

    def __init__(
        self,
        predictors: Sequence[Predictor],
        titles: Sequence[NetworkTitle],
        view: RenderSettings,
        shapes: HeldOutShapes | None = None,
        heading: str = "",
        note: str = "",
        photo: Photo | None = None,
    ) -> None:
        self.titles, self.heading, self.note = tuple(titles), heading, note
        self.shape_ids = () if shapes is None else shapes.ids
        self.views = 1 if shapes is None else shapes.prepared.image_shape[0]
        self.camera, self.photo = view.picture_camera, photo
        if len(predictors) > 1:  # two rows, the one behind seen over the other
            elevation = max(_OVERVIEW, self.camera.elevation)
            self.camera = replace(self.camera, elevation=elevation)
        banks = [predictor.model.bank for predictor in predictors]
        self._predictors, self._shapes = tuple(predictors), shapes
        self._displays = [display_bank(bank) for bank in banks]
        self._thumbnails = [Thumbnails(bank, self.camera) for bank in banks]
        self._busy = threading.Lock()  # visitors are served by threads of their own

    def thumbnail(self, network: int, template: int) -> str:
        """See `Library`."""
        return self._thumbnails[network][template]

    def open_shape(self, shape_id: str, view: int = 0) -> tuple[Session, ...]:
        """See `Library`."""
        assert self._shapes is not None
        prepared = self._shapes.prepared
        row = prepared.index(shape_id)
        step = f"test shape {shape_id}" + (f", view {view + 1}" if self.views > 1 else "")
        framed = FramedPhoto(prepared.image(row, view), (step,), ())
        truth = Truth(shape_id, prepared.mesh(row), prepared.cloud(row, 4096))
        with self._busy:
            return self._sessions(framed, truth, shape_id)

    def open_photo(self, photo: Photo) -> tuple[Session, ...]:
        """See `Library`."""
        with self._busy, tempfile.TemporaryDirectory() as folder:
            try:
                file, mask = photo.write(Path(folder))
                framed = self._predictors[0].frame(file, mask=mask)
            except UserError as error:
                raise DataError(str(error).replace(f"{folder}/", "")) from None
            return self._sessions(framed, None, Path(photo.name).stem)

    def _sessions(self, framed: FramedPhoto, truth: Truth | None, name: str) -> tuple[Session, ...]:
        """Reconstruct one image by each network."""
        sessions = []
        for predictor, display, title in zip(
            self._predictors, self._displays, self.titles, strict=True
        ):
            (found,) = predictor.predict_framed([framed])
            display.subdivided(found.index)
            sessions.append(Session(found, display, truth, title, name))
        return tuple(sessions)


def start(studio: Studio, port: int = 8080) -> Any:
    """Serve the page to this machine and return viser's server; `stop()` ends it.

    Args:
        studio: what is served.
        port: or the next one that is free.

    Raises:
        ConfigError: viser is not installed.
    """
    viser = import_viser()
    server = viser.ViserServer(host="127.0.0.1", port=port, label="ffd_lightning", verbose=False)
    server.gui.configure_theme(
        control_width="large", show_logo=False, show_share_button=False, brand_color=_BRAND
    )
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+y")
    server.scene.configure_environment_map("warehouse", environment_intensity=0.5)
    pages: dict[int, Page] = {}

    @server.on_client_connect
    def _(client: Any) -> None:
        pages[client.client_id] = Page(client, studio)
        if client.client_id not in server.get_clients():  # it left meanwhile
            close(client)

    @server.on_client_disconnect
    def close(client: Any) -> None:
        page = pages.pop(client.client_id, None)
        if page is not None:
            page.close()

    return server


def import_viser() -> Any:
    """Return the package that serves the page.

    Raises:
        ConfigError: it is not installed.
    """
    try:
        import viser
    except ImportError:
        raise ConfigError("the viewer needs viser: pip install 'ffd_lightning[viewer]'") from None
    return viser
