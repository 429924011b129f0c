"""The folder of one run: what training writes and everything else reads."""

from __future__ import annotations

import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from ffd_lightning.errors import ConfigError, DataError


def write_atomic(path: Path, text: str) -> None:
    """Write a small text file so that a reader, or a kill, never sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with temporary.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)


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
        try:
            return dict(json.loads((self.path / "status.json").read_text(encoding="utf-8")))
        except (OSError, ValueError):
            return {}

    @property
    def finished(self) -> bool:
        """Whether the run was trained and evaluated to its end."""
        return self.status.get("state") == "finished"

    def set_status(self, state: str, **details: Any) -> None:
        """Write `status.json`: state is running, finished or failed (then with a `reason`)."""
        content = {"state": state, "time": time.strftime("%Y-%m-%dT%H:%M:%S%z"), **details}
        write_atomic(self.path / "status.json", json.dumps(content, indent=2) + "\n")

    def lock(self) -> FileLock:
        """Take the run for this process (a context manager); freed however the process ends.

        Raises:
            ConfigError: another process trains this run.
            DataError: the folder cannot be written.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock = FileLock(self.path / ".lock")
            lock.acquire(timeout=0)
        except Timeout:
            raise ConfigError(
                f"another process is training {self.path}: wait for it, or choose another run "
                "with name=..."
            ) from None
        except OSError as error:
            raise DataError(f"cannot write the run folder {self.path}: {error}") from None
        return lock
