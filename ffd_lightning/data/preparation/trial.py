"""What a category holds, seen from a few shapes that are prepared on trial."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.overview import count_warnings, write_sheet
from ffd_lightning.data.preparation.preparation import Preparation, spread
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
    finding = Finding(preparation.category)
    try:
        ids = preparation.shape_ids
        unusable = preparation.source.rejected(finding.name)
        finding.shapes = len(ids)
        finding.unusable = {i: unusable[i] for i in ids if i in unusable}
        usable = [i for i in ids if i not in unusable]
        if of_shapenet:
            finding.templates = paper_templates(finding.name)
            finding.absent = tuple(i for i in finding.templates if i not in usable)
        with tempfile.TemporaryDirectory() as folder:
            if preparation.target.exists():
                finding.prepared = preparation.target
                prepared: PreparedSet | None = PreparedSet.open(preparation.target)
            else:
                chosen = spread(usable, TRIAL)
                trial = replace(preparation, root=Path(folder), limit=None, progress=False)
                prepared, finding.rejected = trial.try_some(chosen)
                finding.trial = len(chosen)
            if prepared is not None:
                finding.warnings = count_warnings(prepared)
                finding.sheet = "" if sheet is None else write_sheet(prepared, sheet)
    except DataError as error:
        return Finding(finding.name, problem=str(error))
    return finding
