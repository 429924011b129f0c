"""What all visitors of the viewer share: the network and the test shapes, and their server."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError
from ffd_lightning.imaging.framing import FramedPhoto
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.page import Page
from ffd_lightning.inference.viewer.session import Session, Truth, display_bank


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
    """The network and the test shapes that all visitors share.

    Args:
        predictor: the network.
        title: what is looked at, in a line.
        view: how the network's images are rendered; the page's camera starts at theirs,
            or at three quarters where they have several.
        shapes: the test shapes, None for photographs alone.
        note: what visitors should know, shown at the top.
    """

    def __init__(
        self,
        predictor: Predictor,
        title: str,
        view: RenderSettings,
        shapes: HeldOutShapes | None = None,
        note: str = "",
    ) -> None:
        self.title, self.note = title, note
        self.shape_ids = () if shapes is None else shapes.ids
        self.views = 1 if shapes is None else shapes.prepared.image_shape[0]
        self.camera = view.picture_camera
        self._predictor, self._shapes = predictor, shapes
        self._display = display_bank(predictor.model.bank)
        self._busy = threading.Lock()  # visitors are served by threads of their own

    def open_shape(self, shape_id: str, view: int = 0) -> Session:
        """See `Library`."""
        assert self._shapes is not None
        prepared = self._shapes.prepared
        row = prepared.index(shape_id)
        step = f"test shape {shape_id}" + (f", view {view + 1}" if self.views > 1 else "")
        photo = FramedPhoto(prepared.image(row, view), (step,), ())
        truth = Truth(shape_id, prepared.mesh(row), prepared.cloud(row, 4096))
        with self._busy:
            (found,) = self._predictor.predict_framed([photo])
            self._display.subdivided(found.index)
        return Session(found, self._display, truth)

    def open_photo(self, path: Path) -> Session:
        """See `Library`."""
        with self._busy:
            return Session(self._predictor.predict(path), self._display)


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
        control_width="large", show_logo=False, show_share_button=False, brand_color=(214, 39, 40)
    )
    server.gui.main_panel.dock_right()
    server.scene.set_up_direction("+y")
    server.scene.configure_environment_map("warehouse", environment_intensity=0.5)
    pages: dict[int, Page] = {}

    @server.on_client_connect
    def _(client: Any) -> None:
        pages[client.client_id] = Page(client, studio)

    @server.on_client_disconnect
    def _(client: Any) -> None:
        if client.client_id in pages:
            pages.pop(client.client_id).close()

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
