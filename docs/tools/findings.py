"""Write the pages of docs/findings from the studies that are kept in docs/findings/data.

    python docs/tools/findings.py                       write all pages and figures
    python docs/tools/findings.py keep NAME RUNS        keep the runs of a folder as a study

No training is needed for the first. A study in several parts has names like `paper_table/chairs`.
The texts are the templates in docs/tools/findings; what the kept scores say is computed there.
"""

import argparse
import io
import json
import platform
import re
import sys
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd
import torch
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parent))
from claims import (
    CLAIMS,
    FAILS,
    HOLDS,
    OPEN,
    Verdict,
    by_count,
    differences,
    overall,
    per_run,
    per_seed,
    plain_ids,
    read,
    with_floors,
    with_regimes_of,
)
from forest import Row, forest

from ffd_lightning.analysis import compare as comparison
from ffd_lightning.analysis.budget import error_budget
from ffd_lightning.analysis.compare import is_mean
from ffd_lightning.analysis.parts import family_table
from ffd_lightning.analysis.plots import (
    cumulative_curves,
    selection_histograms,
    template_count_curves,
    to_svg,
)
from ffd_lightning.analysis.results import CURVE, Results
from ffd_lightning.analysis.selection import selection_stability
from ffd_lightning.analysis.table import Table
from ffd_lightning.analysis.uncertainty import MARGIN
from ffd_lightning.errors import UserError
from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.files import write_atomic, write_bytes_atomic
from ffd_lightning.palette import REGIME_COLORS, regime_title
from ffd_lightning.terminal import counted

FOLDER = Path(__file__).parents[1] / "findings"
DATA = FOLDER / "data"
TEXTS = Path(__file__).parent / "findings"
FILLED = (FOLDER.parents[1] / "README.md", FOLDER.parent / "evaluation.md", FOLDER / "shapenet.md")
"""Pages without a template that have tables of kept scores."""

_MADE = "<!-- Made by docs/tools/findings.py from docs/tools/findings/{}: change it there. -->\n\n"
_ICONS = {HOLDS: "success", FAILS: "failure", OPEN: "note"}
_BOUND = "\N{NO-BREAK SPACE}"
_COLUMNS = {  # of tables: heading, factor, places
    "chamfer": ("Chamfer ↓", 1000, 1),
    "emd": ("EMD ↓", 1000, 1),
    "iou": ("IoU ↑", 1000, 1),
    "undeformed_chamfer": ("undeformed Chamfer ↓", 1000, 1),
    "effective_templates": ("effective templates", 1, 1),
    "folded": ("folded, %", 100, 1),
    "stretch_95": ("stretch", 1, 2),
    "part_iou": ("part IoU ↑", 100, 1),
}
_PARTS = ["floor", "capacity", "deformation", "selection", "total"]  # of `error_budget`
_REFERENCES = {
    "feature_retrieval": "retrieved by its features",
    "retrieval": "nearest training shape",
    "fitted": "best template, fitted",
    "floor": "floor",
}
_SCORES = tuple(name for name in _COLUMNS if name != "part_iou")


@cache
def study(name: str) -> Results:
    """Read a kept study once; `one+other` is one with the other's runs of the regimes it has."""
    one, _, other = name.partition("+")
    found = read(DATA, one)
    found = with_regimes_of(found, read(DATA, other)) if other else found
    return with_floors(found, read(DATA, "paper_table"))


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    return Table("", heads, list(rows)).markdown().rstrip()


def _headings(columns: Iterable[str], *first: str) -> list[str]:
    return [*first, *(_COLUMNS[column][0] for column in columns)]


def _number(value: float, column: str) -> str:
    _, factor, places = _COLUMNS.get(column, ("", 1, 0))
    return f"{factor * value:.{places}f}"


def _difference(row: Any) -> str:
    _, factor, places = _COLUMNS[row["measure"]]
    mean, low, high = (f"{factor * row[n]:+.{places}f}" for n in ("difference", "low", "high"))
    return f"{mean} [{low}, {high}]"


def _judged(row: Any) -> str:
    """Return a difference for a table, with the signs that docs/findings/index.md explains."""
    text = f"**{_difference(row)}**" if row["differs"] else _difference(row)
    signs = [("≈", row["equal"]), ("†", not row["trainings"])]
    return _BOUND.join([text, *(sign for sign, holds in signs if holds)])


