"""What the runs of a sweep are doing."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
from rich.table import Table

from ffd_lightning.analysis.runs import require_runs
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.terminal import duration

_COLORS = {"finished": "green", "running": "cyan", "failed": "red", "interrupted": "yellow"}


def run_status(run: RunFolder) -> dict[str, object]:
    """Return what a run is doing.

    Returns:
        `run`, `state`: finished, failed, running, or interrupted (begun, but no process has it);
        `share` of the phase that is done (0 to 1, None where unknown), `phase` (training,
        evaluating), `seconds_left` of it (None where unknown) and `reason` of a failure.
    """
    status, progress = run.status, run.progress
    state = str(status.get("state", "interrupted"))
    if run.at_work:
        state = "running"
    elif state == "running":
        state = "interrupted"
    share = left = None
    phase = ""
    if state in ("running", "interrupted", "failed") and progress:
        phase, done, total = progress["phase"], progress["done"], progress["total"]
        if phase == "evaluating":
            done = _evaluated(run)
        share = done / total if total else None
        left = progress["seconds_left"] if state == "running" else None
    return {
        "run": str(run.path),
        "state": state,
        "phase": phase,
        "share": 1.0 if state == "finished" else share,
        "seconds_left": left,
        "reason": str(status.get("reason", "")) if state == "failed" else "",
    }


def _evaluated(run: RunFolder) -> int:
    """Return how many samples of an evaluation at work are done."""
    files = list((run.path / "evaluation").rglob("samples.partial"))
    return max((len(f.read_text(encoding="utf-8").splitlines()) - 1 for f in files), default=0)


def status_table(folder: Path) -> pd.DataFrame:
    """Return a row per run below a folder, as `run_status` tells it.

    Raises:
        DataError: there is none.
    """
    rows = [run_status(run) for run in require_runs(folder)]
    return pd.DataFrame(rows).astype({"share": float, "seconds_left": float})


def printed(rows: pd.DataFrame, folder: Path) -> Table:
    """Return a table for people.

    Args:
        rows: as `status_table` gives them.
        folder: that the runs are in; they are named as seen from it.
    """
    table = Table(box=None)
    for name in ("run", "state", "done", "time left", "reason"):
        table.add_column(name, justify="right" if name in ("done", "time left") else "left")
    for row in rows.to_dict("records"):
        color = _COLORS.get(row["state"], "white")
        table.add_row(
            str(Path(row["run"]).relative_to(folder)),
            f"[{color}]{row['state']}[/]",
            _done(row["share"], row["phase"], row["state"]),
            "" if pd.isna(row["seconds_left"]) else duration(row["seconds_left"]),
            row["reason"],
        )
    return table


def _done(share: float, phase: str, state: str) -> str:
    if pd.isna(share):
        return ""
    return f"{share:.0%} {phase}".rstrip() if state != "finished" else "100%"
