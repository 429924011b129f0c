"""Look at reconstructions in a local page, pull at them, and try photographs.

    ffd view                                     photos, by the model that comes with the package
    ffd view run=runs/demo/table/r/t16/seed0     a run's test shapes, and photos
    ffd view runs=[DIR,DIR]                      two runs side by side: the same inputs, by both
    ffd view image=photo.png mask=mask.png       a photo to begin with

The page is served to this machine only. Every browser window that opens it has a state of its own.
Needs viser: pip install 'ffd_lightning[viewer]'
"""

from __future__ import annotations

import threading
from dataclasses import dataclass, field
from pathlib import Path

from ffd_lightning.app import viewed_runs
from ffd_lightning.components import check_ranges
from ffd_lightning.errors import ConfigError
from ffd_lightning.inference.viewer.photo import File, Photo
from ffd_lightning.inference.viewer.studio import Studio, import_viser, start

MAIN = "run"
ALONE = True


@dataclass
class Settings:
    """Settings of `ffd view`.

    Attributes:
        run: a run folder, or a checkpoint file (then for photographs alone); null for the model
            that comes with the package.
        runs: two of them, in place of run, to look at side by side: [DIR,DIR]; of one category,
            and of images of one size.
        checkpoint: another checkpoint than the run's newest.
        image: a photograph to begin with.
        mask: of the object in image, bright where it is; by default the background is told by the
            photograph itself.
        data_root: where the runs' prepared data is (`paths.data`), if not where it was.
        port: of the page; the next one that is free is taken if it is in use.
        device: cpu, cuda, cuda:1, ..., or auto, a GPU if there is one.
    """

    run: str | None = None
    runs: list[str] = field(default_factory=list)
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
        ConfigError: no run, no checkpoint, two runs that cannot be compared, or viser is missing.
        DataError: a damaged checkpoint, or a photograph that cannot be used.
    """
    _check(settings)
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


def _check(settings: Settings) -> None:
    """Refuse settings that cannot work."""
    if settings.mask and not settings.image:
        raise ConfigError("mask= is of a photograph: name it by image=")
    runs = settings.runs
    if not runs:
        return
    if settings.run or settings.checkpoint:
        other = "run" if settings.run else "checkpoint"
        raise ConfigError(f"runs= and {other}= cannot be given together: runs= takes checkpoints")
    if len(runs) != 2 or len({Path(run).expanduser().resolve() for run in runs}) != 2:
        raise ConfigError("runs= takes two different runs, [DIR,DIR]; a single one is run=DIR")


def open_studio(settings: Settings) -> Studio:
    """Load what the settings name; see `viewed_runs.open_studio`."""
    named = settings.runs or ([settings.run] if settings.run else [])
    image, mask, checkpoint = (
        None if name is None else Path(name).expanduser()
        for name in (settings.image, settings.mask, settings.checkpoint)
    )
    photo = None
    if image is not None:
        photo = Photo(File.read(image), None if mask is None else File.read(mask))
    paths = [Path(run).expanduser() for run in named]
    return viewed_runs.open_studio(paths, checkpoint, settings.data_root, settings.device, photo)
