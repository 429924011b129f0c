"""What Hydra calls when a run or a sweep has ended."""

import contextlib
import json
import os
import shlex
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from hydra.core.utils import JobReturn, JobStatus
from hydra.experimental.callback import Callback
from omegaconf import DictConfig

from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.tables import best, summary_tables
from ffd_lightning.errors import DataError
from ffd_lightning.files import write_atomic
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.terminal import table_console, terminal_width


class SweepEnd(Callback):
    """Prints one table of the runs that were asked for; a failed one makes the exit code 1.

    Jobs may run in other processes and on other machines (joblib, submitit), which get a copy of
    this, and two may have the same run folder: each writes a file of how it ended.
    """

    _ends: Path | None = None  # of a single run there is none

    def on_multirun_start(self, config: DictConfig, **_: Any) -> None:
        """Make the place for the jobs' files."""
        folder = Path(config.hydra.sweep.dir).absolute()
        folder.mkdir(parents=True, exist_ok=True)
        self._ends = Path(tempfile.mkdtemp(prefix=".jobs-", dir=folder))

    def on_job_end(self, config: DictConfig, job_return: JobReturn, **_: Any) -> None:
        """Write which run this was, and whether it finished."""
        if self._ends is None or _is_further(job_return):
            return
        completed = job_return.status is JobStatus.COMPLETED  # else there is no value to ask for
        good = completed and job_return.return_value is not None
        end = {"path": str(Path(config.hydra.runtime.output_dir)), "good": good}
        write_atomic(self._ends / f"{config.hydra.job.num:06d}", json.dumps(end))

    def on_run_end(self, config: DictConfig, **kwargs: Any) -> None:
        """Print the table of a single run."""
        if not _is_further(kwargs["job_return"]):
            _print([config.hydra.runtime.output_dir])

    def on_multirun_end(self, config: DictConfig, **_: Any) -> None:
        """Print the table of a sweep."""
        assert self._ends is not None
        jobs = [json.loads(file.read_text()) for file in sorted(self._ends.glob("[0-9]*"))]
        shutil.rmtree(self._ends)
        _print([job["path"] for job in jobs])
        if config.callbacks.report and jobs:
            report_quietly(Path(config.hydra.sweep.dir))
        failed = [job["path"] for job in jobs if not job["good"]]
        if failed or not jobs:
            sys.exit(
                f"{len(failed)} of {len(jobs)} runs failed, see the messages above: "
                f"{', '.join(failed) or 'no job has ended'}. The same command tries them "
                "again"
            )


def _is_further(job_return: JobReturn) -> bool:
    """Return whether this was a further process of a distributed run, which returns no scores."""
    return job_return.status is JobStatus.COMPLETED and job_return.return_value == {}


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
        print(f"{folder}: {each}templates.png, reconstructions.png, evaluation/")


def report_quietly(folder: Path) -> None:
    """Write the report of a sweep; print what it decides and where it is.

    What fails in it stops nothing.
    """
    from ffd_lightning.analysis.report.page import verdict, write_report
    from ffd_lightning.app.open_run import open_run

    try:
        page, results = write_report(folder, open_run), Results.read(folder)
        with contextlib.suppress(DataError):  # there is nothing to compare
            print("", *verdict(results, best(results)), sep="\n")
        print(f"\nOpen {page.resolve().as_uri()} in a browser.")
    except Exception as error:
        print(
            f"no report of {folder} ({type(error).__name__}: {error}); the runs are not affected, "
            f"and ffd report {shlex.quote(str(folder))} tries again",
            file=sys.stderr,
        )
