"""What Hydra calls when a run or a sweep has ended."""

from __future__ import annotations

import json
import logging
import math
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout
from hydra.core.utils import JobReturn, JobStatus
from hydra.experimental.callback import Callback
from omegaconf import DictConfig, OmegaConf

from ffd_lightning.analysis.tables import summary_tables
from ffd_lightning.app.checks import device_problems
from ffd_lightning.app.studies.study import count_runs, swept_values
from ffd_lightning.errors import UserError
from ffd_lightning.files import write_atomic
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.terminal import duration, table_console, terminal_width

log = logging.getLogger(__name__)

_NOTES = ".jobs-"
_YOUNG = 60  # seconds
_locks: dict[Path, FileLock] = {}  # not in the callback, which travels to other processes


class SummaryTable(Callback):
    """Prints one table of the runs that were asked for; a failed one makes the exit code 1.

    After each job of a sweep it says how many are done, and how long the others will take.

    Jobs may run in other processes (joblib, submitit), which get a copy of this: each writes how it
    ended to a file, in a folder that all machines of a cluster see.
    """

    def __init__(self) -> None:
        self._notes: Path | None = None  # of a single run there is none
        self._total = 0
        self._began: float | None = None

    def on_multirun_start(self, config: DictConfig, **_: Any) -> None:
        """Make the place for the jobs' notes; refuse what no job could do."""
        problems = device_problems(config) if _at_once(config.hydra.launcher) else []
        if problems:
            sys.exit(f"error: {problems[0]}")  # Hydra would make a warning of other exceptions
        folder = Path(config.hydra.sweep.dir).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        for notes in folder.glob(f"{_NOTES}*"):
            _clear(notes)  # of a sweep that was killed, unless it is at work
        self._notes = Path(tempfile.mkdtemp(prefix=_NOTES, dir=folder))
        self._total = _jobs_in_all(config)
        _locks[self._notes] = FileLock(self._notes / ".lock")
        _locks[self._notes].acquire()

    def on_job_start(self, config: DictConfig, **_: Any) -> None:
        """Note the time, unless the run is finished already and will be read."""
        there = RunFolder(Path(config.hydra.runtime.output_dir)).finished
        self._began = None if there and not config.restart else time.monotonic()

    def on_job_end(self, config: DictConfig, job_return: JobReturn, **_: Any) -> None:
        """Note which run this was, and whether it came to its end."""
        if self._notes is None or _is_further(job_return):
            return
        came_through = job_return.status is JobStatus.COMPLETED  # else there is no value to ask for
        good = came_through and job_return.return_value is not None
        path = str(Path(config.hydra.runtime.output_dir))
        number = OmegaConf.select(config, "hydra.job.num", default=0)
        note = self._notes / f"{number}.json"
        took = None if self._began is None else time.monotonic() - self._began
        content = {"path": path, "good": good, "seconds": took}
        write_atomic(note, json.dumps(content))  # other jobs may read it while it is written
        if self._total > 1:
            self._tell(config, _read(self._notes))

    def _tell(self, config: DictConfig, notes: list[dict[str, Any]]) -> None:
        """Log how many jobs are done, and how long the others take if they are like those."""
        times = [note["seconds"] for note in notes if note["good"] and note["seconds"] is not None]
        rest, at_once = self._total - len(notes), _at_once(config.hydra.launcher)
        left = ""
        if rest > 0 and times and at_once:
            seconds = math.ceil(rest / at_once) * sum(times) / len(times)
            left = f", about {duration(seconds)} left"
        log.info("%d of %d runs are done%s", len(notes), self._total, left)

    def on_run_end(self, config: DictConfig, **given: Any) -> None:
        """Print the table of a single run."""
        if not _is_further(given["job_return"]):
            _print([config.hydra.runtime.output_dir])

    def on_multirun_end(self, config: DictConfig, **_: Any) -> None:
        """Print the table of a sweep."""
        if self._notes is None:  # Hydra made a warning of what went wrong at the start
            sys.exit("nothing is known of the jobs: see the warnings above")
        jobs = _read(self._notes)
        _locks.pop(self._notes).release()
        shutil.rmtree(self._notes)
        _print([job["path"] for job in jobs])
        if config.callbacks.report and jobs:
            report_quietly(Path(config.hydra.sweep.dir))
        failed = [job["path"] for job in jobs if not job["good"]]
        if failed or not jobs:
            sys.exit(
                f"{len(failed)} of {len(jobs)} runs failed, see the messages above: "
                f"{', '.join(failed) or 'no job came to its end'}. The same command tries them "
                "again"
            )


