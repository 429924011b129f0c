"""Studies that were kept, and what their numbers say about the paper's claims."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from ffd_lightning.analysis.archive import read_archive
from ffd_lightning.analysis.compare import LEVEL, compare_runs, holm, interval, rank_score
from ffd_lightning.analysis.parts import family_table
from ffd_lightning.analysis.selection import selection_table
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription

PAPER = ("b", "w", "e", "r")
MARGIN = 0.1
"""Chamfer distances within a tenth count as about equal: so do those in the paper's mean row."""

CATEGORIES = 6
"""So many trainings, a category each, say something without several seeds."""

HOLDS, FAILS, OPEN = "holds", "does not hold", "not decided"


@dataclass(frozen=True)
class Study:
    """Runs of a study, without their folders.

    Attributes:
        name: of the study.
        samples, curves, settings: as `archive.Archive` has them; here all settings are columns.
        protocol: that the samples were measured under.
        about: of each archive that it was read from.
        families: of the templates that each run selects.
    """

    name: str
    samples: pd.DataFrame
    curves: pd.DataFrame
    settings: pd.DataFrame
    protocol: ProtocolDescription
    about: tuple[Mapping[str, Any], ...]
    families: Mapping[str, Mapping[str, str]]

    @classmethod
    def read(cls, data: Path, name: str) -> Study:
        """Read `<name>.zip`, or all archives of the folder `<name>`, which are parts of one study.

        Raises:
            DataError: it is not there, or its parts were measured in different ways.
        """
        files = [data / f"{name}.zip"] if (data / f"{name}.zip").is_file() else []
        parts = [read_archive(file) for file in files or sorted((data / name).glob("*.zip"))]
        if not parts:
            raise DataError(f"no study {name} in {data}: keep one with keep {name} RUNS")
        if len({part.protocol for part in parts}) > 1:
            raise DataError(f"the parts of {name} were measured under several protocols")
        known = []
        for part in parts:
            shared = pd.DataFrame(
                [part.about["settings"]] * len(part.settings), part.settings.index
            )
            known.append(pd.concat([part.settings, shared], axis=1))
        families: dict[str, Mapping[str, str]] = {}
        for part in parts:
            families |= part.families
        return cls(
            name,
            pd.concat([part.samples for part in parts], ignore_index=True),
            pd.concat([part.curves for part in parts], ignore_index=True),
            pd.concat(known),
            parts[0].protocol,
            tuple(part.about for part in parts),
            families,
        )

    def where(self, **columns: Any) -> Study:
        """Return the part of it in which these columns of the samples have one of these values.

        Raises:
            DataError: nothing is left.
        """
        kept = self.samples
        for column, wanted in columns.items():
            values = [wanted] if isinstance(wanted, (str, int)) else list(wanted)
            kept = kept[kept[column].isin(values)]
        if kept.empty:
            raise DataError(f"study {self.name} has no runs with {columns}")
        return replace(self, samples=kept)

    def by_count(self) -> Study:
        """Return the runs of the study `template_counts` with their number as `setup`: "T = 8".

        Those that rank the templates, under r, are left out: they have thirty templates too.
        """
        part = self.where(regime=["b", "e"])
        names = "T = " + part.samples["templates"].astype(str)
        return replace(part, samples=part.samples.assign(setup=names))

    def with_regimes_of(self, other: Study) -> Study:
        """Return it with the other's runs in place of its own of the same regimes.

        What the two studies set differently is taken not to matter to the regimes that stay.
        """
        stay = set(self.samples["regime"]) - set(other.samples["regime"])
        parts = [self.where(regime=stay), other]
        settings = pd.concat([part.about_runs for part in parts])
        changed = [
            key
            for key in settings
            if not key.startswith("regime.")
            and set(self.settings[key].map(repr)) != set(other.settings[key].map(repr))
        ]
        return replace(
            self,
            name=f"{self.name}+{other.name}",
            samples=pd.concat([part.samples for part in parts], ignore_index=True),
            curves=pd.concat([part.curves for part in parts], ignore_index=True),
            settings=settings.drop(columns=changed),
            about=self.about + other.about,
            families={**self.families, **other.families},
        )

    @cached_property
    def runs(self) -> pd.DataFrame:
        """A row per run: what tells it apart, its mean scores, how it selects, its settings."""
        keys = ["run", "category", "regime", "templates", "seed"]
        means = self.samples.groupby(keys, sort=False).mean(numeric_only=True).reset_index()
        main = self.protocol.main_metric.name
        chosen = selection_table(self.samples, self.protocol, self.families, main)
        runs = means.merge(chosen.drop(columns=keys[1:]), on="run")
        return runs.join(self.settings.drop(columns=keys, errors="ignore"), on="run")

    def per_seed(self, regime: str, column: str, **columns: Any) -> pd.Series:
        """Return a column of the runs of a regime, mean over categories, by seed."""
        runs = self.where(regime=regime, **columns).runs
        return runs.groupby("seed")[column].mean()

    @property
    def one_seed(self) -> bool:
        """Tell whether categories stand in for seeds: all runs have one, of enough categories."""
        seeds, categories = self.samples["seed"], self.samples["category"]
        return seeds.nunique() == 1 and categories.nunique() >= CATEGORIES

    @property
    def about_runs(self) -> pd.DataFrame:
        """Settings of the runs that the samples are of."""
        return self.settings.loc[self.samples["run"].unique()]


