"""Section: results beside the paper's Table 3, and in what the experiments differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ffd_lightning.analysis.paper import comparison_table
from ffd_lightning.analysis.paper_facts import PROTOCOL
from ffd_lightning.analysis.paper_text import stacked
from ffd_lightning.analysis.report.elements import Table
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.analysis.runs import load_runs
from ffd_lightning.errors import DataError


@dataclass(frozen=True)
class BesidePaper:
    """Results beside the paper's.

    Attributes:
        table: of both; None where there is nothing to compare.
        measured: what the numbers are; why there are none, where there are none.
        differences: in what the experiments differ.
        compared: how much was compared.
    """

    key: ClassVar[str] = "beside_paper"
    title: ClassVar[str] = "Beside the paper"

    table: Table | None
    measured: str
    differences: Sequence[str] = ()
    compared: str = ""


def beside_paper(sweep: Sweep) -> BesidePaper:
    """Return the finished runs beside the paper's Table 3, whatever protocol the page is about."""
    try:
        table = comparison_table(load_runs(sweep.runs, PROTOCOL))
    except DataError as error:
        return BesidePaper(None, str(error))
    head, rows = stacked(table)
    told = (table.attrs[name] for name in ("measured", "differences", "compared"))
    return BesidePaper(Table("Beside the paper's Table 3", head, rows), *told)
