"""The folder of one run: what training writes and everything else reads."""

from __future__ import annotations

import csv
import io
import json
import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from omegaconf import OmegaConf

from ffd_lightning.config import TrainConfig
from ffd_lightning.errors import ConfigError, DataError

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


_GLANCE = 1.0  # seconds; whoever only looks (`RunFolder.at_work`) has a lock for less


def write_atomic(path: Path, text: str) -> None:
    """Write a small text file so that a reader, or a kill, never sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with temporary.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows, at least one and all of the same columns, as `write_atomic` does."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_atomic(path, buffer.getvalue())


def lock_folder(folder: Path, taken: str) -> FileLock:
    """Take a folder for this process (a context manager); freed however the process ends.

    Args:
        folder: made where it is missing.
        taken: what to say when another process has it.

    Raises:
        ConfigError: another process has it.
        DataError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / ".lock")
        lock.acquire(timeout=_GLANCE)
    except Timeout:
        raise ConfigError(taken) from None
    except OSError as error:
        raise DataError(f"cannot write the folder {folder}: {error}") from None
    return lock


def _read_json(file: Path) -> dict[str, Any]:
    """Return what a file holds, {} where there is none or it is damaged."""
    try:
        return dict(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


@dataclass(frozen=True)
class RunFolder:
    """Paths and status of one run.

    Holds `config.yaml`, `checkpoints/last.ckpt`, `tensorboard/`, `status.json`, and once finished
    `evaluation/<protocol>/{samples.csv, summary.json}`, `template_ranking.csv` and
    `reconstructions.png`.
    """

    path: Path

    @property
    def config(self) -> Path:
        """The resolved configuration."""
        return self.path / "config.yaml"

    @property
    def checkpoint(self) -> Path:
        """The newest checkpoint."""
        return self.path / "checkpoints" / "last.ckpt"

    def evaluation(self, protocol: str) -> Path:
        """Folder of one protocol's results."""
        return self.path / "evaluation" / protocol

    @property
    def status(self) -> dict[str, Any]:
        """What `status.json` says; {} for a run that never started or a file that is damaged."""
        return _read_json(self.path / "status.json")

    @property
    def finished(self) -> bool:
        """Whether the run was trained and evaluated to its end."""
        return self.status.get("state") == "finished"

    def set_status(self, state: str, **details: Any) -> None:
        """Write `status.json`: state is running, finished or failed (then with a `reason`)."""
        content = {"state": state, "time": time.strftime("%Y-%m-%dT%H:%M:%S%z"), **details}
        write_atomic(self.path / "status.json", json.dumps(content, indent=2) + "\n")

    @property
    def progress(self) -> dict[str, Any]:
        """What `progress.json` says of a run at work; {} where there is nothing to say."""
        return _read_json(self.path / "progress.json")

    def set_progress(self, phase: str, done: int, total: int, seconds_left: float | None) -> None:
        """Write `progress.json`: how much of a phase is done, and how long the rest takes."""
        content = {"phase": phase, "done": done, "total": total, "seconds_left": seconds_left}
        write_atomic(self.path / "progress.json", json.dumps(content) + "\n")

    @property
    def at_work(self) -> bool:
        """Whether a process trains this run right now."""
        lock = FileLock(self.path / ".lock")
        try:
            # Not made where it is missing: looking must not change a folder.
            if not (self.path / ".lock").exists():
                return False
            lock.acquire(timeout=0)
        except Timeout:
            return True
        except OSError:
            return False
        lock.release()
        return False

    def lock(self) -> FileLock:
        """Take the run for this process, to train it; see `lock_folder`."""
        return lock_folder(
            self.path,
            f"another process is training {self.path}: wait for it, or choose another run with "
            "name=...",
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