def _is_further(job_return: JobReturn) -> bool:
    """Tell whether this was a further process of a distributed run, which returns no scores."""
    return job_return.status is JobStatus.COMPLETED and job_return.return_value == {}


def _read(notes: Path) -> list[dict[str, Any]]:
    """Return the jobs that ended, in their order: run folder, whether all was well, seconds."""
    files = sorted(notes.glob("*.json"), key=lambda file: int(file.stem))
    return [json.loads(file.read_text(encoding="utf-8")) for file in files]


def _print(paths: list[str]) -> None:
    runs = [RunFolder(Path(path)) for path in dict.fromkeys(paths)]  # jobs may share a folder
    runs = [run for run in runs if run.config.exists()]
    if not runs:
        return
    for table in summary_tables(runs, terminal_width()):
        table_console().print(table)
    if finished := [str(run.path) for run in runs if run.finished]:
        each = "" if len(finished) == 1 else f"{len(finished)} runs, each with "
        folder = os.path.commonpath(finished)
        print(f"{folder}: {each}templates.png, reconstructions.png, evaluation/, tensorboard/")


def _jobs_in_all(config: DictConfig) -> int:
    """Return how many jobs a sweep has, 0 if its overrides alone do not tell."""
    sweeper = OmegaConf.select(config, "hydra.sweeper._target_", default="")
    overrides = OmegaConf.select(config, "hydra.overrides.task", default=[])
    if "BasicSweeper" not in sweeper or not all(swept_values(x) for x in overrides):
        return 0
    return count_runs(overrides)


def _at_once(launcher: Any) -> int:
    """Return how many jobs run at once, 0 where a cluster decides."""
    from ffd_lightning.app.machine import jobs_at_once

    here = ("BasicLauncher", "joblib")
    return jobs_at_once(launcher) if any(x in launcher._target_ for x in here) else 0


def _clear(notes: Path) -> None:
    """Remove the notes of a sweep that no process has any more."""
    lock = FileLock(notes / ".lock")
    try:
        if time.time() - notes.stat().st_mtime < _YOUNG:
            return  # perhaps made a moment ago, and not locked yet
        lock.acquire(timeout=0)
    except (Timeout, OSError):
        return
    lock.release()
    shutil.rmtree(notes, ignore_errors=True)


def report_quietly(folder: Path) -> None:
    """Write the report of a sweep and print where it is; what fails in it stops nothing."""
    from ffd_lightning.analysis.report.page import write_report
    from ffd_lightning.app.open_run import open_run

    try:
        print(f"\n{write_report(folder, open_run)}")
    except Exception as error:
        print(
            f"no report of {folder} ({type(error).__name__}: {error}); the runs are not affected, "
            f"and ffd report {folder} tries again",
            file=sys.stderr,
        )


def print_beside_paper(folder: Path) -> None:
    """Print the finished runs of a study beside the paper's Table 3, as far as there are any."""
    from ffd_lightning.analysis.paper import beside_paper
    from ffd_lightning.analysis.runs import load_runs, require_runs

    console = table_console()
    try:
        table = beside_paper(load_runs(require_runs(folder), "paper"))
    except (UserError, OSError) as error:
        print(f"nothing is set beside the paper's Table 3: {error}", file=sys.stderr)
        return
    print()
    console.print(table.rich(console.width))
