"""What the runs of a sweep are doing."""

from contextlib import suppress
from pathlib import Path

import pandas as pd
from rich.table import Table
from rich.text import Text

from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.run_folder import RunFolder, find_runs
from ffd_lightning.terminal import duration

_COLORS = {"finished": "green", "running": "cyan", "failed": "red", "damaged": "red"}


def run_status(run: RunFolder) -> dict[str, object]:
    """Return what a run is doing.

    Returns:
        `run`, `state`: finished, failed, running, interrupted (begun, but no process has it), or
        damaged (its `config.yaml` is not a run's);
        `share` of the phase that is done (0 to 1, None where unknown), `phase` (training,
        evaluating), `seconds_left` of it (None where unknown) and `reason` of a failure.
    """
    # In this order: it may end just now.
    at_work, status, progress = run.at_work, run.status, run.progress
    state, reason = str(status.get("state", "interrupted")), str(status.get("reason", ""))
    state = "running" if at_work else "interrupted" if state == "running" else state
    if not status:
        try:
            _ = run.settings  # of a run, or of somebody else
        except ConfigError as error:
            state, reason = "damaged", str(error)
    share = 1.0 if state == "finished" else None
    if state != "finished":
        done, total = progress.get("done", 0), progress.get("total")
        if progress.get("phase") == "evaluating":  # the samples that are scored
            with suppress(FileNotFoundError):  # it may end just now
                files = (run.path / "evaluation").rglob("samples.partial")
                done = max((len(f.read_bytes().splitlines()) - 1 for f in files), default=0)
        share = done / total if total else None
    return {
        "run": str(run.path),
        "state": state,
        "phase": "" if state == "finished" else progress.get("phase", ""),
        "share": share,
        "seconds_left": progress.get("seconds_left") if state == "running" else None,
        "reason": reason if state in ("failed", "damaged") else "",
    }


def status_table(folder: Path) -> pd.DataFrame:
    """Return a row per run below a folder, as `run_status` gives it; a DataError without any."""
    rows = [run_status(run) for run in find_runs(folder)]
    if not rows:
        raise DataError(f"no run in {folder}: give a folder that ffd train has written to")
    return pd.DataFrame(rows).astype({"share": float, "seconds_left": float})


def printed(rows: pd.DataFrame, folder: Path) -> Table:
    """Return what `status_table` gives for people; runs are named as seen from `folder`."""
    table = Table(box=None)
    table.add_column("run", overflow="fold")
    table.add_column("state")
    table.add_column("done", justify="right")
    table.add_column("time left", justify="right")
    table.add_column("reason")
    for row in rows.to_dict("records"):
        color = _COLORS.get(row["state"], "yellow")
        table.add_row(
            Text(str(Path(row["run"]).relative_to(folder))),  # as it is: "[...]" is markup else
            Text(row["state"], color),
            "" if pd.isna(row["share"]) else f"{row['share']:.0%} {row['phase']}".rstrip(),
            "" if pd.isna(row["seconds_left"]) else duration(row["seconds_left"]),
            Text(row["reason"]),
        )
    return table
