"""Results of runs: what every table, plot and page starts from."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os.path import commonpath, relpath
from pathlib import Path

import pandas as pd

from ffd_lightning.analysis.runs import (
    COLUMN_KEYS,
    described_protocols,
    evaluate_command,
    find_protocol,
    find_runs,
    is_mixed,
    load_runs,
    load_samples,
    load_settings,
    own_protocol,
    select,
)
from ffd_lightning.analysis.status import run_status
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import REGIME_COLORS, regime_title
from ffd_lightning.run_folder import RunFolder

SETTINGS = ["category", "regime", "templates"]
"""What tells runs apart, but for their seed."""


@dataclass(frozen=True)
class Results:
    """Results of runs under one protocol.

    Attributes:
        folder: that holds them.
        runs: those that can be read, by category, regime (as in the paper), templates and seed.
        table: a row per run: `run`, `setup` (its folder's name, without the seed's where runs that
            share it are seeds of each other), `category`, `regime`, `templates`, `seed`,
            `setting` (see `load_runs`), `state` (finished, failed, running, interrupted),
            `reason` (of having no scores, "" with scores),
            `protocol`, `seconds_per_step` and, with scores, the mean of each measure of each shape,
            `effective_templates` and `num_samples`.
        samples: as `load_samples` gives them, of the finished runs; no rows where there are none.
        protocol: that the scores are of.
        damaged: runs that cannot be read: folder and reason.
    """

    folder: Path
    runs: list[RunFolder]
    table: pd.DataFrame
    samples: pd.DataFrame
    protocol: ProtocolDescription
    damaged: dict[str, str]

    @classmethod
    def read(cls, folder: Path, protocol: str | None = None) -> Results:
        """Read a folder.

        Args:
            folder: runs are at any depth below it.
            protocol: the name of one; that of most runs where it is None.

        Raises:
            ConfigError: no run was evaluated under this protocol.
            DataError: no run.
        """
        return cls.of(find_runs(folder), protocol, folder)

    @classmethod
    def of(
        cls, found: Sequence[RunFolder], protocol: str | None = None, folder: Path | None = None
    ) -> Results:
        """Read runs; `folder` is what they are named from, by default what all are in."""
        folder = folder or Path(commonpath([run.path for run in found]))
        damaged = {run.path: why for run in found if (why := _damage(run))}
        runs = [run for run in found if run.path not in damaged]
        if not runs:
            raise DataError(
                f"{folder} holds no run that can be read"
                + "".join(f" ({path}: {why})" for path, why in list(damaged.items())[:1])
                + ": name the folder of a run, or of a sweep (runs/NAME)"
            )
        try:
            chosen = find_protocol(runs, protocol)
        except DataError:  # none has come to its evaluation
            chosen = ProtocolDescription(protocol or own_protocol(runs[0]).split("/")[0])
        kept = ["run", *SETTINGS, "seed", "setting", "state", "reason", "seconds_per_step"]
        table = load_runs(runs)[kept]
        order = table.sort_values([*SETTINGS, "seed"], key=_in_order, kind="stable").index
        table, runs = table.loc[order].reset_index(drop=True), [runs[k] for k in order]
        table["state"] = [str(run_status(run)["state"]) for run in runs]
        parts = []
        for place, run in enumerate(runs):
            try:
                part, why = _scores(run, str(table.loc[place, "state"]), chosen), ""
                parts.append(part)
            except DataError as error:
                why = str(error)
            if why and table.loc[place, "state"] != "failed":
                table.loc[place, "reason"] = why
        samples = pd.concat(parts, ignore_index=True) if parts else pd.DataFrame({"run": []})
        names = pd.Series([relpath(run.path, folder) for run in runs])
        setups = names.map(_setup)
        mixed = table.groupby(setups)["setting"].transform("nunique") > 1
        table = table.assign(protocol=chosen.name, setup=setups.where(~mixed, names))
        if parts:
            table = table.merge(_means(samples, chosen), how="left", on="run")
        shown = {relpath(path, folder): why for path, why in damaged.items()}
        return cls(folder, runs, table, samples, chosen, shown)

    @property
    def scored(self) -> pd.DataFrame:
        """The rows of the table that have scores."""
        return self.table[self.table["run"].isin(self.samples["run"])]

    @property
    def unscored(self) -> pd.DataFrame:
        """The other rows."""
        return self.table[~self.table["run"].isin(self.samples["run"])]

    @cached_property
    def settings(self) -> pd.DataFrame:
        """A row per run, a column per setting; see `load_settings`."""
        return load_settings(self.runs)

    @cached_property
    def keys(self) -> list[str]:
        """What tells runs apart, but for their seed: their setup where `SETTINGS` do not."""
        twice = self.table.duplicated([*SETTINGS, "seed"]).any()
        return ["setup", *SETTINGS] if twice or is_mixed(self.table, SETTINGS) else SETTINGS

    @cached_property
    def told_apart_by(self) -> list[str]:
        """What settings with scores are told apart by, but for category and seed."""
        names = ["setup"] if "setup" in self.keys else ["regime", "templates"]
        return [name for name in names if self.scored[name].nunique() > 1]

    def title(self, row: Mapping[str, object]) -> str:
        """Return what tells the setting of a row of the table from the others, for people."""
        words = {"regime": lambda v: regime_title(str(v)), "templates": lambda v: f"T = {v}"}
        names = self.told_apart_by or ["regime"]
        return ", ".join(str(words.get(name, str)(row[name])) for name in names)

    def name(self, run: str) -> str:
        """Return a run's folder, as seen from that of all."""
        return relpath(run, self.folder)


