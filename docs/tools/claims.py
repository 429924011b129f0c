"""The paper's claims, what kept results say about them, and the rules of the verdicts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from ffd_lightning.analysis.compare import (
    LEVEL,
    compare,
    holm,
    interval,
    is_mean,
    rank_score,
    turned,
)
from ffd_lightning.analysis.parts import family_table
from ffd_lightning.analysis.results import Results
from ffd_lightning.errors import DataError

PAPER = ("b", "w", "e", "r")
MARGIN = 0.1
"""Chamfer distances within a tenth count as about equal: so do those in the paper's mean row."""

CATEGORIES = 6
"""So many trainings, a category each, say something without several seeds."""

HOLDS, FAILS, OPEN = "holds", "does not hold", "not decided"


def read(data: Path, name: str) -> Results:
    """Read `<name>.zip`, or all files of the folder `<name>`, which are parts of one study."""
    files = [data / f"{name}.zip"] if (data / f"{name}.zip").is_file() else []
    files = files or sorted((data / name).glob("*.zip"))
    if not files:
        raise DataError(f"no study {name} in {data}: keep one with keep {name} RUNS")
    return together(*map(Results.read, files))


def together(*parts: Results) -> Results:
    """Return kept results together; a DataError if their protocols are different."""
    if len({part.protocol for part in parts}) > 1:
        raise DataError("the results were measured under several protocols")
    return replace(
        parts[0],
        samples=pd.concat([part.samples for part in parts], ignore_index=True),
        runs=pd.concat([part.runs for part in parts], ignore_index=True),
        settings=pd.concat([part.settings for part in parts]),
        families={run: known for part in parts for run, known in part.families.items()},
        curves=pd.concat([part.curves for part in parts], ignore_index=True),
        about=[about for part in parts for about in part.about],
    )


def with_regimes_of(one: Results, other: Results) -> Results:
    """Return results with another's runs in place of their own of the same regimes.

    What the two studies set differently is taken not to matter to the regimes that stay.
    """
    stay = set(one.samples["regime"]) - set(other.samples["regime"])
    both = together(one.where(regime=stay), other)
    changed = [
        key
        for key in both.settings
        if not key.startswith("regime.")
        and set(one.settings[key].map(repr)) != set(other.settings[key].map(repr))
    ]
    return replace(both, settings=both.settings.drop(columns=changed))


def by_count(results: Results) -> Results:
    """Return the runs of the study `template_counts` with their number as `label`: "T = 8".

    Those that rank the templates, under r, are left out: they have thirty templates too.
    """
    part = results.where(regime=["b", "e"])
    labels = "T = " + part.samples["templates"].astype(str)
    return replace(part, samples=part.samples.assign(label=labels))


def per_run(results: Results) -> pd.DataFrame:
    """Return a row per run and category of shapes: what tells it apart, and its mean scores."""
    keys = ["run", "category", "regime", "templates", "seed"]
    means = results.samples.groupby(keys, sort=False).mean(numeric_only=True).reset_index()
    return means.join(results.scored.set_index("run")["effective_templates"], on="run")


def per_seed(results: Results, column: str, **where: Any) -> pd.Series:
    """Return a column of the runs, mean over categories, by seed."""
    return per_run(results.where(**where)).groupby("seed")[column].mean()


def one_seed(results: Results) -> bool:
    """Tell whether categories stand in for seeds: all runs have one, of enough categories."""
    seeds, categories = results.samples["seed"], results.samples["category"]
    return seeds.nunique() == 1 and categories.nunique() >= CATEGORIES


def differences(
    results: Results, pairs: Iterable[Sequence[str]], measures: Sequence[str], by: str = "regime"
) -> pd.DataFrame:
    """Compare pairs (a, b) of groups of runs on the same test shapes, as `judged` gives it.

    Groups are those of one value of a column: of `regime`, where runs must differ in nothing else,
    or of `label`.
    """
    tables = []
    for a, b in pairs:
        part = results.where(**{by: [a, b]})
        for measure in measures:
            table = compare(part, measure, by, held=() if by == "label" else None)
            rows = table.to_dict("records")
            tables.append(pd.DataFrame([row if row["a"] == a else turned(row) for row in rows]))
    return judged(tables, one_seed(results))


def judged(tables: Sequence[pd.DataFrame], over_categories: bool) -> pd.DataFrame:
    """Return tables of `compare` as one, with p corrected for all of its rows (Holm).

    `shown` asks every pair of seeds too. Over categories, interval and test of the mean are over
    those, each a training of its own; p is corrected for these rows alone, and no difference of a
    single category is called shown.
    """
    if not over_categories:
        table = pd.concat(tables, ignore_index=True)
        # `shown` of the single comparisons asks whether mean and ranks go in one direction; a
        # stricter p can only take it away.
        table["p_corrected"] = holm(table["p"].tolist())
        table["shown"] &= (table["p_corrected"] < LEVEL) & (table["agreement"] == 1)
        return table
    table = pd.concat([_over_categories(table) for table in tables], ignore_index=True)
    mean = table["category"].map(is_mean)
    table.loc[mean, "p_corrected"] = holm(table.loc[mean, "p"].tolist())
    table["shown"] &= mean & (table["p_corrected"] < LEVEL)
    return table


def _over_categories(table: pd.DataFrame) -> pd.DataFrame:
    """Return it with interval, p and `shown` of the mean taken over categories."""
    mean = table["category"].map(is_mean)
    of_categories = table.loc[~mean, "difference"].to_numpy(float)
    low, high = interval([of_categories])
    z = rank_score([of_categories])
    sign = 1 if of_categories.mean() > 0 else -1
    table.loc[mean, ["low", "high", "p"]] = low, high, 2 * stats.norm.sf(abs(z))
    table.loc[mean, "shown"] = bool(min(sign * low, sign * high) > 0 and sign * z > 0)
    return table