# --- scores --------------------------------------------------------------------------------------


def setup(name: str, **where: Any) -> str:
    """Say what was trained, on what, with which settings and on which machine."""
    kept = study(name).where(**where)
    tested = kept.samples.drop_duplicates(["category", "id", "view"])
    tested_on = tested.groupby("category", sort=False).size()

    def few(values: pd.Series) -> str:
        return ", ".join(map(str, sorted(set(values))))

    words = [
        f"{counted(len(kept.runs), 'run')}: {', '.join(tested_on.index)}",
        f"seed {few(kept.samples['seed'])}",
        f"T = {few(kept.samples['templates'])}",
        f"{few(kept.settings['schedule.steps'])} steps",
        f"{', '.join(map(str, tested_on))} test shapes",
        f"protocol `{kept.protocol.name}`",
        "; ".join(dict.fromkeys(about["processor"] for about in kept.about)),
    ]
    commands = dict.fromkeys(line for about in kept.about for line in about["commands"])
    ordered = sorted(commands, key=lambda line: "=ranking" in line)  # these need others' rankings
    return "\n".join([f"{'; '.join(words)}.\n\n```", *ordered, "```"])


def scores(
    name: str,
    by: str = "regime",
    only: Sequence[Any] = (),
    columns: Sequence[str] = _SCORES,
    **where: Any,
) -> str:
    """Return a table of mean scores, a row per value of a column of the runs.

    They are means over categories first, then over seeds, ± the standard deviation over those.
    """
    runs = per_run(study(name).where(**where))
    return _means({regime_title(str(x)): runs[runs[by] == x] for x in only}, columns, by)


def versions(studies: Mapping[str, str], columns: Sequence[str] = _SCORES, **where: Any) -> str:
    """Return a table of mean scores like `scores`, a row per study, by what is said of it."""
    parts = {label: per_run(study(name).where(**where)) for label, name in studies.items()}
    return _means(parts, columns)


def _means(parts: Mapping[str, pd.DataFrame], columns: Sequence[str], head: str = "") -> str:
    rows = []
    for label, runs in parts.items():
        seeds = runs.groupby("seed")[list(columns)].mean()
        means = [_number(seeds[column].mean(), column) for column in columns]
        if len(seeds) > 1:
            spread = (_number(seeds[column].std(), column) for column in columns)
            means = [f"{a}{_BOUND}±{_BOUND}{b}" for a, b in zip(means, spread, strict=True)]
        rows.append([label, *means])
    return _table(_headings(columns, head), rows)


def seeds_of(name: str, column: str, regime: str, **where: Any) -> str:
    """Return a number of a regime's runs for a sentence: its mean over categories and seeds."""
    return _number(per_seed(study(name), column, regime=regime, **where).mean(), column)


def by_category(
    name: str,
    only: Sequence[Any],
    measure: str,
    references: Mapping[str, str] = _REFERENCES,
    by: str = "regime",
    **where: Any,
) -> str:
    """Return a table of a measure, mean over seeds: a row per category, a column per regime.

    Or one per value of another column of the runs. Beside them are references; means over all of
    these runs where they depend on the run.
    """
    runs = per_run(study(name).where(**{by: only}, **where))
    of_regimes = runs.pivot_table(measure, "category", by, sort=False)[list(only)]
    shapes = [f"{shape}_{measure}" for shape in references]
    table = of_regimes.join(runs.groupby("category", sort=False)[shapes].mean())
    table.loc["mean"] = table.mean()
    rows = [[str(c), *(_number(x, measure) for x in row)] for c, row in table.iterrows()]
    heads = [*(regime_title(str(x)) for x in only), *references.values()]
    return _table([_COLUMNS[measure][0], *heads], rows)


def best_in(name: str, only: Sequence[str], regime: str, measure: str) -> str:
    """Say in how many categories a regime is the best of several, and in which it is not."""
    runs = per_run(study(name).where(regime=only))
    table = runs.pivot_table(measure, "category", "regime", sort=False)
    best = table.idxmax(axis=1) if _higher(measure) else table.idxmin(axis=1)
    others = sorted(best.index[best != regime])
    if not others:
        return f"all {len(best)} categories"
    return f"{len(best) - len(others)} of {len(best)} categories (all but {', '.join(others)})"


