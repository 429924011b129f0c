"""From runs and checkpoints to what the viewer shows of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ffd_lightning.app.build import build_data
from ffd_lightning.app.open_run import missing_data, read_config
from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.photo import Photo
from ffd_lightning.inference.viewer.session import NetworkTitle
from ffd_lightning.inference.viewer.studio import HeldOutShapes, Studio
from ffd_lightning.palette import COLORS, REGIME_COLORS, regime_title
from ffd_lightning.run_folder import RunFolder


def open_studio(
    paths: Sequence[Path],
    checkpoint: Path | None = None,
    data_root: str | None = None,
    device: str = "auto",
    photo: Photo | None = None,
) -> Studio:
    """Load runs, or checkpoints alone, to look at.

    Args:
        paths: one or two run folders or checkpoints; none for the model that comes with the
            package.
        checkpoint: another one than the newest of a single run.
        data_root: where the runs' prepared data is, if not where it was.
        device: see `Predictor`.
        photo: that visitors see first.

    Raises:
        ConfigError: no run and no checkpoint, or two that cannot be compared.
        DataError: a damaged checkpoint, or a photograph that cannot be used.
    """
    sources: Sequence[Path | None] = [checkpoint] if checkpoint else paths or [None]
    predictors = [Predictor.load(source, device) for source in sources]
    models = [predictor.model for predictor in predictors]
    _check_comparable(models, paths)
    shapes, note = None, "A checkpoint alone: open a photo."
    if paths and all(path.is_dir() for path in paths):
        try:
            data = [_open_data(RunFolder(path), data_root) for path in paths]
        except UserError as error:
            note = f"No test shapes, photos only: {error}"
        else:
            shapes, note = held_out_shapes(data, paths), ""
    heading, titles = ", ".join(models[0].categories), network_titles(models, paths)
    studio = Studio(predictors, titles, models[0].render, shapes, heading, note, photo)
    if photo is not None:
        studio.open_photo(photo)  # what is wrong with it is said before anybody looks
    return studio


def _check_comparable(models: Sequence[TrainedModel], paths: Sequence[Path]) -> None:
    """Refuse two networks that do not see the same images.

    Raises:
        ConfigError: they were trained on other categories, or on images of another size or camera.
    """
    seen = [
        f"{', '.join(model.categories)}, images of {model.render.height} x {model.render.width}"
        for model in models
    ]
    if len(set(seen)) > 1:
        both = "; ".join(f"{path} is of {what}" for path, what in zip(paths, seen, strict=True))
        raise ConfigError(f"runs= must be of one category and one image size: {both}")
    if any(model.render != models[0].render for model in models):
        raise ConfigError(
            f"runs= must be of images from the same cameras: data.render of {paths[0]} and "
            f"{paths[1]} differ"
        )


def _open_data(run: RunFolder, data_root: str | None) -> FfdDataModule:
    """Open the data of a run, which must have been prepared.

    Raises:
        ConfigError: it is no run folder.
        DataError: the data is not there, or damaged.
    """
    data = build_data(read_config(run, data_root))
    if (missing := missing_data(run, data)) is not None:
        raise missing
    data.setup()
    return data


def held_out_shapes(data: Sequence[FfdDataModule], paths: Sequence[Path]) -> HeldOutShapes:
    """Return the test shapes that runs have in common.

    Args:
        data: of each run, set up.
        paths: of the runs, for messages.

    Raises:
        ConfigError: they are of different data.
        DataError: they have no test shape in common.
    """
    first = data[0]
    ids = first.split.test
    for path, other in zip(paths[1:], data[1:], strict=True):
        sets = [list(own.record()["prepared"].values()) for own in (first, other)]
        if sets[0] != sets[1]:
            names = [f"{p} of {', '.join(s)}" for p, s in zip((paths[0], path), sets, strict=True)]
            raise ConfigError(f"runs= must be of the same data: {names[0]}, {names[1]}")
        theirs = set(other.split.test)
        ids = tuple(i for i in ids if i in theirs)
    if not ids:
        raise DataError("runs= have no test shape in common: their templates or splits differ")
    return HeldOutShapes(first.prepared, ids)


def network_titles(models: Sequence[TrainedModel], paths: Sequence[Path]) -> list[NetworkTitle]:
    """Return how networks are called: by their regimes, and by what else tells them apart."""
    regimes = [str(model.record.get("regime", "unknown regime")) for model in models]
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
    """Return what of each path is not in the other.

    >>> _differences([Path("runs/b/t4/seed0"), Path("runs/b/t16/seed0")])
    ['t4', 't16']
    """
    parts = [path.expanduser().resolve().parts for path in paths]
    shared = set(parts[0]).intersection(*parts[1:])
    return ["/".join(part for part in own if part not in shared) for own in parts]
