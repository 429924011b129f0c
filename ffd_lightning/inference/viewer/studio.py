"""A local page to look at reconstructions, to pull at them, and to try photographs.

    python -m ffd_lightning.inference.viewer.studio run=runs/demo/table/r/t16/seed0

run=          a run folder, or a checkpoint file (then for photographs alone)
checkpoint=   another checkpoint than the run's newest
data_root=    where the run's prepared data is (`paths.data`), if not where it was
port=8080     the next free one is taken if it is in use
device=auto   cpu, cuda, cuda:1, ...

The page is served to this machine only. Every browser window that opens it has a state of its own.
Needs viser: pip install '.[viewer]'
"""

from __future__ import annotations

import sys
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import MISSING, DictConfig, OmegaConf
from omegaconf.errors import ValidationError

from ffd_lightning.app.cli import register, run_app
from ffd_lightning.app.config import typed_config
from ffd_lightning.app.open_run import build_data, read_config
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.imaging.framing import FramedPhoto
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.page import Page
from ffd_lightning.inference.viewer.session import Session, Truth, display_bank
from ffd_lightning.run_folder import RunFolder


@dataclass
class ViewerSettings:
    """Settings of the command; see the module."""

    run: str = MISSING
    checkpoint: str | None = None
    data_root: str | None = None
    port: int = 8080
    device: str = "auto"


@dataclass(frozen=True)
class TestModels:
    """The test models of a run: their prepared set and their ids."""

    prepared: PreparedSet
    ids: tuple[str, ...]


def open_models(run: Path, data_root: str | None = None) -> TestModels:
    """Open the test models of a run, whose data must have been prepared.

    Raises:
        ConfigError: it is no run folder, or its data is not there.
        DataError: the data is damaged.
    """
    data = build_data(read_config(RunFolder(run), data_root))
    for preparation in data.preparations:
        if not preparation.target.exists():
            raise ConfigError(
                f"its prepared data is not at {preparation.target}: data_root=DIR says where"
            )
    data.setup()
    return TestModels(data.prepared, data.split.test)


class Studio:
    """The network and the models that all visitors share.

    Args:
        predictor: the network.
        models: the test models, None for photographs alone.
        note: what visitors should know, shown at the top.
    """

    def __init__(
        self, predictor: Predictor, models: TestModels | None = None, note: str = ""
    ) -> None:
        model = predictor.model
        self.title = (
            f"{', '.join(model.categories)}, regime {model.record.get('regime', 'unknown')}, "
            f"{len(predictor.model.bank)} templates, {predictor.model.step:,} steps"
        )
        self.note = note
        self.model_ids = () if models is None else models.ids
        self.views = 1 if models is None else models.prepared.image_shape[0]
        render = model.render
        self.elevation, self.azimuth = float(render.elevation), float(render.azimuths[0])
        self._predictor, self._models = predictor, models
        self._display = display_bank(predictor.model.bank)
        self._busy = threading.Lock()  # visitors are served by threads of their own

    def open_model(self, model_id: str, view: int = 0) -> Session:
        """See `Library`."""
        assert self._models is not None
        prepared = self._models.prepared
        row = prepared.index(model_id)
        step = f"test model {model_id}" + (f", view {view + 1}" if self.views > 1 else "")
        photo = FramedPhoto(prepared.image(row, view), (step,), ())
        truth = Truth(model_id, prepared.mesh(row), prepared.cloud(row, 4096))
        with self._busy:
            (found,) = self._predictor.predict_framed([photo])
            self._display.subdivided(found.index)
        return Session(found, self._display, truth)

    def open_photo(self, path: Path) -> Session:
        """See `Library`."""
        with self._busy:
            return Session(self._predictor.predict(path), self._display)


def open_studio(settings: ViewerSettings) -> Studio:
    """Load what the settings name.

    Raises:
        ConfigError: no run and no checkpoint.
        DataError: a damaged checkpoint.
    """
    run = Path(settings.run).expanduser()
    predictor = Predictor.load(settings.checkpoint or run, settings.device)
    if run.is_file():
        return Studio(predictor, note="A checkpoint alone: open a photo.")
    try:
        return Studio(predictor, open_models(run, settings.data_root))
    except UserError as error:
        return Studio(predictor, note=f"No test models, photos only: {error}")


def start(studio: Studio, port: int = 8080) -> Any:
    """Serve the page to this machine and return viser's server; `stop()` ends it.

    Args:
        studio: the network and models.
        port: or the next one that is free.

    Raises:
        ConfigError: viser is not installed.
    """
    viser = _viser()
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


def _viser() -> Any:
    try:
        import viser
    except ImportError:
        raise ConfigError("the viewer needs viser: pip install 'viser>=1.1,<2'") from None
    return viser


def read_settings(arguments: list[str]) -> ViewerSettings:
    """Read `key=value` arguments.

    Raises:
        ConfigError: something else, no `run=`, or a value that does not fit.
        OmegaConfBaseException: an unknown key.
    """
    register(ViewerSettings)
    for argument in arguments:
        if "=" not in argument:
            raise ConfigError(f"{argument!r} is no setting: write run={argument}, say")
    given = OmegaConf.from_dotlist(arguments)
    try:
        merged = OmegaConf.merge(OmegaConf.structured(ViewerSettings), given)
    except ValidationError as error:
        reason = str(error).split("\n")[0]
        raise ConfigError(f"{error.full_key}=... cannot be used ({reason})") from None
    assert isinstance(merged, DictConfig)
    settings = typed_config(merged, ViewerSettings)
    if not 0 < settings.port < 65536:
        raise ConfigError(f"port={settings.port} must lie between 1 and 65535")
    return settings


def main(arguments: list[str]) -> int:
    """Serve the page until interrupted."""
    if not arguments or {"-h", "--help"} & set(arguments):
        print(__doc__)
        return 0
    settings = read_settings(arguments)
    _viser()  # before anything is loaded that would be for nothing
    studio = open_studio(settings)
    server = start(studio, settings.port)
    if studio.note:
        print(studio.note)
    print(f"http://127.0.0.1:{server.get_port()}  (Ctrl-C ends it)", flush=True)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        server.stop()
    return 0


if __name__ == "__main__":
    run_app(lambda: sys.exit(main(sys.argv[1:])))