def orders(
    studies: Mapping[str, str],
    only: Sequence[str],
    measures: Sequence[str],
    categories: Sequence[str],
) -> str:
    """Return regimes from the best to the worst, a row per category and measure, a study beside."""
    found: dict[tuple[str, str], list[str]] = {}
    for name in studies.values():
        runs = per_run(study(name).where(regime=only, category=categories))
        means = runs.groupby(["category", "regime"])[list(measures)].mean()
        for category in categories:
            for measure in measures:
                values = means.loc[category, measure].sort_values(ascending=not _higher(measure))
                row = found.setdefault((category, measure), [category, _COLUMNS[measure][0]])
                row.append(", ".join(values.index))
    return _table(["category", "", *studies], found.values())


def _higher(measure: str) -> bool:
    """Return whether more of a measure is better."""
    return _COLUMNS[measure][0].endswith("↑")


def course(name: str, only: Sequence[str], column: str, steps: Sequence[int]) -> str:
    """Return how a validation curve runs, mean over the runs of each regime, at some steps."""
    kept = study(name).where(regime=only)
    table = kept.curves.merge(kept.runs[["run", "regime"]], on="run")
    means = table.pivot_table(column, "regime", "step")
    rows = [[regime_title(r), *(f"{means.loc[r, step]:.1f}" for step in steps)] for r in only]
    return _table(["regime", *(f"step {step}" for step in steps)], rows)


# --- differences ---------------------------------------------------------------------------------


@cache
def _differences(
    name: str, pairs: tuple[Any, ...], measures: tuple[str, ...], categories: tuple[str, ...] = ()
) -> pd.DataFrame:
    part = study(name).where(category=categories) if categories else study(name)
    return differences(part, pairs, measures)


def _changes(table: pd.DataFrame, measures: Sequence[str]) -> str:
    rows = []
    for (a, b), part in table.groupby(["a", "b"], sort=False):
        of_measure = (part[part["measure"] == measure].iloc[0] for measure in measures)
        rows.append([f"{a} - {b}", *map(_judged, of_measure)])
    return _table(_headings(measures, ""), rows)


def changes(
    name: str,
    pairs: Iterable[Sequence[str]],
    measures: Sequence[str],
    categories: Sequence[str] = (),
) -> str:
    """Return a table of differences a - b, mean over some categories, or all."""
    table = _differences(name, tuple(map(tuple, pairs)), tuple(measures), tuple(categories))
    return _changes(overall(table), measures)


def change(name: str, a: str, b: str, measure: str) -> str:
    """Return the difference a - b with its interval, for a sentence."""
    return _difference(overall(_differences(name, ((a, b),), (measure,))).iloc[0])


def changes_in(studies: Mapping[str, str], pair: Sequence[str], measures: Sequence[str]) -> str:
    """Return a table of one difference a - b, a row per study, by what is said of it."""
    table = _together(
        differences(study(name), [pair], measures).assign(label=label)
        for label, name in studies.items()
    )
    rows = [
        [label, *(_judged(part[part["measure"] == m].iloc[0]) for m in measures)]
        for label, part in table.groupby("label", sort=False)
    ]
    return _table(_headings(measures, " - ".join(pair)), rows)


def counts(
    name: str, pairs: Iterable[Sequence[int]], measures: Sequence[str], regimes: Sequence[str]
) -> str:
    """Return a table of differences between numbers of templates, mean over categories."""
    named = [tuple(f"T = {count}" for count in pair) for pair in pairs]
    part = by_count(study(name), regimes)
    return _changes(overall(differences(part, named, measures, "label")), measures)


def versus(studies: Mapping[str, str], only: Sequence[str], measures: Sequence[str]) -> str:
    """Return a table of differences between the same regime in several studies.

    Each is compared with the first, on the categories, seeds and test shapes that it has too.
    """
    (base, base_name), *others = studies.items()
    tables = []
    for label, name in others:
        new, old = (_plain_ids(study(n).where(regime=only)) for n in (name, base_name))
        old = old.where(**{c: set(new.samples[c]) for c in ("category", "seed", "id")})
        new = new.where(id=set(old.samples["id"]))
        parts = [
            part.samples.assign(
                label=part.samples["regime"] + f": {of}", run=part.samples["run"] + f": {of}"
            )
            for of, part in ((label, new), (base, old))
        ]
        both = replace(new, samples=pd.concat(parts, ignore_index=True))
        pairs = [(f"{regime}: {label}", f"{regime}: {base}") for regime in only]
        tables.append(differences(both, pairs, measures, "label"))
    table = _together(tables)
    return _changes(table.assign(b=table["b"].str.partition(": ")[2]), measures)


