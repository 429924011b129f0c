"""Say what the runs of a folder are doing.

    ffd status runs/demo

A run is finished, failed, running, damaged (its config.yaml is not a run's), or interrupted: begun,
but no process has it. The same command that began it resumes it. The exit code is 1 if a run has
failed.
"""

from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.components import MISSING

MAIN = "runs"


@dataclass
class Settings:
    """Which runs.

    Attributes:
        runs: a folder that holds runs, at any depth.
    """

    runs: str = MISSING


def main(settings: Settings) -> int:
    """Print a table of the runs; 1 if one has failed."""
    from ffd_lightning.analysis.status import printed, status_table
    from ffd_lightning.terminal import table_console

    folder = Path(settings.runs)
    rows = status_table(folder)
    table_console().print(printed(rows, folder))
    counts = rows["state"].value_counts()
    print(", ".join(f"{count} {state}" for state, count in counts.items()))
    return int((rows["state"] == "failed").any())
