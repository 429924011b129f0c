"""From a run or a checkpoint to what the viewer shows of it."""

from __future__ import annotations

from pathlib import Path

from ffd_lightning.app.build import build_data
from ffd_lightning.app.open_run import missing_data, read_config
from ffd_lightning.errors import UserError
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.shared import Photo, Shapes, Shared
from ffd_lightning.run_folder import RunFolder


def open_shared(
    path: Path | None,
    checkpoint: Path | None = None,
    data_root: str | None = None,
    device: str = "auto",
    photo: Photo | None = None,
) -> Shared:
    """Load a run, or a checkpoint alone, to look at.

    Args:
        path: the run folder or the checkpoint; None for the model that comes with the package.
        checkpoint: another one than the newest of the run.
        data_root: where the run's prepared data is, if not where it was.
        device: see `Predictor`.
        photo: that visitors see first.

    Raises:
        ConfigError: no run and no checkpoint.
        DataError: a damaged checkpoint, or a photograph that cannot be used.
    """
    predictor = Predictor.load(checkpoint or path, device)
    shapes, note = None, "A checkpoint alone: open a photo."
    if path is not None and path.is_dir():
        try:
            shapes, note = _test_shapes(RunFolder(path), data_root), ""
        except UserError as error:
            note = f"No test shapes, photos only: {error}"
    shared = Shared(predictor, shapes, photo, note)
    if photo is not None:
        shared.open_photo(photo)  # what is wrong with it is said before anybody looks
    return shared


def _test_shapes(run: RunFolder, data_root: str | None) -> Shapes:
    """Return the test shapes of a run, which must have been prepared.

    Raises:
        ConfigError: it is no run folder.
        DataError: the data is not there, or damaged.
    """
    data = build_data(read_config(run, data_root))
    if (missing := missing_data(run, data)) is not None:
        raise missing
    data.setup()
    return Shapes(data.prepared, data.split.test)
