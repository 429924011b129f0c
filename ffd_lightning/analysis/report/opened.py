"""The runs that are looked at: each is opened once, for its examples and its templates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ffd_lightning.analysis.report.gallery import choose_runs
from ffd_lightning.analysis.report.stills import thumbnail
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.errors import UserError
from ffd_lightning.evaluation.opened import OpenRun, RunOpener
from ffd_lightning.imaging.camera import Camera


@dataclass(frozen=True)
class Opened:
    """Runs that could be opened.

    Attributes:
        runs: by their paths, in the order of the sweep.
        errors: why others could not, by their paths.
    """

    runs: Mapping[str, OpenRun]
    errors: Mapping[str, str]

    def pictures(self, wanted: set[str]) -> dict[str, bytes]:
        """Return pictures of templates, PNG, by id: of those wanted that runs here have."""
        found: dict[str, bytes] = {}
        for run in self.runs.values():
            bank = run.data.bank
            for name, mesh in zip(bank.ids, bank.meshes, strict=True):
                if name in wanted and name not in found:
                    found[name] = thumbnail(mesh, Camera())
        return found


def open_runs(sweep: Sweep, open_run: RunOpener, limit: int) -> Opened:
    """Open one run of each setting, of at most `limit` settings."""
    chosen = choose_runs(sweep.scored, limit, sweep.keys) if limit else []
    folders = {str(run.path): run for run in sweep.runs}
    runs: dict[str, OpenRun] = {}
    errors: dict[str, str] = {}
    for name in chosen:
        try:
            runs[name] = open_run(folders[name])
        except (UserError, OSError) as error:
            errors[name] = str(error)
    return Opened(runs, errors)
