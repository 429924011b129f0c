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
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ffd_lightning.app.build import build_data
from ffd_lightning.app.open_run import missing_data, read_config
from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.photo import File, Photo
from ffd_lightning.inference.viewer.session import NetworkTitle
from ffd_lightning.inference.viewer.studio import HeldOutShapes, Studio, import_viser, start
from ffd_lightning.palette import COLORS, REGIME_COLORS, regime_title
from ffd_lightning.run_folder import RunFolder

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


def main(settings: Settings) -> int:
    """Serve the page until interrupted.

    Raises:
        ConfigError: no run, no checkpoint, two runs that cannot be compared, a port that cannot be,
            or viser is missing.
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
    if not 0 < settings.port < 65536:
        raise ConfigError(f"port={settings.port} must lie between 1 and 65535")
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
    """Load what the settings name.

    Raises:
        ConfigError: no run and no checkpoint, or two runs that cannot be compared.
        DataError: a damaged checkpoint, or a photograph that cannot be used.
    """
    named = settings.runs or ([settings.run] if settings.run else [])
    paths = [Path(run).expanduser() for run in named]
    sources: Sequence[str | Path | None] = paths or [None]
    if settings.checkpoint:
        sources = [settings.checkpoint]
    predictors = [Predictor.load(source, settings.device) for source in sources]
    models = [predictor.model for predictor in predictors]
    if len(models) > 1:
        _check_comparable(models, named)
    shapes, note = _test_shapes(paths, settings.data_root)
    heading = ", ".join(models[0].categories)
    photo = _photo(settings)
    titles = _titles(models, paths)
    studio = Studio(predictors, titles, models[0].render, shapes, heading, note, photo)
    if photo is not None:
        studio.open_photo(photo)  # what is wrong with it is said here
    return studio


def _check_comparable(models: Sequence[TrainedModel], names: Sequence[str]) -> None:
    """Refuse two networks that do not see the same images.

    Raises:
        ConfigError: they were trained on other categories, or on images of another size or camera.
    """
    first, second = (
        f"{name} is of {', '.join(model.categories)}, images of {model.render.height} x "
        f"{model.render.width} pixels"
        for name, model in zip(names, models, strict=True)
    )
    if first.partition(" is of ")[2] != second.partition(" is of ")[2]:
        raise ConfigError(f"runs= must be of the same data and image size: {first}; {second}")
    if models[0].render != models[1].render:
        raise ConfigError(
            f"runs= must be of images from the same cameras (data.render): those of {names[0]} and "
            f"{names[1]} differ"
        )


def _test_shapes(paths: Sequence[Path], data_root: str | None) -> tuple[HeldOutShapes | None, str]:
    """Return the test shapes that runs have in common, or None and why there are none.

    Raises:
        ConfigError: the runs are of different data.
    """
    if not paths or any(path.is_file() for path in paths):
        return None, "A checkpoint alone: open a photo."
    try:
        found = [held_out_shapes(path, data_root) for path in paths]
    except UserError as error:
        return None, f"No test shapes, photos only: {error}"
    first, *others = found
    ids = first.ids
    for path, other in zip(paths[1:], others, strict=True):
        if other.prepared.path != first.prepared.path:
            raise ConfigError(
                f"runs= must be of the same data: {paths[0]} is of {first.prepared.path}, "
                f"{path} of {other.prepared.path}"
            )
        ids = tuple(i for i in ids if i in set(other.ids))
    if not ids:
        raise ConfigError("runs= have no test shape in common")
    return HeldOutShapes(first.prepared, ids), ""


def _titles(models: Sequence[TrainedModel], paths: Sequence[Path]) -> list[NetworkTitle]:
    """Return how the networks are called: by their regimes, and by what else tells them apart."""
    regimes = [str(model.record.get("regime", "unknown")) for model in models]
    names = [regime_title(regime) for regime in regimes]
    if len(set(names)) < len(names):
        names = [f"{name} ({own})" for name, own in zip(names, _differences(paths), strict=True)]
    titles: list[NetworkTitle] = []
    for name, regime, model in zip(names, regimes, models, strict=True):
        taken = {title.color for title in titles}
        color = REGIME_COLORS.get(regime, COLORS[-2])
        color = COLORS[-1] if color in taken else color
        note = f"{len(model.bank)} templates, {model.step:,} steps"
        titles.append(NetworkTitle(name, color, note))
    return titles


def _differences(paths: Sequence[Path]) -> list[str]:
    """Return what of each path is not in the other: "t4/seed0" and "t16/seed1", say.

    >>> _differences([Path("runs/b/t4/seed0"), Path("runs/b/t16/seed0")])
    ['t4', 't16']
    """
    parts = [path.resolve().parts for path in paths]
    shared = set(parts[0]).intersection(*parts[1:])
    return ["/".join(p for p in own if p not in shared) for own in parts]


def _photo(settings: Settings) -> Photo | None:
    """Return the photograph to begin with, None where none is named.

    Raises:
        DataError: a file cannot be read.
    """
    if settings.image is None:
        return None
    files = [
        None if name is None else File.read(Path(name).expanduser())
        for name in (settings.image, settings.mask)
    ]
    assert files[0] is not None
    return Photo(files[0], files[1])


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
