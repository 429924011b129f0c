"""What Hydra calls when a run or a sweep has ended."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hydra.core.utils import JobReturn, JobStatus
from hydra.experimental.callback import Callback
from omegaconf import DictConfig
from rich.console import Console

from ffd_lightning.analysis.runs import find_runs, load_runs
from ffd_lightning.analysis.tables import summary_tables
from ffd_lightning.run_folder import RunFolder


class SummaryTable(Callback):
    """Prints one table of the runs that were asked for; a failed one makes the exit code 1."""

    def __init__(self) -> None:
        self._paths: list[Path] = []
        self._failed = 0

    def on_job_end(self, config: DictConfig, job_return: JobReturn, **_: Any) -> None:
        """Note which run this was, and whether it came to its end."""
        if job_return.return_value == {}:
            return  # a further process of a distributed run
        self._failed += job_return.status is not JobStatus.COMPLETED or (
            job_return.return_value is None
        )
        self._paths.append(Path(config.hydra.runtime.output_dir))

    def on_run_end(self, config: DictConfig, **_: Any) -> None:
        """Print the table of a single run."""
        if self._paths:
            self._print([RunFolder(p) for p in self._paths])

    def on_multirun_end(self, config: DictConfig, **_: Any) -> None:
        """Print the table of a sweep."""
        # Launchers that run jobs in other processes leave no paths here: read the whole sweep.
        runs = [RunFolder(p) for p in self._paths] or find_runs(Path(config.hydra.sweep.dir))
        finished = self._print(runs)
        if self._failed or not finished:
            sys.exit(f"{self._failed} of {len(runs)} runs failed: see the messages above")

    def _print(self, runs: list[RunFolder]) -> bool:
        runs = [run for run in runs if run.config.exists()]
        if not runs:
            return False
        table = load_runs(runs)
        console = Console(width=None if sys.stdout.isatty() else 120)
        for part in summary_tables(table):
            console.print(part)
        for run in runs:
            if run.finished:
                print(f"{run.path}: reconstructions.png, evaluation/, tensorboard/")
        return bool((table["state"] == "finished").all())