def _plain_ids(kept: Results) -> Results:
    return replace(kept, samples=kept.samples.assign(id=plain_ids(kept.samples)))


def _together(tables: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Return several tables of `differences` as one, and what that decides."""
    return comparison.decide(pd.concat(map(overall, tables), ignore_index=True))


@cache
def _beside(name: str, regime: str, shape: str, measures: tuple[str, ...]) -> pd.DataFrame:
    """Compare a study's networks of one regime with another shape for the same images."""
    part = study(name).where(regime=regime)
    tables = [comparison.compare_with(part, measure, shape) for measure in measures]
    return comparison.decide(pd.concat(tables, ignore_index=True))


def against(name: str, only: Sequence[str], shape: str, measures: Sequence[str]) -> str:
    """Return a table of regimes minus another shape, and in how many categories they are lower."""
    compared = {regime: _beside(name, regime, shape, tuple(measures)) for regime in only}
    together = _together(table.assign(of=regime) for regime, table in compared.items())
    rows = []
    for regime, table in compared.items():
        cells = [regime_title(regime)]
        for measure in measures:
            row = together[(together["of"] == regime) & (together["measure"] == measure)].iloc[0]
            each = table[~table["category"].map(is_mean) & (table["measure"] == measure)]
            lower = (each["difference"] < 0).sum()
            cells += [_judged(row), f"{lower}, {len(each) - lower}"]
        rows.append(cells)
    heads = [head for m in measures for head in (_COLUMNS[m][0], "lower, higher")]
    return _table(["regime", *heads], rows)


# --- claims --------------------------------------------------------------------------------------


@cache
def _verdict(claim: str, name: str) -> Verdict:
    return CLAIMS[claim].judge(study(name))


def verdicts(claim: str, studies: Mapping[str, str]) -> str:
    """Return a claim of the paper, what studies (by what is said of them) say, by which rule."""
    found = {of: _verdict(claim, name) for of, name in studies.items()}
    words = {verdict.word for verdict in found.values()}
    icon = _ICONS[words.pop() if len(words) == 1 else OPEN]
    bullet = "- " if len(found) > 1 else ""
    lines = [
        f"    {bullet}{of[0].upper()}{of[1:]}: **{verdict.word}**. {verdict.why}."
        for of, verdict in found.items()
    ]
    said = "\n".join(lines)
    return f'!!! {icon} "{CLAIMS[claim].text}"\n\n{said}\n\n    {CLAIMS[claim].rule}'


def words(claim: str, studies: Mapping[str, str]) -> str:
    """Return the verdicts alone, each with the studies that say so."""
    found: dict[str, list[str]] = {}
    for of, name in studies.items():
        found.setdefault(_verdict(claim, name).word, []).append(of)
    if len(found) == 1:
        return f"**{next(iter(found))}**"
    return ", ".join(f"**{word}** ({'; '.join(where)})" for word, where in found.items())


def differ(kind: str, name: str, pairs: Sequence[str], measure: str) -> str:
    """Draw differences in a measure; of Chamfer the room is shaded."""
    table = overall(differences(study(name), [(a, b) for a, b in pairs], [measure]))
    heading = _COLUMNS[measure][0]
    rows = [_dot(row, f"{row['a']} - {row['b']}") for _, row in table.iterrows()]
    room = 1000 * MARGIN * table["above"].min() if measure == "chamfer" else 0
    alt = f"{heading}, differences between regimes with their 95% intervals"
    return _drawn(f"{kind}.svg", forest({f"{heading} x 1000": rows}, room), alt)


def _dot(row: Any, label: str) -> Row:
    """Return what is drawn of a difference; the colour is the first regime's."""
    _, factor, _ = _COLUMNS[row["measure"]]
    mean, low, high = (factor * row[name] for name in ("difference", "low", "high"))
    return Row(label, REGIME_COLORS[row["a"]], mean, low, high, bool(row["differs"]))


def beside_retrieval(name: str, only: Sequence[str]) -> str:
    """Draw how far regimes are from retrieval, and the share of the surface that they fold."""
    measures = ("chamfer", "emd", "iou")
    panels: dict[str, list[Row]] = {f"{_COLUMNS[m][0]} x 1000": [] for m in measures}
    panels["folded surface, %"] = []
    compared = {x: overall(_beside(name, x, "feature_retrieval", measures)) for x in only}
    together = _together(table.assign(a=regime) for regime, table in compared.items())
    for _, row in together.iterrows():
        panels[f"{_COLUMNS[row['measure']][0]} x 1000"].append(_dot(row, regime_title(row["a"])))
    for regime in only:
        folded = (
            100 * per_run(study(name).where(regime=regime)).groupby("category")["folded"].mean()
        )
        ends = folded.mean(), folded.min(), folded.max()
        panels["folded surface, %"].append(Row(regime, REGIME_COLORS[regime], *ends))
    alt = (
        "Five regimes against the training shape that their own features retrieve, in Chamfer "
        "distance, EMD and IoU, and the share of the surface that they fold"
    )
    return _drawn("summary.svg", forest(panels), alt)


def claim(name: str) -> str:
    """Return the words of a claim."""
    return CLAIMS[name].text


# --- templates, parts of errors, labels ----------------------------------------------------------


def stability(name: str, only: Sequence[str]) -> str:
    """Return how alike the seeds select: share of images with the same template, and Rand index."""
    table = selection_stability(study(name).where(regime=only))
    means = table.groupby("regime", sort=False)[["same_template", "adjusted_rand"]].mean()
    rows = [
        [regime_title(r), f"{means.same_template[r]:.0%}", f"{means.adjusted_rand[r]:.2f}"]
        for r in only
    ]
    return _table(["regime", "same template", "adjusted Rand index"], rows)


def same_template(name: str, regime: str) -> str:
    """Return for how many images two seeds of a regime select the same, for a sentence."""
    table = selection_stability(study(name).where(regime=regime))
    return f"{table['same_template'].mean():.0%}"


def right_category(name: str, regime: str) -> str:
    """Return for how many images a joint network selects a template of their own category."""
    samples = study(name).where(regime=regime).samples
    of_template = samples["template"].str.partition("/")[0]
    return f"{(of_template == samples['category']).mean():.1%}"


def budgets(name: str, only: Sequence[Any], by: str = "regime", **where: Any) -> str:
    """Return what the Chamfer distance is made of, a row per category and regime or number."""
    part = study(name).where(**{by: only}, **where)
    table = _budget(part).groupby(["category", by], sort=False)[_PARTS].mean()
    rows = [
        [category, regime_title(str(x)), *(f"{number:.1f}" for number in table.loc[(category, x)])]
        for category in table.index.unique("category")
        for x in only
    ]
    return _table(["category", by, *_PARTS], rows)


def budgets_mean(name: str, only: Sequence[str]) -> str:
    """Return what the Chamfer distance is made of, mean over categories and seeds, by regime."""
    rows = []
    for regime in only:
        means = _budget(study(name).where(regime=regime)).groupby("category")[_PARTS].mean().mean()
        rows.append([regime_title(regime), *(f"{number:.1f}" for number in means)])
    return _table(["", *_PARTS], rows)


def _budget(part: Results) -> pd.DataFrame:
    """Return a row per run and category, in which a run of several has a row for each."""
    found = [
        error_budget(samples, part.protocol).reset_index().assign(category=category)
        for category, samples in part.samples.groupby("category", sort=False)
    ]
    about = part.runs.drop(columns="category")
    return pd.concat(found, ignore_index=True).merge(about, on="run")


def labels(name: str) -> str:
    """Return how well part labels fit, by category and regime: deformed, undeformed, by family."""
    kept = study(name)
    families = family_table(kept.samples, kept.families)
    parts = dict(iter(kept.samples.groupby(["category", "regime"], sort=False)))
    gains = comparison.decide(
        pd.concat(
            comparison.compare_with(replace(kept, samples=part), "part_iou", "undeformed")
            for part in parts.values()
        )
    )
    rows = []
    for (category, regime), part in parts.items():
        (gain,) = gains[(gains["category"] == category) & (gains["regime"] == regime)].iloc
        of_group = families[(families["category"] == category) & (families["regime"] == regime)]
        by_family = of_group.groupby("family")["mean"].mean()
        means = part["part_iou"].mean(), part["undeformed_part_iou"].mean()
        cells = [_number(x, "part_iou") for x in (*means, by_family["same"], by_family["other"])]
        rows.append([category, regime_title(regime), *cells[:2], _judged(gain), *cells[2:]])
    heads = ["deformed", "as it is", "gain", "same family", "another family"]
    return _table(["category", "regime", *heads], rows)


# --- numbers in other pages ----------------------------------------------------------------------


def with_references(name: str, only: Sequence[str], columns: Sequence[str]) -> str:
    """Return a table of regimes' mean scores, the best in bold, and of what to hold them to."""
    runs = per_run(study(name).where(regime=only))
    lower = {column: not _higher(column) for column in columns}
    lower.pop("effective_templates", None)  # neither more nor fewer is better
    means = runs.groupby("regime")[list(columns)].mean().loc[list(only)]
    best = {c: means[c].idxmin() if low else means[c].idxmax() for c, low in lower.items()}
    lines = _means({r: runs[runs["regime"] == r] for r in means.index}, columns, "regime").split(
        "\n"
    )
    for place, regime in enumerate(means.index, 2):
        cells = [cell.strip() for cell in lines[place].strip("| ").split("|")]
        scored = zip(columns, cells[1:], strict=True)
        bold = [f"**{cell}**" if best.get(c) == regime else cell for c, cell in scored]
        lines[place] = f"| {' | '.join([regime_title(regime), *bold])} |"
    for shape in ("feature_retrieval", "floor"):
        known = (f"{shape}_{column}" for column in columns)
        cells = [
            _number(runs[key].mean(), column) if key in runs else ""
            for key, column in zip(known, columns, strict=True)
        ]
        lines.append(f"| {CANDIDATES[shape]} | {' | '.join(cells)} |")
    return "\n".join(lines)


def candidates(name: str, measures: Sequence[str], **where: Any) -> str:
    """Return a table of all that is scored beside some runs, by what it is."""
    means = per_run(study(name).where(**where)).mean(numeric_only=True)
    rows = [
        [meaning, *(_number(means[f"{shape}_{m}".removeprefix("_")], m) for m in measures)]
        for shape, meaning in CANDIDATES.items()
    ]
    return _table(_headings(measures, "scored shape"), rows)


def filled(text: str) -> str:
    """Return a page whose tables between `<!-- findings: CALL -->` and `<!-- end -->` are anew."""

    def block(match: re.Match[str]) -> str:
        table = environment().from_string(f"{{{{ {match[2]} }}}}").render()
        return f"{match[1]}\n\n{table}\n\n<!-- end -->"

    found = r"(<!-- findings: (.*?) -->)\n.*?<!-- end -->"
    return re.sub(found, block, text, flags=re.DOTALL)


# --- figures, pages ------------------------------------------------------------------------------


def figure(kind: str, name: str, alt: str, **where: Any) -> str:
    """Draw a figure of a study's runs into a file beside the pages; return the link to it."""
    part = study(name).where(**where)
    drawings: dict[str, Callable[[], Figure]] = {
        "curves": lambda: cumulative_curves(part.samples, part.protocol),
        "selection": lambda: selection_histograms(part.samples),
        "counts": lambda: template_count_curves(part.scored, part.protocol),
    }
    ending = "".join(f"-{value}" for value in where.values() if isinstance(value, (str, int)))
    return _drawn(f"{name}-{kind}{ending}.svg", drawings[kind](), alt)


def _drawn(file: str, figure: Figure, alt: str) -> str:
    write_bytes_atomic(FOLDER / file, to_svg(figure))
    return f"![{alt}]({file})"


def pages() -> dict[str, str]:
    """Return the text of every page by its name, and write the figures."""
    made = environment()
    return {
        path.name: _MADE.format(path.name) + made.get_template(path.name).render()
        for path in sorted(TEXTS.glob("*.md"))
    }


def environment() -> Environment:
    """Return what the templates of pages are written in."""
    made = Environment(
        loader=FileSystemLoader(TEXTS), undefined=StrictUndefined, keep_trailing_newline=True
    )
    made.globals |= {f.__name__: f for f in _FUNCTIONS}
    return made


_FUNCTIONS: tuple[Callable[..., str], ...] = (
    *(setup, scores, versions, seeds_of, by_category, best_in, orders, course),
    *(changes, change, changes_in, counts, versus, against),
    *(verdicts, words, claim, stability, same_template, right_category),
    *(budgets, budgets_mean, labels, figure, differ, beside_retrieval),
    *(with_references, candidates),
)  # that the templates of pages may call


# --- commands ------------------------------------------------------------------------------------


def keep(name: str, runs: Path, protocol: str | None, commands: Sequence[str]) -> None:
    """Keep the finished runs of a folder as a study, or as a part of one."""
    about = {"processor": processor(), "commands": list(commands)}
    file = DATA / f"{name}.zip"
    save(Results.read(runs, protocol), file, about)
    print(f"{file}: {file.stat().st_size / 1e6:.2f} MB")


def save(results: Results, file: Path, about: Mapping[str, Any]) -> None:
    """Write scores, curves and settings of finished runs, of settings that are paths the names."""
    results.check_scored()
    runs = list(results.scored["run"])
    names = zip(results.samples["run"], results.samples["template"], strict=True)
    family = [results.families.get(run, {}).get(template, "") for run, template in names]
    settings = results.settings.loc[runs].filter(regex=r"^(?!paths\.|base$)").map(_without_folder)
    shared = [key for key in settings if settings[key].map(repr).nunique() == 1]
    known = {
        "protocol": results.protocol.to_json(),
        "settings": json.loads(settings[shared].iloc[0].to_json()),
        "seconds_per_step": results.scored.set_index("run")["seconds_per_step"].to_dict(),
        **about,
    }
    tables = {
        "samples.csv": results.samples.assign(template_family=family),
        "curves.csv": pd.concat([_curves(run, results.run_folder(run).path) for run in runs]),
        "settings.csv": settings.drop(columns=shared).reset_index(),
    }
    content = {
        name: table.to_csv(index=False, float_format="%.5g", lineterminator="\n")
        for name, table in tables.items()
    }
    content["about.json"] = json.dumps(known, indent=1, sort_keys=True)
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_LZMA) as archive:
        for name, text in content.items():  # of one date: the same file for the same results
            archive.writestr(zipfile.ZipInfo(name), text, zipfile.ZIP_LZMA)
    write_bytes_atomic(file, packed.getvalue())


