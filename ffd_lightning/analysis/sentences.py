"""What comparisons show, in words."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ffd_lightning.analysis.paired import LEVEL, Comparison
from ffd_lightning.analysis.wording import measure_title, number
from ffd_lightning.evaluation.protocols import Measure


def statement(
    c: Comparison, held: Sequence[str], judged: Measure, measure: str, p: float, count: int
) -> str:
    """Say in a sentence what a comparison shows.

    One group "beats" another only where both were trained several times, and every pair of their
    runs agrees: of a single training, only its scores can be said to be better.

    Args:
        c: two groups of runs.
        held: names of the settings that both have.
        judged: the measure that they are compared by.
        measure: its column, which names the shape too.
        p: of the comparison, corrected.
        count: of all comparisons that it was corrected for.
    """
    where = ("the " if len(c.differences) > 1 else "") + c.category
    if held:
        where += f" ({group_label(held, c.held)})"
    shape = measure.removesuffix(judged.name).replace("_", " ")
    title = f"{shape}{measure_title(judged.name)}"
    models = f"{c.num_samples} shapes"
    if not any(d.any() for d in c.differences):
        return f"no difference between {c.a} and {c.b} on {where}: same {title} on all {models}"
    corrected = f", Holm over {count} comparisons" if count > 1 else ""
    seeds = "one training each: another seed may give another order"
    if max(c.seeds) > 1:
        seeds = f"{c.seeds[0]} and {c.seeds[1]} seeds, {c.agreement:.0%} of their pairs agree"
    chance = "p < 0.001" if p < 0.001 else f"p = {p:.2g}"
    facts = f"({models}, {chance}{corrected}; {seeds})"
    sign = 1 if c.difference > 0 else -1
    apart, low_p = min(sign * x for x in c.interval) > 0, p < LEVEL

    def size(sign: int) -> str:
        low, high = sorted(sign * judged.factor * x for x in c.interval)
        unit = "" if judged.factor == 1 else f" x {judged.factor:g}"
        mean = number(sign * judged.factor * c.difference)
        return f"{mean} [{number(low)}, {number(high)}]{unit}"

    if c.shown(p):
        winner, loser = (c.a, c.b) if (sign > 0) == judged.higher_is_better else (c.b, c.a)
        word = "higher" if judged.higher_is_better else "lower"
        verb = "beats" if c.trained_again else "scores better than"
        return f"{winner} {verb} {loser} on {where}: {title} {word} by {size(sign)} {facts}"
    why = ""
    if apart and low_p:
        why = ", mean and ranks disagree"
    elif apart or low_p:
        why = f", only the {'mean' if apart else 'ranks'} would show one"
    text = f"no difference shown between {c.a} and {c.b} on {where}{why}: "
    return f"{text}{title} {c.a} - {c.b} = {size(1)} {facts}"


def group_label(names: Sequence[str], values: Sequence[Any]) -> str:
    """Return what a group is called: "w T=16"."""
    short = {"regime": "", "run": "", "setup": "", "shape": "", "templates": "T=", "seed": "seed "}
    return " ".join(f"{short.get(n, f'{n}=')}{v}" for n, v in zip(names, values, strict=True))
