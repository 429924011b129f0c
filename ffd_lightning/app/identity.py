"""Which settings make two runs the same."""

from __future__ import annotations

from typing import Any

from omegaconf import OmegaConf

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.errors import ConfigError
from ffd_lightning.files import write_atomic
from ffd_lightning.run_folder import RunFolder

# What may differ between the two halves of a resumed run: where it runs, not what it computes.
_MACHINE_KEYS = frozenset(
    (
        "trainer",
        "preparation",
        "paths",
        "logger",
        "callbacks",
        "evaluation",
        "restart",
        "name",
        "data.residency",
    )
)


def check_folder(cfg: TrainConfig, run: RunFolder) -> None:
    """Write `config.yaml`, or make sure that the one there is of the same run.

    Raises:
        ConfigError: the folder holds a run with other settings; the message lists them.
    """
    content = OmegaConf.to_yaml(OmegaConf.structured(cfg))
    if run.config.exists() and not cfg.restart:
        try:
            earlier = OmegaConf.load(run.config)
        except Exception as error:
            raise ConfigError(
                f"{run.config} is damaged ({error}): remove it or add restart=true"
            ) from None
        differences = _differences(earlier, OmegaConf.create(content))
        if differences:
            raise ConfigError(
                f"{run.path} holds a run with other settings: {'; '.join(differences)}. Choose "
                "another run with name=..., or add restart=true to discard what is there"
            )
    if cfg.restart:
        run.checkpoint.unlink(missing_ok=True)
        (run.path / "status.json").unlink(missing_ok=True)
        (run.path / "progress.json").unlink(missing_ok=True)
        for events in (run.path / "tensorboard").glob("events.*"):
            events.unlink()
    write_atomic(run.config, content)


def _differences(earlier: Any, now: Any, prefix: str = "") -> list[str]:
    result = []
    for key in sorted(set(earlier) | set(now)):
        if f"{prefix}{key}" in _MACHINE_KEYS:
            continue
        a, b = earlier.get(key), now.get(key)
        if OmegaConf.is_dict(a) and OmegaConf.is_dict(b):
            result += _differences(a, b, f"{prefix}{key}.")
        elif a != b:
            result.append(f"{prefix}{key} was {a}, now {b}")
    return result