def differences(
    study: Study,
    pairs: Iterable[Sequence[Any]],
    measures: Sequence[str],
    by: str = "regime",
    settings: bool = True,
) -> pd.DataFrame:
    """Compare pairs of groups of runs on the same test shapes.

    With `one_seed`, interval and test of the mean are over categories, each a training of its own,
    and no difference of a single category is called shown.

    Args:
        study: that has them.
        pairs: (a, b), values of the column.
        measures: columns of the samples.
        by: the column.
        settings: make sure that runs differ in nothing else.

    Returns:
        As `compare_runs` gives it, a - b, with p corrected for all rows of this table (Holm), or
        for those over categories alone. `shown` asks every pair of seeds too.
    """
    tables = []
    for a, b in pairs:
        part = study.where(**{by: [a, b]})
        known = part.settings if settings else None
        for measure in measures:
            table = compare_runs(part.samples, part.protocol, measure, by, settings=known)
            if str(table["a"].iloc[0]) not in (str(a), f"T={a}"):
                table[["a", "b", "mean_a", "mean_b"]] = table[["b", "a", "mean_b", "mean_a"]]
                table["difference"] *= -1
                table["low"], table["high"] = -table["high"], -table["low"]
            tables.append(_over_categories(table) if study.one_seed else table)
    table = pd.concat(tables, ignore_index=True)
    if study.one_seed:
        mean = _is_mean(table)
        table.loc[mean, "p_corrected"] = holm(table.loc[mean, "p"].tolist())
        table["shown"] &= mean & (table["p_corrected"] < LEVEL)
        return table
    # `shown` of the single comparisons asks whether mean and ranks go in one direction; a stricter
    # p can only take it away.
    table["p_corrected"] = holm(table["p"].tolist())
    table["shown"] &= (table["p_corrected"] < LEVEL) & (table["agreement"] == 1)
    return table


def _over_categories(table: pd.DataFrame) -> pd.DataFrame:
    """Return it with interval, p and `shown` of the mean taken over categories."""
    mean = _is_mean(table)
    of_categories = table.loc[~mean, "difference"].to_numpy(float)
    low, high = interval([of_categories])
    z = rank_score([of_categories])
    sign = 1 if of_categories.mean() > 0 else -1
    table.loc[mean, ["low", "high", "p"]] = low, high, 2 * stats.norm.sf(abs(z))
    table.loc[mean, "shown"] = bool(min(sign * low, sign * high) > 0 and sign * z > 0)
    return table


@dataclass(frozen=True)
class Verdict:
    """What a study says about a claim.

    Attributes:
        word: "holds", "does not hold" or "not decided".
        why: the numbers that decide it.
    """

    word: str
    why: str