def _setup(name: str) -> str:
    """Return a run's folder without the part that names its seed.

    >>> _setup("joint/r/t4-8views/seed0")
    'joint/r/t4-8views'
    >>> _setup("table/b/t8/seed1_schedule.steps-50")
    'table/b/t8/schedule.steps-50'
    """
    parts = [re.sub(r"^seed\d+_?", "", part) for part in Path(name).parts]
    return "/".join(part for part in parts if part) or "."


def _in_order(column: pd.Series) -> pd.Series:
    """Return what sorts a column: regimes as in the paper, numbers by size."""
    if column.name != "regime":
        return column
    places = {name: place for place, name in enumerate(REGIME_COLORS)}
    return column.map(lambda regime: (places.get(regime, len(places)), str(regime)))


def _damage(run: RunFolder) -> str:
    """Return why a run's configuration cannot be read, "" where it can."""
    try:
        settings = run.settings
    except ConfigError as error:
        return str(error)
    named = all(select(settings, key) is not None for key in COLUMN_KEYS.values())
    return "" if named else "config.yaml names no category, regime, templates or seed"


def _scores(run: RunFolder, state: str, protocol: ProtocolDescription) -> pd.DataFrame:
    """Return a run's samples.

    Raises:
        DataError: it has none that can be read; the message says why.
    """
    if state != "finished":
        # Samples may be there from before: they would not be of the run as it is now.
        on = "it is at work" if state == "running" else "its command, given again, resumes it"
        raise DataError(f"it was begun and is not finished: {on}")
    found = described_protocols(run)
    again = evaluate_command(run.path, protocol.name)
    if not found:
        raise DataError(f"it has no evaluation of this version: {again}")
    if protocol.name not in found:
        raise DataError(f"evaluated under protocol {' and '.join(found)} only: {again}")
    if found[protocol.name] != protocol:
        raise DataError(f"evaluated under another protocol of this name: {again} restart=true")
    return load_samples([run], protocol.name)


def _means(samples: pd.DataFrame, protocol: ProtocolDescription) -> pd.DataFrame:
    """Return a row per run: means of its measures, and how it selects templates."""
    names = [f"{s}_{m.name}" if s else m.name for s in CANDIDATES for m in protocol.metrics]
    groups = samples.groupby("run", sort=False)
    means = groups[[name for name in names if name in samples]].mean()
    means["effective_templates"] = [
        effective_templates(part["template"].value_counts()) for _, part in groups
    ]
    means["num_samples"] = groups.size()
    return means.reset_index()
