"""Look at reconstructions in a local page, pull at them, and try photographs.

    ffd view                                     photos, by the model that comes with the package
    ffd view run=runs/demo/table/r/t16/seed0     a run's test shapes, and photos
    ffd view image=photo.png mask=mask.png       a photo to begin with

The page is served to this machine only. Every browser window that opens it has a state of its own.
Needs viser: pip install 'ffd_lightning[viewer]'
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.app import viewed_runs
from ffd_lightning.components import check_ranges
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.inference.viewer.server import import_viser, start
from ffd_lightning.inference.viewer.shared import Photo, Shared

MAIN = "run"
ALONE = True


@dataclass
class Settings:
    """Settings of `ffd view`.

    Attributes:
        run: a run folder, or a checkpoint file (then for photographs alone); null for the model
            that comes with the package.
        checkpoint: another checkpoint than the run's newest.
        image: a photograph to begin with.
        mask: of the object in image, bright where it is; by default the background is told by the
            photograph itself.
        data_root: where the run's prepared data is (`paths.data`), if not where it was.
        port: of the page; the next one that is free is taken if it is in use.
        device: cpu, cuda, cuda:1, ..., or auto, a GPU if there is one.
    """

    run: str | None = None
    checkpoint: str | None = None
    image: str | None = None
    mask: str | None = None
    data_root: str | None = None
    port: int = 8080
    device: str = "auto"

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), port="[1, 65535]")


def main(settings: Settings) -> int:
    """Serve the page until interrupted.

    Raises:
        ConfigError: no run, no checkpoint, or viser is missing.
        DataError: a damaged checkpoint, or a photograph that cannot be used.
    """
    if settings.mask and not settings.image:
        raise ConfigError("mask= is of a photograph: name it by image=")
    import_viser()  # before anything is loaded that would be for nothing
    shared = open_shared(settings)
    server = start(shared, settings.port)
    if shared.note:
        print(shared.note)
    print(f"http://127.0.0.1:{server.get_port()}  (Ctrl-C ends it)", flush=True)
    try:
        threading.Event().wait()
    except KeyboardInterrupt:
        server.stop()
    return 0


def open_shared(settings: Settings) -> Shared:
    """Load what the settings name; see `viewed_runs.open_shared`."""
    run, checkpoint, image, mask = (
        None if name is None else Path(name).expanduser()
        for name in (settings.run, settings.checkpoint, settings.image, settings.mask)
    )
    photo = None
    if image is not None:
        photo = Photo(image.name, _read(image), None if mask is None else _read(mask))
    return viewed_runs.open_shared(run, checkpoint, settings.data_root, settings.device, photo)


def _read(path: Path) -> bytes:
    try:
        if path.exists() and not path.is_file():
            raise DataError(f"{path} is not a file")  # reading a pipe would wait for ever
        return path.read_bytes()
    except OSError as error:
        raise DataError(f"{path} cannot be read: {error.strerror}") from None