@dataclass(frozen=True)
class Claim:
    """A claim and the rule by which it is judged; see `CLAIMS`.

    Attributes:
        text: the claim.
        rule: when it holds and when it does not, for readers.
        judge: of a study.
    """

    text: str
    rule: str
    judge: Any

    def __call__(self, study: Study) -> Verdict:
        """Judge it."""
        return self.judge(study)


def _is_mean(table: pd.DataFrame) -> pd.Series:
    return table["category"].str.startswith("mean of ")


def overall(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows over all categories; those of the only category where there is one."""
    mean = _is_mean(table)
    return table[mean] if mean.any() else table


def _span(row: Any, factor: float) -> str:
    return f"{factor * row.difference:+.1f} [{factor * row.low:+.1f}, {factor * row.high:+.1f}]"


def _told(rows: pd.DataFrame, factor: float) -> str:
    return "; ".join(f"{row.a} - {row.b}: {_span(row, factor)}" for row in rows.itertuples())


def about_equal(study: Study) -> Verdict:
    """Judge whether the regimes' deformed Chamfer distances differ by less than `MARGIN`."""
    pairs = [(a, b) for i, b in enumerate(PAPER) for a in PAPER[i + 1 :]]
    rows = overall(differences(study, pairs, ["chamfer"]))
    room = MARGIN * rows[["mean_a", "mean_b"]].min(axis=1)
    inside = (rows["low"] > -room) & (rows["high"] < room)
    outside = rows["shown"] & ((rows["low"] > room) | (rows["high"] < -room))
    word = HOLDS if inside.all() else FAILS if outside.any() else OPEN
    return Verdict(word, f"Chamfer x 1000: {_told(rows, 1000)}")


def best_undeformed(study: Study) -> Verdict:
    """Judge whether regime r selects the nearest templates."""
    rows = overall(differences(study, [("r", x) for x in "bwe"], ["undeformed_chamfer"]))
    lower, higher = rows["shown"] & (rows["high"] < 0), rows["shown"] & (rows["low"] > 0)
    word = HOLDS if lower.all() else FAILS if higher.any() else OPEN
    return Verdict(word, f"Undeformed Chamfer x 1000: {_told(rows, 1000)}")


def _effective(study: Study, regimes: Iterable[str], **columns: Any) -> dict[str, pd.Series]:
    return {r: study.per_seed(r, "effective_templates", **columns) for r in regimes}


_OVER = {False: "mean and range over seeds", True: "mean over categories"}


def _counts(values: Mapping[str, pd.Series]) -> str:
    told = []
    for regime, series in values.items():
        span = f" ({series.min():.1f} to {series.max():.1f})" if len(series) > 1 else ""
        told.append(f"{regime} {series.mean():.1f}{span}")
    return ", ".join(told)


def _selects_more(study: Study, a: str, b: str) -> int:
    """Return 1 where a is shown to select more templates than b, -1 where fewer, else 0."""
    if study.one_seed:
        runs = study.runs.pivot_table("effective_templates", "category", "regime")
        z = rank_score([(runs[a] - runs[b]).to_numpy(float)])
        return int(np.sign(z)) if 2 * stats.norm.sf(abs(z)) < LEVEL else 0
    more, fewer = (study.per_seed(regime, "effective_templates") for regime in (a, b))
    return int(more.min() > fewer.max()) - int(more.max() < fewer.min())


def spread(study: Study) -> Verdict:
    """Judge whether e and r select more templates than b."""
    found = [_selects_more(study, regime, "b") for regime in "er"]
    word = HOLDS if min(found) > 0 else FAILS if min(found) < 0 else OPEN
    counts = _counts(_effective(study, "ber"))
    return Verdict(word, f"Effective templates, {_OVER[study.one_seed]}: {counts}")


def collapse(study: Study) -> Verdict:
    """Judge whether b's effective templates are less than a quarter of T in every run."""
    runs = study.where(regime="b").runs
    share = runs["effective_templates"] / runs["templates"]
    word = HOLDS if (share < 1 / 4).all() else FAILS if (share > 1 / 2).all() else OPEN
    low, high = runs["effective_templates"].min(), runs["effective_templates"].max()
    why = f"{low:.1f} to {high:.1f} of T = {runs['templates'].max()} in {len(runs)} runs"
    return Verdict(word, f"b's effective templates: {why}")


def opposite(study: Study) -> Verdict:
    """Judge whether w selects fewer templates than b on sofas, and more on tables."""
    sofa, table = (_effective(study, "bw", category=name) for name in ("sofa", "table"))
    apart = [
        (sofa["w"].max() < sofa["b"].min(), sofa["w"].min() > sofa["b"].max()),
        (table["w"].min() > table["b"].max(), table["w"].max() < table["b"].min()),
    ]
    word = HOLDS if all(a for a, _ in apart) else FAILS if any(b for _, b in apart) else OPEN
    why = f"Effective templates on sofas: {_counts(sofa)}; on tables: {_counts(table)}"
    return Verdict(word, why)


def one_is_enough(study: Study) -> Verdict:
    """Judge whether one template's Chamfer distance is within `MARGIN` of thirty's."""
    pairs = [("T = 1", "T = 30")]
    rows = overall(differences(study.by_count(), pairs, ["chamfer"], "setup", settings=False))
    row, room = rows.iloc[0], MARGIN * rows["mean_b"].iloc[0]
    inside, outside = row["high"] < room, row["low"] > room and row["shown"]
    word = HOLDS if inside else FAILS if outside else OPEN
    return Verdict(word, f"Chamfer x 1000: {_told(rows, 1000)}; T = 30: {1000 * row['mean_b']:.1f}")


def semantically_close(study: Study) -> Verdict:
    """Judge whether labels fit better that come from a template of the image's own family."""
    table = family_table(study.samples, study.families)
    rows = table[table["family"] == "same - other"]
    better, worse = int((rows["low"] > 0).sum()), int((rows["high"] < 0).sum())
    most = len(rows) / 2
    word = HOLDS if better > most and not worse else FAILS if worse > most else OPEN
    means = table.groupby("family")["mean"].mean()
    return Verdict(
        word,
        f"Part IoU x 100, mean over {len(rows)} runs: {100 * means['same']:.1f} with a template of "
        f"the image's family, {100 * means['other']:.1f} with another; the interval of the "
        f"difference is above 0 in {better} runs, below 0 in {worse}",
    )


CLAIMS = {
    "equal": Claim(
        "The regimes b, w, e and r deform about equally well.",
        f"Holds if all six intervals lie within ±{MARGIN:.0%} of the smaller distance. Does not "
        "hold if a difference is shown whose whole interval lies outside.",
        about_equal,
    ),
    "undeformed": Claim(
        "r selects the templates that are nearest as they are.",
        "Holds if r is shown to be lower than b, w and e. Does not hold if it is shown to be "
        "higher than one of them.",
        best_undeformed,
    ),
    "spread": Claim(
        "e and r spread the selection over more templates than b.",
        "Holds if every seed of e and of r has more effective templates than every seed of b. "
        "Does not hold if e or r has fewer in every pair of seeds. With one seed, Wilcoxon's test "
        "over categories takes the place of the seeds.",
        spread,
    ),
    "collapse": Claim(
        "b's selection is dominated by a few templates.",
        "Holds if b has less than a quarter of T effective templates in every run. Does not hold "
        "if it has more than half of T in every run.",
        collapse,
    ),
    "opposite": Claim(
        "w has opposite effects: fewer templates than b on sofas, more on tables.",
        "Holds if every pair of seeds says so on both. Does not hold if every pair of seeds says "
        "the contrary on one of them.",
        opposite,
    ),
    "one": Claim(
        "One template is about as good as thirty.",
        f"Holds if T = 1 is at most {MARGIN:.0%} worse, with its whole interval. Does not hold if "
        "it is shown to be worse by more.",
        one_is_enough,
    ),
    "labels": Claim(
        "Part labels transfer where the template is semantically close.",
        "Close is a template of the structural family that the image shows. Holds if the interval "
        "of the difference is above 0 in most runs and below 0 in none. Does not hold if it is "
        "below 0 in most.",
        semantically_close,
    ),
}
"""The paper's claims, by name: those of its sections 5.2 and 5.3."""
