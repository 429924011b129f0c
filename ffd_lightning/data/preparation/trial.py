"""What a category holds, seen from a few shapes that are prepared on trial."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path

from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.overview import count_warnings, write_sheet
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import Source, SourceShape
from ffd_lightning.errors import DataError

TRIAL = 16
"""Shapes of a category that are prepared on trial, evenly spread over its ids."""


@dataclass
class Finding:
    """What was found of one category.

    Attributes:
        name: the category.
        problem: why none of its shapes can be prepared, "" if some can.
        shapes: how many there are.
        unusable: those that are seen to be so without loading them, and why, by id.
        templates, absent: the paper's ids, and those of them that are absent or cannot be used.
        prepared: the prepared set's folder if it is there.
        trial: how many shapes were tried.
        rejected: of those, which were rejected, and why.
        warnings: of the shapes tried or prepared, counted by kind, a line of text.
        sheet: a line of text on where the contact sheet of those shapes is.
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


@dataclass(frozen=True)
class _Chosen(Source):
    """Some shapes of a source."""

    source: Source
    ids: tuple[str, ...]

    def shape_ids(self, category: str) -> list[str]:
        return list(self.ids)

    def load(self, category: str, shape_id: str) -> SourceShape:
        return self.source.load(category, shape_id)

    def fingerprint(self, category: str) -> dict[str, object]:
        return {}


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
        prepared = None
        with tempfile.TemporaryDirectory() as folder:
            if preparation.target.exists():
                finding.prepared = preparation.target
                prepared = PreparedSet.open(preparation.target)
            elif usable:
                source = _Chosen(preparation.source, tuple(usable))
                trial = replace(preparation, source=source, root=Path(folder), progress=False)
                prepared = replace(trial, limit=TRIAL).run()
                finding.rejected = prepared.rejected
                finding.trial = len(prepared) + len(prepared.rejected)
            if prepared is not None:
                finding.warnings = count_warnings(prepared)
                finding.sheet = "" if sheet is None else write_sheet(prepared, sheet)
    except DataError as error:
        return Finding(finding.name, problem=str(error))
    return finding