def overall(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows over all categories; those of the only category where there is one."""
    mean = table["category"].map(is_mean)
    return table[mean] if mean.any() else table


# --- verdicts ------------------------------------------------------------------------------------


class Verdict(NamedTuple):
    """What a study says about a claim: "holds", "does not hold" or "not decided", and why."""

    word: str
    why: str


class Claim(NamedTuple):
    """A claim of the paper, when it holds and when it does not, and what judges results by that."""

    text: str
    rule: str
    judge: Callable[[Results], Verdict]


def _word(holds: Any, fails: Any) -> str:
    return HOLDS if holds else FAILS if fails else OPEN


def _spans(rows: pd.DataFrame) -> str:
    return "; ".join(
        f"{row.a} - {row.b}: {1000 * row.difference:+.1f} "
        f"[{1000 * row.low:+.1f}, {1000 * row.high:+.1f}]"
        for row in rows.itertuples()
    )


def about_equal(results: Results) -> Verdict:
    """Judge whether the regimes' deformed Chamfer distances differ by less than `MARGIN`."""
    pairs = [(a, b) for i, b in enumerate(PAPER) for a in PAPER[i + 1 :]]
    rows = overall(differences(results, pairs, ["chamfer"]))
    room = MARGIN * rows[["mean_a", "mean_b"]].min(axis=1)
    inside = (rows["low"] > -room) & (rows["high"] < room)
    outside = rows["shown"] & ((rows["low"] > room) | (rows["high"] < -room))
    return Verdict(_word(inside.all(), outside.any()), f"Chamfer x 1000: {_spans(rows)}")


def best_undeformed(results: Results) -> Verdict:
    """Judge whether regime r selects the nearest templates."""
    rows = overall(differences(results, [("r", x) for x in "bwe"], ["undeformed_chamfer"]))
    lower, higher = rows["shown"] & (rows["high"] < 0), rows["shown"] & (rows["low"] > 0)
    return Verdict(_word(lower.all(), higher.any()), f"Undeformed Chamfer x 1000: {_spans(rows)}")


def _effective(results: Results, regimes: str, **where: Any) -> dict[str, pd.Series]:
    return {r: per_seed(results, "effective_templates", regime=r, **where) for r in regimes}


def _counts(values: Mapping[str, pd.Series]) -> str:
    words = []
    for regime, series in values.items():
        span = f" ({series.min():.1f} to {series.max():.1f})" if len(series) > 1 else ""
        words.append(f"{regime} {series.mean():.1f}{span}")
    return ", ".join(words)


def _selects_more(results: Results, a: str, b: str) -> int:
    """Return 1 where a is shown to select more templates than b, -1 where fewer, else 0."""
    if one_seed(results):
        runs = per_run(results).pivot_table("effective_templates", "category", "regime")
        z = rank_score([(runs[a] - runs[b]).to_numpy(float)])
        return int(np.sign(z)) if 2 * stats.norm.sf(abs(z)) < LEVEL else 0
    more, fewer = _effective(results, a + b).values()
    return int(more.min() > fewer.max()) - int(more.max() < fewer.min())


def spread(results: Results) -> Verdict:
    """Judge whether e and r select more templates than b."""
    found = [_selects_more(results, regime, "b") for regime in "er"]
    over = "mean over categories" if one_seed(results) else "mean and range over seeds"
    why = f"Effective templates, {over}: {_counts(_effective(results, 'ber'))}"
    return Verdict(_word(min(found) > 0, min(found) < 0), why)


def collapse(results: Results) -> Verdict:
    """Judge whether b's effective templates are less than a quarter of T in every run."""
    runs = per_run(results.where(regime="b"))
    used, share = runs["effective_templates"], runs["effective_templates"] / runs["templates"]
    why = f"{used.min():.1f} to {used.max():.1f} of T = {runs['templates'].max()}"
    word = _word((share < 1 / 4).all(), (share > 1 / 2).all())
    return Verdict(word, f"b's effective templates: {why} in {len(runs)} runs")


def opposite(results: Results) -> Verdict:
    """Judge whether w selects fewer templates than b on sofas, and more on tables."""
    sofa, table = (_effective(results, "bw", category=name) for name in ("sofa", "table"))
    holds = sofa["w"].max() < sofa["b"].min() and table["w"].min() > table["b"].max()
    fails = sofa["w"].min() > sofa["b"].max() or table["w"].max() < table["b"].min()
    why = f"Effective templates on sofas: {_counts(sofa)}; on tables: {_counts(table)}"
    return Verdict(_word(holds, fails), why)


def one_is_enough(results: Results) -> Verdict:
    """Judge whether one template's Chamfer distance is within `MARGIN` of thirty's."""
    pairs = [("T = 1", "T = 30")]
    rows = overall(differences(by_count(results), pairs, ["chamfer"], "label"))
    row, room = rows.iloc[0], MARGIN * rows["mean_b"].iloc[0]
    word = _word(row["high"] < room, row["low"] > room and row["shown"])
    return Verdict(word, f"Chamfer x 1000: {_spans(rows)}; T = 30: {1000 * row['mean_b']:.1f}")


def semantically_close(results: Results) -> Verdict:
    """Judge whether labels fit better that come from a template of the image's own family."""
    table = family_table(results.samples, results.families)
    rows = table[table["family"] == "same - other"]
    better, worse = int((rows["low"] > 0).sum()), int((rows["high"] < 0).sum())
    most, means = len(rows) / 2, table.groupby("family")["mean"].mean()
    return Verdict(
        _word(better > most and not worse, worse > most),
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
