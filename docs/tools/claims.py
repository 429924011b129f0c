"""The paper's claims, what kept results say about them, and the rules of the verdicts."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ffd_lightning.analysis.compare import compare, decide, is_mean, turned
from ffd_lightning.analysis.parts import family_table
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.uncertainty import LEVEL, MARGIN, Estimate, holm
from ffd_lightning.errors import DataError

PAPER = ("b", "w", "e", "r")
HOLDS, FAILS, OPEN = "holds", "does not hold", "not decided"


@cache
def read(data: Path, name: str) -> Results:
    """Read the results `<name>.zip`, or those of all files in the folder `<name>`; do it once."""
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
    """Return results with another's runs of the same categories and seeds.

    They take the place of their own of the same regimes. What the two studies set differently is
    taken not to matter to the regimes that stay.
    """
    other = other.where(**{c: set(one.samples[c]) for c in ("category", "seed")})
    stay = set(one.samples["regime"]) - set(other.samples["regime"])
    both = together(one.where(regime=stay), other)
    changed = [
        key
        for key in both.settings
        if not key.startswith("regime.")
        and set(one.settings[key].map(repr)) != set(other.settings[key].map(repr))
    ]
    return replace(both, settings=both.settings.drop(columns=changed))


def with_floors(results: Results, other: Results) -> Results:
    """Return results with another's floors of the same shapes, where they have none themselves."""
    if results.protocol != other.protocol:
        return results
    samples, shape = results.samples.copy(), ["category", "id"]
    known = other.samples.groupby(shape).first().filter(like="floor_")
    shapes = pd.MultiIndex.from_arrays([samples["category"], plain_ids(samples)])
    for column, floors in known.items():
        found = floors.reindex(shapes).set_axis(samples.index)
        samples[column] = samples[column].fillna(found) if column in samples else found
    return replace(results, samples=samples)


def plain_ids(samples: pd.DataFrame) -> pd.Series:
    """Return the ids of a category's own runs, where those of `joint` say the category."""
    return samples["id"].str.rpartition("/")[2]


def by_count(results: Results, regimes: Sequence[str] = ("b", "e")) -> Results:
    """Return the runs of the study `template_counts` with their number as `label`: "T = 8".

    Those of other regimes are left out: under r, thirty templates are ranked.
    """
    part = results.where(regime=regimes)
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


def differences(
    results: Results, pairs: Iterable[Sequence[str]], measures: Sequence[str], by: str = "regime"
) -> pd.DataFrame:
    """Compare pairs (a, b) of groups of runs on the same test shapes, as `compare` does.

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
    return decide(pd.concat(tables, ignore_index=True))


def overall(table: pd.DataFrame) -> pd.DataFrame:
    """Return the rows over all categories, or of the only one, and what they alone decide."""
    mean = table["category"].map(is_mean)
    return decide(table[mean] if mean.any() else table)


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
    room = MARGIN * rows["above"]
    outside = rows["differs"] & ((rows["low"] > room) | (rows["high"] < -room))
    why = f"Chamfer x 1000: {_spans(rows)}; room: {1000 * room.min():.1f}"
    return Verdict(_word(rows["equal"].all(), outside.any()), why)


def best_undeformed(results: Results) -> Verdict:
    """Judge whether regime r selects the nearest templates."""
    rows = overall(differences(results, [("r", x) for x in "bwe"], ["undeformed_chamfer"]))
    lower, higher = (rows["differs"] & (sign * rows["difference"] > 0) for sign in (-1, 1))
    return Verdict(_word(lower.all(), higher.any()), f"Undeformed Chamfer x 1000: {_spans(rows)}")


def _effective(results: Results, regimes: str, **where: Any) -> dict[str, pd.Series]:
    return {r: per_seed(results, "effective_templates", regime=r, **where) for r in regimes}


def _counts(values: Mapping[str, pd.Series]) -> str:
    words = []
    for regime, series in values.items():
        span = f" ({series.min():.1f} to {series.max():.1f})" if len(series) > 1 else ""
        words.append(f"{regime} {series.mean():.1f}{span}")
    return ", ".join(words)


def _selects_more(results: Results, pairs: Sequence[str]) -> list[int]:
    """Return 1 where the first of a pair selects more templates, -1 where fewer, 0 where unknown.

    Runs are the sample: of each category, or one of each of several.
    """
    runs, found = per_run(results), []
    for pair in pairs:
        groups = [
            [x.to_numpy(float) for _, x in part.groupby("category")["effective_templates"]]
            for part in (runs[runs["regime"] == regime] for regime in pair)
        ]
        if min(len(x) for group in groups for x in group) > 1:
            # Twice the groups, one of them negated: the mean over all strata is their difference.
            strata = [sign * 2 * x for sign, g in zip((1, -1), groups, strict=True) for x in g]
        else:
            strata = [np.array([a.mean() - b.mean() for a, b in zip(*groups, strict=True)])]
        found.append(Estimate.over_strata(strata))
    corrected = holm([estimate.p_differs() for estimate in found])
    return [int(np.sign(x.mean)) * (p < LEVEL) for x, p in zip(found, corrected, strict=True)]


def spread(results: Results) -> Verdict:
    """Judge whether e and r select more templates than b."""
    found = _selects_more(results, ["eb", "rb"])
    why = f"Effective templates: {_counts(_effective(results, 'ber'))}"
    return Verdict(_word(min(found) > 0, min(found) < 0), why)


def collapse(results: Results) -> Verdict:
    """Judge whether b's effective templates are less than a quarter of T in every run."""
    runs = per_run(results.where(regime="b"))
    used, share = runs["effective_templates"], runs["effective_templates"] / runs["templates"]
    why = f"{used.min():.1f} to {used.max():.1f} of T = {runs['templates'].max()}"
    few = (share < 1 / 4).sum()
    word = _word(few == len(share), (share > 1 / 2).all())
    return Verdict(
        word, f"b's effective templates: {why}, less than a quarter in {few} of {len(runs)} runs"
    )


