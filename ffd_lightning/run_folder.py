"""The folder of one run: what training writes and everything else reads."""

from __future__ import annotations

import json
import os
import shutil
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml
from filelock import FileLock, Timeout

from ffd_lightning.errors import ConfigError
from ffd_lightning.files import lock_folder, read_json, write_json

NOT_DECIDING = (
    *("trainer", "logger", "callbacks", "protocol", "evaluation", "paths", "preparation"),
    *("name", "restart", "plugins", "provided", "base"),
)
"""Groups and settings of where, how fast, how measured and under what name."""
_DECIDING = ("precision", "accumulate_grad_batches", "gradient_clip_val")  # of the trainer


def decides(key: str) -> bool:
    """Tell whether a setting, by its name on the command line, decides what a run computes.

    >>> [decides(key) for key in ("schedule.steps", "trainer.devices", "trainer.precision")]
    [True, False, True]
    """
    group, _, name = key.partition(".")
    return group not in NOT_DECIDING or (group == "trainer" and name in _DECIDING)


@dataclass(frozen=True)
class RunFolder:
    """Paths and status of one run.

    Holds `config.yaml`, `data.json`, `templates.csv` (in their order: ids, and how they cover the
    other shapes), `templates.png`, `outliers.csv` where the data has any, `checkpoints/last.ckpt`,
    TensorBoard's `events.*`, `status.json`, and once finished `template_ranking.csv`,
    `evaluation/<name>/{samples.csv, summary.json}` and `reconstructions.png`.
    """

    path: Path

    @classmethod
    def at(cls, path: str | Path) -> RunFolder:
        """Return the run folder that a user has named.

        Raises:
            ConfigError: it is none; runs below it are hinted at.
        """
        run = cls(Path(path).expanduser())
        if not run.path.exists():
            raise ConfigError(f"there is no run {run.path}")
        if not run.config.is_file():
            below = find_runs(run.path)
            below.sort(key=lambda run: (not run.checkpoint.is_file(), run.path))  # trained first
            hint = f": is {below[0].path} meant?" if below else ""
            raise ConfigError(f"{run.path} is not a run folder: it has no config.yaml{hint}")
        return run

    @property
    def config(self) -> Path:
        """The resolved configuration."""
        return self.path / "config.yaml"

    @property
    def settings(self) -> dict[str, Any]:
        """What `config.yaml` says: groups are dictionaries in it.

        Raises:
            ConfigError: there is no such file, or it is damaged, or not of a run.
        """
        try:
            content = yaml.safe_load(self.config.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise ConfigError(f"{self.path} is not a run folder: it has no config.yaml") from None
        except (OSError, ValueError, yaml.YAMLError) as error:
            reason = " ".join(str(error).split())
            raise ConfigError(f"{self.config} is damaged: {reason}") from None
        try:
            float(content["templates"]["count"]), content["category"]["name"]
            float(content["seed"]), content["regime"]["name"]
        except (TypeError, KeyError, ValueError):
            named = "category, regime, templates and seed of a run"
            raise ConfigError(f"{self.config} does not name {named}") from None
        if isinstance(content.get("data"), dict):
            content["data"].setdefault("variants", 0)  # of runs from before there were any
        return content

    @property
    def checkpoint(self) -> Path:
        """The newest checkpoint."""
        return self.path / "checkpoints" / "last.ckpt"

    def evaluation(self, name: str, of: str = "test") -> Path:
        """Folder of results.

        Args:
            name: how they were measured: `<protocol>`, then what differs from its defaults, as in
                `paper-points-300`. Results of one name can be compared between runs.
            of: `test`, the trained network on its test shapes, or whatever else was measured, which
                is below those: `val`, another checkpoint or prepared set.
        """
        folder = self.path / "evaluation" / name
        return folder if of == "test" else folder / of

    @property
    def status(self) -> dict[str, Any]:
        """What `status.json` says; {} for a run that never started or a file that is damaged."""
        return read_json(self.path / "status.json")

    @property
    def finished(self) -> bool:
        """Whether the run was trained and evaluated to its end."""
        return self.status.get("state") == "finished"

    def set_status(self, state: str, **details: Any) -> None:
        """Write `status.json`: state is running, finished or failed (then with a `reason`)."""
        content = {"state": state, "time": time.strftime("%Y-%m-%dT%H:%M:%S%z"), **details}
        write_json(self.path / "status.json", content)

    def discard(self) -> None:
        """Remove what a training left, and all that was found out about its network.

        Raises:
            ConfigError: another process evaluates it.
        """
        results = self.path / "evaluation"
        for folder in {file.parent for file in results.rglob(".lock")}:
            with lock_folder(folder, f"another process evaluates into {folder}: wait for it"):
                pass
        # The status first: what a kill leaves half removed must not be called finished.
        names = ["status.json", "progress.json", "data.json", "template_ranking.csv"]
        names += ["templates.csv", "templates.png", "outliers.csv", "reconstructions.png"]
        for file in (*(self.path / name for name in names), self.checkpoint):
            file.unlink(missing_ok=True)
        for events in self.path.glob("events.*"):
            events.unlink()
        if results.is_dir():
            shutil.rmtree(results)

    @property
    def data(self) -> dict[str, Any]:
        """What `data.json` says of the data that the run was trained on; {} where nothing does."""
        return read_json(self.path / "data.json")

    def set_data(self, record: Mapping[str, Any]) -> None:
        """Write `data.json`: see `FfdDataModule.record`; and the folder that paths start from."""
        write_json(self.path / "data.json", {**record, "folder": os.getcwd()})

    def is_of_data(self, sources: Mapping[str, Any]) -> bool:
        """Return whether the run was trained on the files that the data is of now, if it is known.

        Args:
            sources: of `FfdDataModule`.
        """
        return self.data.get("sources") in (None, json.loads(json.dumps(sources)))

    @property
    def progress(self) -> dict[str, Any]:
        """What `progress.json` says of a run at work; {} where there is nothing to say."""
        return read_json(self.path / "progress.json")

    def set_progress(self, phase: str, done: int, total: int, seconds_left: float | None) -> None:
        """Write `progress.json`: how much of a phase is done, and how long the rest takes."""
        content = {"phase": phase, "done": done, "total": total, "seconds_left": seconds_left}
        write_json(self.path / "progress.json", content)

    @property
    def at_work(self) -> bool:
        """Whether a process trains this run right now."""
        lock = self.path / ".lock"
        try:
            # Not made where it is missing: looking must not change a folder. Not at once: whoever
            # else looks has it for a moment, too.
            with FileLock(lock, timeout=0.1) if lock.exists() else nullcontext():
                return False
        except OSError as error:
            return isinstance(error, Timeout)

    def lock(self) -> AbstractContextManager[object]:
        """Take the run for this process, to train it; see `lock_folder`."""
        return lock_folder(
            self.path,
            f"another process is training {self.path}: wait for it, or choose another run with "
            "name=...",
        )


def find_runs(root: str | Path) -> list[RunFolder]:
    """Return all run folders below a path, in order of their names."""
    top, seen, found = os.path.realpath(root), set(), []
    for folder, below, files in os.walk(root, followlinks=True):
        real = os.path.realpath(folder)
        if real in seen or (os.path.islink(folder) and real.startswith(f"{top}{os.sep}")):
            below.clear()  # a link to what is found without
            continue
        seen.add(real)
        found += [Path(folder)] if "config.yaml" in files else []
    return [RunFolder(path) for path in sorted(found)]
