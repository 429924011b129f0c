"""Sections: settings of the runs, and runs without results."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ffd_lightning.analysis.report.elements import Table, cell
from ffd_lightning.analysis.report.sweep import Sweep, varying
from ffd_lightning.analysis.runs import decides

_MANY = 12  # rows that are shown unasked


@dataclass(frozen=True)
class Settings:
    """The settings of the runs.

    Attributes:
        different: names of those in which runs differ.
        table: of those, by run.
        runs: how many there are.
        many: so many rows that they are shown when they are asked for.
        shared: the others, as on the command line.
    """

    key: ClassVar[str] = "settings"
    title: ClassVar[str] = "Settings"

    different: Sequence[str]
    table: Table
    runs: int
    many: bool
    shared: Sequence[str]


@dataclass(frozen=True)
class Missing:
    """The runs that are not in the results, and why."""

    key: ClassVar[str] = "missing"
    title: ClassVar[str] = "Runs without results"

    table: Table


def settings(sweep: Sweep) -> Settings:
    """Return the settings in which runs differ, and those that all share."""
    table = sweep.settings
    kept = [key for key in table if decides(key) or key == "seed"]
    shown = table[kept].map(cell)
    different = varying(shown, kept)
    names = [sweep.name(str(run)) for run in shown.index]
    if len(different) > len(names):  # a row per setting, so that the table is not too wide
        head, rows = ["setting", *names], [[key, *shown[key]] for key in different]
    else:
        head = ["run", *different]
        values = shown[different].to_numpy().tolist()
        rows = [[name, *row] for name, row in zip(names, values, strict=True)]
    return Settings(
        different,
        Table("Settings that differ", head, rows, text=head),
        len(names),
        len(rows) > _MANY,
        [f"{key}={shown[key].iloc[0]}" for key in sorted(set(kept) - set(different))],
    )


def missing(sweep: Sweep) -> Missing | None:
    """Return the runs that are not in the results, None where all are."""
    rows = [
        [sweep.name(row["run"]), row["state"], str(row["reason"])]
        for row in sweep.unscored.to_dict("records")
    ]
    rows += [[name, "damaged", why] for name, why in sweep.damaged.items()]
    head = ["run", "state", "reason"]
    return Missing(Table("Runs without results", head, rows, text=["reason"])) if rows else None
