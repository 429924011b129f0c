"""Which settings of a sweep are ahead, by every measure: what the page's answers and marks say."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import pandas as pd

from ffd_lightning.analysis.budget import QUALITY
from ffd_lightning.analysis.compare import compare_runs, compare_with_retrieval
from ffd_lightning.analysis.ranking import Ranking, rankings
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.analysis.sentences import group_label
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Measure
from ffd_lightning.palette import REGIME_COLORS, regime_title

FOLDED = Measure("folded", QUALITY["folded"][1], factor=QUALITY["folded"][2])
"""Judged beside the protocol's measures, which say nothing of how a mesh is deformed."""

_MOST = 12  # settings that are compared: of more, the best
_RETRIEVAL = {"the network": "the network", "retrieval": "what its encoder retrieves"}


@dataclass(frozen=True)
class Standing:
    """Rankings of the settings of a sweep.

    Attributes:
        rankings: by measure, for each category and, where all settings are in all, their mean.
        titles: of the groups that are ranked, by label, for people.
        colors: of groups that are regimes, by label.
        left_out: settings that are too many to be compared.
        error: why nothing is ranked, "" where something is, or where there is only one setting.
    """

    rankings: Mapping[str, Sequence[Ranking]]
    titles: Mapping[str, str]
    colors: Mapping[str, str]
    left_out: int = 0
    error: str = ""

    def overall(self, measure: str) -> Ranking | None:
        """Return the ranking that speaks for the whole sweep: of the mean, or the only one."""
        found = self.rankings.get(measure, ())
        return next((r for r in found if r.over_all), found[0] if len(found) == 1 else None)

    def of_category(self, measure: str, category: str) -> Ranking | None:
        """Return the ranking of a category."""
        return next((r for r in self.rankings.get(measure, ()) if r.category == category), None)


def judged(sweep: Sweep) -> list[Measure]:
    """Return the measures that settings are ranked by."""
    folded = sweep.samples.get("folded", pd.Series(dtype=float))
    known = len(folded) > 0 and bool(folded.notna().all())
    return [*sweep.protocol.measures, *([FOLDED] if known else [])]


def standing(sweep: Sweep) -> Standing:
    """Rank the settings of a sweep; where it has but one, the network and what it retrieves."""
    if sweep.samples.empty:
        return Standing({}, {}, {})
    by = sweep.told_apart_by
    labels = {} if not by else {run: setting_label(sweep, run) for run in sweep.scored["run"]}
    several = sweep.scored.assign(label=sweep.scored["run"].map(labels))
    try:
        if by and several.groupby("category")["label"].nunique().max() > 1:
            return _of_settings(sweep, by, labels)
        return _beside_retrieval(sweep)
    except DataError as error:
        return Standing({}, {}, {}, error=str(error))


def setting_label(sweep: Sweep, run: str) -> str:
    """Return what comparisons call the setting of a run."""
    row = sweep.table[sweep.table["run"] == run].iloc[0]
    return group_label(sweep.told_apart_by, [row[name] for name in sweep.told_apart_by])


def setting_title(row: Mapping[str, object], names: Sequence[str]) -> str:
    """Return a setting for people, made of some of its columns.

    >>> setting_title({"regime": "e", "templates": 4}, ["regime", "templates"])
    'e, entropy, T = 4'
    """
    words = {"regime": lambda v: regime_title(str(v)), "templates": lambda v: f"T = {v}"}
    return ", ".join(str(words.get(name, str)(row[name])) for name in names)


def _of_settings(sweep: Sweep, by: list[str], labels: dict[str, str]) -> Standing:
    """Rank settings by each measure."""
    measures = judged(sweep)
    protocol = replace(sweep.protocol, measures=tuple(measures))
    scored = sweep.scored.assign(label=sweep.scored["run"].map(labels))
    samples = sweep.samples.merge(scored[["run", "setup", "label"]], on="run")
    found = {}
    for measure in measures:
        means = samples.groupby("label", sort=False)[measure.name].mean()
        order = means.sort_values(ascending=not measure.higher_is_better, kind="stable")
        kept = samples[samples["label"].isin(order.index[:_MOST])]
        found[measure.name] = rankings(
            compare_runs(kept, protocol, measure.name, by, settings=sweep.settings), measure
        )
    rows = {str(row["label"]): row for row in scored.to_dict("records")}
    titles = {label: setting_title(row, by) for label, row in rows.items()}
    one_each = scored.groupby("regime")["label"].nunique().max() == 1
    colors = {
        label: REGIME_COLORS[row["regime"]]
        for label, row in rows.items()
        if one_each and row["regime"] in REGIME_COLORS
    }
    return Standing(found, titles, colors, max(0, len(rows) - _MOST))


def _beside_retrieval(sweep: Sweep) -> Standing:
    """Rank the network and what its encoder retrieves; nothing without references."""
    protocol = sweep.protocol
    if not all(f"feature_retrieval_{m.name}" in sweep.samples for m in protocol.measures):
        return Standing({}, {}, {})
    found = {
        m.name: rankings(compare_with_retrieval(sweep.samples, protocol, m.name), m)
        for m in protocol.measures
    }
    return Standing(found, _RETRIEVAL, {})
