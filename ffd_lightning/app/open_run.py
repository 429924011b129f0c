"""From a run folder to its settings, its network and its data."""

from pathlib import Path
from typing import Any

from ffd_lightning.app.build import build_data
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import typed_config
from ffd_lightning.checkpoint import load_model
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.opened import OpenRun
from ffd_lightning.run_folder import RunFolder


def open_data(
    run: RunFolder, data_root: str | Path | None = None, prepare: bool = False
) -> FfdDataModule:
    """Return a run's data, not set up yet.

    Args:
        run: its folder.
        data_root: where its prepared data is, if not where it was.
        prepare: data that is not there will be prepared anew.

    Raises:
        ConfigError: its `config.yaml` cannot be used here.
        DataError: its data set cannot be read, or its prepared data is not there.
    """
    settings, there = run.settings, Path(run.data.get("folder", "."))  # from where it was trained
    for group in ("data", "split", "template_strategy"):
        own: Any = settings.get(group)
        for name in own if isinstance(own, dict) else ():
            place = there / str(own[name])
            if name.endswith(("root", "file")) and own[name] and place.exists():
                own[name] = str(place)
    try:
        config = typed_config(settings, TrainConfig)
    except ConfigError as error:
        raise ConfigError(f"{run.config} cannot be used here: {error}") from None
    config.paths.data = str(data_root or config.paths.data)
    data = build_data(config)
    try:
        absent = [found.target for found in data.preparations if not found.target.is_dir()]
    except DataError as error:
        raise DataError(
            f"the data set of {run.path} cannot be read: {error}. If it has moved, change its "
            f"place in {run.config}"
        ) from None
    if absent and not prepare:
        raise DataError(
            f"the prepared data of {run.path} is not there: {absent[0]}. data_root=DIR names the "
            "folder that it is in; ffd prepare makes it"
        )
    return data


def open_run(
    run: RunFolder,
    data_root: str | Path | None = None,
    checkpoint: Path | None = None,
    prepare: bool = False,
) -> OpenRun:
    """Open a run, finished or not, or another checkpoint of it; see `open_data`.

    Raises:
        ConfigError: no run, no checkpoint, or one that does not fit.
        DataError: data that is missing or damaged.
    """
    data = open_data(run, data_root, prepare)
    file = checkpoint or run.checkpoint
    model = load_model(file)
    data.setup()
    if not model.bank.is_of(data.bank):
        raise ConfigError(
            f"the templates of the checkpoint {file} are not {run.path}'s: it is of another "
            "network, or shapes were added, removed or changed since"
        )
    return OpenRun(run, model.network, data, model.step)