def opposite(results: Results) -> Verdict:
    """Judge whether w selects fewer templates than b on sofas, and more on tables."""
    sofa, table = (_effective(results, "bw", category=name) for name in ("sofa", "table"))
    on_sofas, on_tables = (
        _selects_more(results.where(category=name), ["wb"])[0] for name in ("sofa", "table")
    )
    holds, fails = on_sofas < 0 < on_tables, on_sofas > 0 or on_tables < 0
    why = f"Effective templates on sofas: {_counts(sofa)}; on tables: {_counts(table)}"
    return Verdict(_word(holds, fails), why)


def one_is_enough(results: Results) -> Verdict:
    """Judge whether one template's Chamfer distance is within `MARGIN` of thirty's."""
    pairs = [("T = 1", "T = 30")]
    rows = overall(differences(by_count(results), pairs, ["chamfer"], "label"))
    row, room = rows.iloc[0], MARGIN * rows["above"].iloc[0]
    word = _word(row["trainings"] and row["high"] < room, row["differs"] and row["low"] > room)
    return Verdict(word, f"Chamfer x 1000: {_spans(rows)}; room: {1000 * room:.1f}")


def semantically_close(results: Results) -> Verdict:
    """Judge whether labels fit better that come from a template of the image's own family."""
    table = family_table(results.samples, results.families)
    rows = table[table["family"] == "same - other"].dropna()
    settings = [part for _, part in rows.groupby(["category", "regime"]) if len(part) > 1]
    over_runs = Estimate.over_strata([part["mean"].to_numpy(float) for part in settings])
    # All runs of a setting have the same test shapes, so these are not averaged out.
    over_shapes = sum((part["error"] ** 2).mean() for part in settings) / len(settings) ** 2
    runs = over_runs.error**2
    found = Estimate.of(over_runs.mean, runs + over_shapes, [(runs, over_runs.df)])
    low, high = found.interval
    means = table.groupby("family")["mean"].mean()
    return Verdict(
        _word(low > 0, high < 0),
        f"Part IoU x 100, mean over {len(rows)} runs: {100 * means['same']:.1f} with a template of "
        f"the image's family, {100 * means['other']:.1f} with another; same - other: "
        f"{100 * found.mean:+.1f} [{100 * low:+.1f}, {100 * high:+.1f}]",
    )


CLAIMS = {
    "equal": Claim(
        "The regimes b, w, e and r deform about equally well.",
        f"Room is {MARGIN:.0%} of what the lower score has above the floor. Holds if all six "
        "differences are shown to be less. Does not hold if one is shown with its whole interval "
        "beyond.",
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
        "Holds if a t test, corrected for two, shows that e and r have more effective templates "
        "than b; does not hold if it shows that one has fewer. Runs are the sample, of these test "
        "shapes.",
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
        "Holds if t tests over runs show both. Does not hold if one shows the contrary.",
        opposite,
    ),
    "one": Claim(
        "One template is about as good as thirty.",
        f"Room is {MARGIN:.0%} of what the lower score has above the floor. Holds if the whole "
        "interval of T = 1 is worse by less. Does not hold if all of it is worse by more.",
        one_is_enough,
    ),
    "labels": Claim(
        "Part labels transfer where the template is semantically close.",
        "Close is a template of the structural family that the image shows. Holds if the interval "
        "of the difference, over seeds and shapes, is above 0. Does not hold if it is below.",
        semantically_close,
    ),
}
"""The paper's claims, by name: those of its sections 5.2 and 5.3."""
