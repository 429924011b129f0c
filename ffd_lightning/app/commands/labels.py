"""Say how well the runs of a folder transfer part labels.

    ffd labels runs/demo

The runs must have been evaluated under protocol parts: ffd evaluate run=DIR protocol=parts
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.app.settings import MISSING

MAIN = "runs"


@dataclass
class Settings:
    """Which runs.

    Attributes:
        runs: a folder that holds runs, at any depth.
    """

    runs: str = MISSING


def main(settings: Settings) -> int:
    """Print how well labels fit: by shape, by part and by the template's family."""
    from ffd_lightning.analysis.parts import label_samples, label_tables
    from ffd_lightning.analysis.runs import require_runs
    from ffd_lightning.analysis.selection import run_families
    from ffd_lightning.terminal import table_console, terminal_width

    folder = Path(settings.runs)
    runs = require_runs(folder)
    samples, families = label_samples(runs), run_families(runs)
    console = table_console()
    for table in label_tables(samples, families, folder):
        console.print(table.rich(terminal_width()))
    if not families:
        print("structural families: none are known of this data")
    return 0
