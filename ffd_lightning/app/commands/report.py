"""Write one page about all runs of a folder.

    ffd report runs/demo
    ffd report runs=runs/demo protocol=modern data_root=data gallery=4

The page, report.html in that folder, holds everything that it shows and opens from disk, without a
network. Scores are shown under the protocol that most trainings ended with, unless one is named.
"""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from ffd_lightning.components import MISSING, NotNegative

MAIN = "runs"


@dataclass
class Settings:
    """Which runs, and what is shown of them.

    Attributes:
        runs: a folder that holds runs, at any depth.
        protocol: whose scores are shown; by default that of most trainings.
        data_root: where the runs' prepared data is, if not where they left it.
        gallery: of how many runs examples are shown, 0 for none.
    """

    runs: str = MISSING
    protocol: str | None = None
    data_root: str | None = None
    gallery: NotNegative = 12


def main(settings: Settings) -> int:
    """Write the page and print where it is."""
    from ffd_lightning.analysis.report.page import write_report
    from ffd_lightning.app.open_run import open_run

    opener, folder = partial(open_run, data_root=settings.data_root), Path(settings.runs)
    print(write_report(folder, opener, settings.protocol, settings.gallery))
    return 0
