"""What a category holds, seen from a few shapes that are prepared on trial."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.overview import count_warnings, write_sheet
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import DataError

TRIAL = 16
"""Shapes of a category that are prepared on trial, evenly spread over its sorted ids."""


@dataclass
class Finding:
    """What was found of one category.

    Attributes:
        name: the category.
        problem: why nothing can be said of it, "" if something can.
        shapes: how many there are.
        unusable: those that are seen to be so without loading them, and why, by id.
        templates, absent: the paper's ids, and those of them that are absent or cannot be used.
        prepared: the prepared set's folder if it is there.
        trial: how many shapes were tried.
        rejected: of those, which were rejected, and why.
        warnings: of the shapes tried or prepared, counted by kind, in words.
        sheet: where a picture of the shapes tried or prepared is, in words.
        notes: what else there is to say.
    """

    name: str
    problem: str = ""
    shapes: int = 0
    unusable: dict[str, str] = field(default_factory=dict)
    templates: tuple[str, ...] = ()
    absent: tuple[str, ...] = ()
    prepared: Path | None = None
    trial: int = 0
    rejected: dict[str, str] = field(default_factory=dict)
    warnings: str = ""
    sheet: str = ""
    notes: list[str] = field(default_factory=list)


def examine(preparation: Preparation, of_shapenet: bool, sheet: Path | None = None) -> Finding:
    """Look at one category and prepare a few of its shapes on trial, in a temporary folder.

    Args:
        preparation: of the category.
        of_shapenet: look for the paper's templates.
        sheet: where to draw shapes to, None for nowhere.
    """
    category = preparation.category
    try:
        ids = preparation.shape_ids
        unusable = preparation.source.rejected(category)
        unusable = {i: unusable[i] for i in ids if i in unusable}
        finding = Finding(category, shapes=len(ids), unusable=unusable)
        usable = [i for i in ids if i not in unusable]
        if of_shapenet:
            finding.templates = paper_templates(category)
            finding.absent = tuple(i for i in finding.templates if i not in usable)
        if preparation.target.exists():
            finding.prepared = preparation.target
            _look_at(PreparedSet.open(preparation.target), finding, sheet)
        elif usable:
            places = np.unique(np.linspace(0, len(usable) - 1, min(len(usable), TRIAL)).astype(int))
            finding.trial = len(places)
            with tempfile.TemporaryDirectory() as folder:
                trial = replace(preparation, root=Path(folder), limit=None, progress=False)
                tried, finding.rejected = trial.try_some([usable[k] for k in places])
                if tried is not None:
                    _look_at(tried, finding, sheet)
    except DataError as error:
        return Finding(category, problem=str(error))
    return finding


def _look_at(prepared: PreparedSet, finding: Finding, sheet: Path | None) -> None:
    """Note what is to be said of shapes that are prepared, and draw them."""
    finding.warnings = count_warnings(prepared)
    if sheet is not None:
        finding.sheet = write_sheet(prepared, sheet)
