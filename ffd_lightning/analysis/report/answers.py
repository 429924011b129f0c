"""Section: which setting is best by each measure, by how much, and whether that is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import pandas as pd

from ffd_lightning.analysis.ranking import Ranking, mean_intervals
from ffd_lightning.analysis.report.elements import Cell, Table
from ffd_lightning.analysis.report.standing import FOLDED, Standing
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.analysis.wording import SHAPE_TITLES, measure_title, number
from ffd_lightning.evaluation.protocols import Measure

_AGAIN = "one training each: another seed may give another order"
_SCALE = ("floor", "feature_retrieval", "medoid")  # between which scores lie


class Card(NamedTuple):
    """The answer by one measure.

    Attributes:
        title: of the measure.
        unit: of its numbers, and which way is better.
        word: lowest or highest.
        best, value: name and score; `color` of its regime, "" where it has none.
        after: the next, and the difference with its interval.
        verdict: whether that is shown, and of what.
        shown: whether it is.
        over: how many test shapes and trainings.
        scale: what the number may be held against.
    """

    title: str
    unit: str
    word: str
    best: str
    value: str
    color: str
    after: str
    verdict: str
    shown: bool
    over: str
    scale: str


@dataclass(frozen=True)
class Answers:
    """The answers.

    Attributes:
        headline: the best by each measure of the protocol, in a sentence or two.
        cards: an answer each.
        notes: what else is to be known.
        categories: the best of each category, None of one category.
        opened: the categories are shown unasked.
    """

    key: ClassVar[str] = "answers"
    title: ClassVar[str] = "Which is best?"

    headline: str
    cards: Sequence[Card]
    notes: Sequence[str] = ()
    categories: Table | None = None
    opened: bool = False


def answers(sweep: Sweep, standing: Standing) -> Answers | None:
    """Return the answers, None where no run has results."""
    if sweep.samples.empty:
        return None
    measures = [*sweep.protocol.measures, FOLDED]
    overall = [r for m in measures if (r := standing.overall(m.name)) is not None]
    notes = [f"Settings are not compared: {standing.error}"] if standing.error else []
    if standing.left_out:
        notes.append(f"Of more settings than twelve the best are compared ({standing.left_out} "
                     "are not).")  # fmt: skip
    if not standing.rankings:
        return Answers(_alone(sweep), [_single(sweep, m) for m in sweep.protocol.measures], notes)
    cards = [_card(sweep, standing, ranking) for ranking in overall]
    categories = _categories(standing, measures)
    headline = _headline(standing, overall) if overall else "Categories have other settings each."
    return Answers(headline, cards, notes, categories, not overall)


def _headline(standing: Standing, found: Sequence[Ranking]) -> str:
    """Say who is best by which measures, how many leads are shown, and of how many trainings."""
    found = [r for r in found if r.measure != FOLDED]
    by_best: dict[str, list[str]] = {}
    for ranking in found:
        by_best.setdefault(ranking.best, []).append(measure_title(ranking.measure.name))
    told = [f"Best {_listed(names)}: {standing.titles[k]}." for k, names in by_best.items()]
    shown = sum(r.shown for r in found)
    told.append(f"Shown on these test shapes: {shown} of {len(found)} leads.")
    if not all(r.trained_again for r in found):
        told.append(f"{_AGAIN[0].upper()}{_AGAIN[1:]}.")
    return " ".join(told)


def _card(sweep: Sweep, standing: Standing, ranking: Ranking) -> Card:
    measure, means = ranking.measure, ranking.means
    low, high = ranking.interval
    best, second = ranking.best, ranking.second
    return Card(
        _title(measure),
        _unit(measure),
        "highest" if measure.higher_is_better else "lowest",
        standing.titles[best],
        _number(measure, means[best]),
        standing.colors.get(best, ""),
        f"{standing.titles[second]} {_number(measure, means[second])} next, difference "
        f"{_number(measure, ranking.ahead)} [{_number(measure, low)}, {_number(measure, high)}]",
        _verdict(ranking),
        ranking.shown,
        _over(ranking),
        _held_against(sweep, measure),
    )


def _verdict(ranking: Ranking) -> str:
    if not ranking.shown:
        return "not shown" + (": the ranks disagree" if ranking.interval[0] > 0 else "")
    if not ranking.trained_again:
        return "shown for these trained networks"
    if ranking.agreement < 1:
        return f"shown for the shapes, but only {ranking.agreement:.0%} of pairs of seeds agree"
    return "shown, and all pairs of seeds agree"


def _over(ranking: Ranking) -> str:
    """Return over what a ranking holds: categories, test shapes, trainings."""
    several = f"the {ranking.category} categories, " if ranking.over_all else ""
    counts = [ranking.seeds[label] for label in (ranking.best, ranking.second)]
    trained = (
        f"{counts[0]} seeds each" if len(set(counts)) == 1 else f"{counts[0]} and {counts[1]} seeds"
    )
    seeds = (
        trained
        if min(counts) > 1
        else _AGAIN
        if max(counts) == 1
        else (f"{counts[0]} and {counts[1]} trainings: another seed may give another order")
    )
    return f"{several}{ranking.num_shapes} test shapes, {seeds}"


def _alone(sweep: Sweep) -> str:
    """Say what there is where nothing can be compared."""
    if len(sweep.scored) == 1:
        return "One run: there is nothing to compare it with."
    return "Nothing is compared: see the numbers of each run."


def _single(sweep: Sweep, measure: Measure) -> Card:
    """Return the score of a setting that has nothing beside it."""
    means = sweep.scored.groupby("category")[measure.name].mean()
    interval = ""
    if len(means) == 1:
        samples = sweep.samples.assign(all=0)
        for low, high in mean_intervals(samples, measure.name, ["all"]).values():
            interval = f"[{_number(measure, low)}, {_number(measure, high)}]"
    count = sweep.samples[["category", "id"]].drop_duplicates().shape[0]
    title = "mean" if len(means) == 1 else f"mean of {len(means)} categories"
    return Card(
        _title(measure), _unit(measure), "", title, _number(measure, float(means.mean())), "",
        interval and f"95% interval over test shapes {interval}", "", False,
        f"{count} test shapes, {len(sweep.scored)} runs", _held_against(sweep, measure),
    )  # fmt: skip


def _categories(standing: Standing, measures: Sequence[Measure]) -> Table | None:
    """Return a row for each category with the best by each measure, None for one category."""
    names = [r.category for r in next(iter(standing.rankings.values())) if not r.over_all]
    if len(names) < 2:
        return None
    ranked = [m for m in measures if m.name in standing.rankings]
    rows = [[name, *(_best_of(standing, m, name) for m in ranked)] for name in names]
    head = ["category", *(f"{_title(m)}\n{_unit(m)}" for m in ranked)]
    return Table("The best of each category", head, rows)


def _best_of(standing: Standing, measure: Measure, category: str) -> Cell:
    ranking = standing.of_category(measure.name, category)
    if ranking is None:
        return Cell("-")
    low, high = ranking.interval
    ahead = _number(measure, ranking.ahead)
    told = f"ahead by {ahead} [{_number(measure, low)}, {_number(measure, high)}]"
    value = _number(measure, ranking.means[ranking.best])
    shown = "shown" if ranking.shown else "not shown"
    return Cell(f"{standing.titles[ranking.best]} {value}", f"{told}, {shown}")


def _held_against(sweep: Sweep, measure: Measure) -> str:
    """Return the references of a measure, as means over categories."""
    found = []
    for shape in _SCALE:
        values = sweep.scored.get(f"{shape}_{measure.name}", pd.Series(dtype=float)).dropna()
        if len(values):
            mean = values.groupby(sweep.scored["category"]).mean().mean()
            found.append(f"{SHAPE_TITLES[shape]} {_number(measure, float(mean))}")
    return f"For scale: {', '.join(found)}" if found else ""


def _title(measure: Measure) -> str:
    return "Folded surface" if measure == FOLDED else measure_title(measure.name)


def _unit(measure: Measure) -> str:
    better = "higher is better" if measure.higher_is_better else "lower is better"
    factor = "" if measure.factor == 1 else f"x {measure.factor:g}, "
    return f"%, {better}" if measure == FOLDED else f"{factor}{better}"


def _number(measure: Measure, value: float) -> str:
    return number(measure.factor * value)


def _listed(names: Sequence[str]) -> str:
    """Join words: "a, b and c"."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
