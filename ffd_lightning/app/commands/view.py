"""Look at reconstructions in a local page, pull at them, and try photographs.

    ffd view                                     photos, by the model that comes with the package
    ffd view run=runs/demo/table/r/t16/seed0     a run's test shapes, and photos

The page is served to this machine only. Every browser window that opens it has a state of its own.
Needs viser: pip install 'ffd_lightning[viewer]'
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.app.build import build_data
from ffd_lightning.app.open_run import missing_data, read_config
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.studio import HeldOutShapes, Studio, import_viser, start
from ffd_lightning.run_folder import RunFolder

MAIN = "run"
ALONE = True


@dataclass
class Settings:
    """Settings of `ffd view`.

    Attributes:
        run: a run folder, or a checkpoint file (then for photographs alone); null for the model
            that comes with the package.
        checkpoint: another checkpoint than the run's newest.
        data_root: where the run's prepared data is (`paths.data`), if not where it was.
        port: of the page; the next one that is free is taken if it is in use.
        device: cpu, cuda, cuda:1, ..., or auto, a GPU if there is one.
    """

    run: str | None = None
    checkpoint: str | None = None
    data_root: str | None = None
    port: int = 8080
    device: str = "auto"


def main(settings: Settings) -> int:
    """Serve the page until interrupted.

    Raises:
        ConfigError: no run, no checkpoint, a port that cannot be, or viser is missing.
        DataError: a damaged checkpoint.
    """
    if not 0 < settings.port < 65536:
        raise ConfigError(f"port={settings.port} must lie between 1 and 65535")
    import_viser()  # before anything is loaded that would be for nothing
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


def open_studio(settings: Settings) -> Studio:
    """Load what the settings name.

    Raises:
        ConfigError: no run and no checkpoint.
        DataError: a damaged checkpoint.
    """
    run = None if settings.run is None else Path(settings.run).expanduser()
    predictor = Predictor.load(settings.checkpoint or run, settings.device)
    model, shapes, note = predictor.model, None, ""
    if run is None or run.is_file():
        note = "A checkpoint alone: open a photo."
    else:
        try:
            shapes = held_out_shapes(run, settings.data_root)
        except UserError as error:
            note = f"No test shapes, photos only: {error}"
    title = (
        f"{', '.join(model.categories)}, regime {model.record.get('regime', 'unknown')}, "
        f"{len(model.bank)} templates, {model.step:,} steps"
    )
    return Studio(predictor, title, model.render, shapes, note)


def held_out_shapes(run: Path, data_root: str | None = None) -> HeldOutShapes:
    """Open the test shapes of a run, whose data must have been prepared.

    Args:
        run: its folder.
        data_root: where its prepared data is, if not where it was.

    Raises:
        ConfigError: it is no run folder.
        DataError: the data is not there, or damaged.
    """
    folder = RunFolder(run)
    data = build_data(read_config(folder, data_root))
    if (missing := missing_data(folder, data)) is not None:
        raise missing
    data.setup()
    return HeldOutShapes(data.prepared, data.split.test)