def _without_folder(value: Any) -> Any:
    return Path(value).name if isinstance(value, str) and Path(value).is_absolute() else value


def _curves(name: str, run: Path) -> pd.DataFrame:
    """Read the validation scores of a run from its TensorBoard log; no rows where there is none."""
    if not any(run.glob("events.*")):
        return pd.DataFrame(columns=CURVE)
    log = EventAccumulator(str(run), {"scalars": 0})
    log.Reload()
    tags = log.Tags()["scalars"]
    columns = {
        name: {event.step: event.value for event in log.Scalars(f"val/{name}")}
        for name in CURVE[2:]
        if f"val/{name}" in tags
    }
    table = pd.DataFrame(columns).sort_index().rename_axis("step").reset_index()
    return table.assign(run=name).reindex(columns=CURVE)


def processor() -> str:
    """Return what the numbers depend on: the processor, its instructions, threads, torch.

    So studies are to be kept where, and with the OMP_NUM_THREADS with which, they were trained.
    """
    lines = Path("/proc/cpuinfo").read_text().splitlines()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    threads = torch.get_num_threads()
    count = "one thread" if threads == 1 else f"{threads} threads"
    capability = torch.backends.cpu.get_cpu_capability()
    kind = names[0] if names else platform.machine()
    return f"{kind} ({capability}, {count}), torch {torch.__version__}"


def main() -> int:
    """See the top of this file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("action", nargs="?", default="write", choices=("write", "keep"))
    parser.add_argument("study", nargs="?", help="its name")
    parser.add_argument("runs", nargs="?", type=Path, help="folder of its runs")
    parser.add_argument("--protocol", help="keep: whose scores (default: the training's)")
    parser.add_argument("--command", action="append", default=[], help="keep: what trained them")
    given = parser.parse_args()
    if given.action != "write" and given.runs is None:
        parser.error(f"{given.action} needs the name of a study and a folder of runs")
    if given.action == "keep":
        keep(given.study, given.runs, given.protocol, given.command)
    else:
        for name, text in pages().items():
            write_atomic(FOLDER / name, text)
            print(FOLDER / name)
        for page in FILLED:
            write_atomic(page, filled(page.read_text(encoding="utf-8")))
            print(page)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        sys.exit(f"error: {error}")
