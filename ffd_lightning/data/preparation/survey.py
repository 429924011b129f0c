"""What a category holds and what preparing it will cost, before anything is done."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.assembly import assemble
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.preparation.summary import count_warnings, write_sheet
from ffd_lightning.data.preparation.workers import make_shapes
from ffd_lightning.data.sources.base import Survey
from ffd_lightning.errors import DataError
from ffd_lightning.parallel import available_cores

TRIAL = 16
"""Models of a category that are prepared on trial, evenly spread over its sorted ids."""


@dataclass
class Finding:
    """What was found of one category.

    Attributes:
        name: the category.
        problem: why nothing can be said of it, "" if something can.
        models: how many there are.
        survey: what was seen without loading them.
        templates, absent: the paper's ids, and those of them that are absent or cannot be used.
        prepared: the prepared set's folder if it is there.
        trial: shapes tried; reasons of those that were rejected.
        seconds, megabytes: what preparing all of it takes, on this machine.
        warnings: of the shapes tried or prepared, counted by kind, in words.
        sheet: where a picture of the shapes tried or prepared is, in words.
    """

    name: str
    problem: str = ""
    models: int = 0
    survey: Survey = field(default_factory=lambda: Survey(""))
    templates: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()
    prepared: Path | None = None
    trial: int = 0
    rejected: dict[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    megabytes: float = 0.0
    warnings: str = ""
    sheet: str = ""


def examine(preparation: Preparation, of_shapenet: bool, sheet: Path | None = None) -> Finding:
    """Look at one category and prepare a few of its shapes on trial.

    Args:
        preparation: of the category.
        of_shapenet: look for the paper's templates.
        sheet: where to draw shapes to, None for nowhere.
    """
    category, source = preparation.category, preparation.source
    try:
        ids = source.shape_ids(category)
        finding = Finding(category, models=len(ids), survey=source.survey(category))
        if of_shapenet:
            finding.templates = paper_templates(category)
            usable = set(ids) - set(finding.survey.faults)
            finding.absent = tuple(i for i in finding.templates if i not in usable)
        if preparation.target.exists():
            finding.prepared = preparation.target
            _look_at(PreparedSet.open(preparation.target), finding, sheet)
        else:
            usable_ids = [i for i in ids if i not in finding.survey.faults]
            _try_some(preparation, usable_ids, finding, sheet)
    except DataError as error:
        return Finding(category, problem=str(error))
    return finding


def _look_at(prepared: PreparedSet, finding: Finding, sheet: Path | None) -> None:
    """Note what is to be said of shapes that are prepared, and draw them."""
    finding.warnings = count_warnings(prepared)
    if sheet is not None:
        finding.sheet = write_sheet(prepared, sheet)


def _try_some(
    preparation: Preparation, ids: list[str], finding: Finding, sheet: Path | None
) -> None:
    """Prepare some shapes in a folder of their own, and reckon from them for all."""
    places = np.unique(np.linspace(0, len(ids) - 1, min(len(ids), TRIAL)).astype(int))
    trial = [ids[k] for k in places]
    if not trial:
        return
    times: list[float] = []
    with tempfile.TemporaryDirectory() as folder:
        recipe = replace(preparation.recipe, folder=Path(folder))
        workers = preparation.workers or available_cores()
        failures = make_shapes(
            recipe, trial, workers, preparation.timeout, lambda: times.append(time.monotonic())
        )
        finding.rejected = {i: failures[i].reason for i in trial if i in failures}
        sizes = [recipe.file(i).stat().st_size for i in trial if i not in finding.rejected]
        if sizes:
            target = Path(folder) / f"{preparation.category}-trial"
            assemble(recipe, trial, finding.rejected, preparation.settings, target)
            _look_at(PreparedSet.open(target), finding, sheet)
    finding.trial = len(trial)
    # From the first shape's end on: workers take seconds to start, once.
    rate = (len(times) - 1) / (times[-1] - times[0]) if len(times) > 1 else 0.0
    finding.seconds = len(ids) / rate if rate else 0.0
    finding.megabytes = len(ids) * sum(sizes) / len(trial) / 1e6
