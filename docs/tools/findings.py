"""Write the pages of docs/findings from the studies that are kept in docs/findings/data.

    python docs/tools/findings.py                       write all pages and figures
    python docs/tools/findings.py keep NAME RUNS        keep the runs of a folder as a study
    python docs/tools/findings.py compare NAME RUNS     put runs trained again beside the kept ones

No training is needed for the first. A study in several parts has names like `paper_table/chairs`.
The texts are the templates in docs/tools/findings; what the kept scores say is computed there.
"""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import torch
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from matplotlib.figure import Figure

sys.path.insert(0, str(Path(__file__).parents[2]))
sys.path.insert(0, str(Path(__file__).parent))
from findings_minutes import draw
from findings_study import CLAIMS, FAILS, HOLDS, OPEN, Study, differences, overall

from ffd_lightning.analysis.archive import write_archive
from ffd_lightning.analysis.budget import error_budget
from ffd_lightning.analysis.compare import LEVEL, compare_runs, holm
from ffd_lightning.analysis.parts import family_table
from ffd_lightning.analysis.plots import (
    budget_bars,
    cumulative_curves,
    selection_histograms,
    template_count_curves,
    to_svg,
)
from ffd_lightning.analysis.runs import find_protocol, load_samples, require_runs
from ffd_lightning.analysis.selection import selection_stability
from ffd_lightning.errors import UserError
from ffd_lightning.files import write_atomic, write_bytes_atomic
from ffd_lightning.palette import regime_title

FOLDER = Path(__file__).parents[1] / "findings"
DATA = FOLDER / "data"
TEXTS = Path(__file__).parent / "findings"

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
_REGIME_STUDIES = {  # what is said of each: study
    "chairs, lamps and tables, T = 16": "beyond+annealing",
    "sofas and tables, T = 30": "regimes",
    "13 categories, T = 30, one seed": "paper_table",
}
_SCORES = tuple(name for name in _COLUMNS if name != "part_iou")


@cache
def study(name: str) -> Study:
    """Read a kept study once; `one+other` is one with the other's runs of the regimes it has."""
    one, _, other = name.partition("+")
    read = Study.read(DATA, one)
    return read.with_regimes_of(Study.read(DATA, other)) if other else read


def setup(name: str, **columns: Any) -> str:
    """Say what was trained, on what, with which settings and on which machine."""
    kept = study(name).where(**columns)
    runs, steps = kept.runs, kept.about_runs["schedule.steps"]
    tested = kept.samples.drop_duplicates(["category", "id", "view"])
    tested_on = tested.groupby("category", sort=False).size()
    told = [
        f"{runs['run'].nunique()} runs: {', '.join(tested_on.index)}",
        f"seed {_few(runs['seed'])}",
        f"T = {_few(runs['templates'])}",
        f"{_few(steps)} steps",
        f"{', '.join(map(str, tested_on))} test shapes",
        f"protocol `{kept.protocol.name}`",
        "; ".join(dict.fromkeys(about["processor"] for about in kept.about)),
    ]
    commands = "\n".join(dict.fromkeys(line for a in kept.about for line in a["commands"]))
    return f"{'; '.join(told)}.\n\n```\n{commands}\n```"


def scores(
    name: str,
    by: str = "regime",
    only: Sequence[str] = (),
    columns: Sequence[str] = _SCORES,
    **where: Any,
) -> str:
    """Return a table of mean scores, ± the standard deviation over seeds.

    Args:
        name: of the study.
        by: a row per value of this column of its runs; a value is averaged over categories first.
        only: values of it that are shown, in this order; all by default.
        columns: of `_COLUMNS`.
        where: the runs, as `Study.where` takes them.
    """
    runs = study(name).where(**where).runs
    rows = [
        [regime_title(str(value)), *_means(runs[runs[by] == value], columns)]
        for value in only or runs[by].unique()
    ]
    return _table([by, *(_COLUMNS[c][0] for c in columns)], rows)


def versions(studies: Mapping[str, str], columns: Sequence[str] = _SCORES, **where: Any) -> str:
    """Return a table of mean scores like `scores`, a row per study, by what is said of it."""
    rows = [
        [label, *_means(study(name).where(**where).runs, columns)]
        for label, name in studies.items()
    ]
    return _table(["", *(_COLUMNS[c][0] for c in columns)], rows)


def _means(runs: pd.DataFrame, columns: Sequence[str]) -> list[str]:
    seeds = runs.groupby("seed").mean(numeric_only=True)
    cells = []
    for column in columns:
        _, factor, places = _COLUMNS[column]
        numbers = factor * seeds[column]
        cells.append(f"{numbers.mean():.{places}f}")
        if len(numbers) > 1:
            cells[-1] += f"{_BOUND}±{_BOUND}{numbers.std():.{places}f}"
    return cells


def changes(name: str, pairs: Iterable[Sequence[str]], measures: Sequence[str]) -> str:
    """Return a table of differences a - b, mean over categories; bold is what is shown."""
    return _changes(_differences(name, tuple(map(tuple, pairs)), tuple(measures)), measures)


def changes_in(
    studies: Mapping[str, str], pair: Sequence[str], measures: Sequence[str], **where: Any
) -> str:
    """Return a table of one difference a - b, a row per study, by what is said of it."""
    table = _together(
        differences(study(name).where(**where), [pair], measures).assign(label=label)
        for label, name in studies.items()
    )
    rows = [
        [label, *(_cell(part[part["measure"] == m].iloc[0]) for m in measures)]
        for label, part in table.groupby("label", sort=False)
    ]
    return _table([" - ".join(pair), *(_COLUMNS[m][0] for m in measures)], rows)


def counts(name: str, pairs: Iterable[Sequence[int]], measures: Sequence[str]) -> str:
    """Return a table of differences between numbers of templates, mean over categories."""
    named = [tuple(f"T = {count}" for count in pair) for pair in pairs]
    return _changes(
        differences(study(name).by_count(), named, measures, "setup", settings=False), measures
    )


def _changes(table: pd.DataFrame, measures: Sequence[str]) -> str:
    rows = []
    for (a, b), part in table.groupby(["a", "b"], sort=False):
        cells = [f"{a} - {b}"]
        for measure in measures:
            cells.append(_cell(overall(part[part["measure"] == measure]).iloc[0]))
        rows.append(cells)
    return _table(["", *(_COLUMNS[m][0] for m in measures)], rows)


def changes_by_category(
    name: str, pairs: Iterable[Sequence[str]], measure: str, **where: Any
) -> str:
    """Return a table of differences a - b in one measure, a row per category."""
    table = differences(study(name).where(**where), pairs, [measure])
    labels = list(dict.fromkeys(f"{a} - {b}" for a, b in zip(table["a"], table["b"], strict=True)))
    rows = []
    for category, part in table.groupby("category", sort=False):
        rows.append([str(category), *(_cell(row) for _, row in part.iterrows())])
    rows.sort(key=lambda cells: cells[0].startswith("mean"))
    return _table(["category", *labels], rows)


@cache
def _differences(name: str, pairs: tuple[Any, ...], measures: tuple[str, ...]) -> pd.DataFrame:
    return differences(study(name), pairs, measures)


def versus(studies: Mapping[str, str], only: Sequence[str], measures: Sequence[str]) -> str:
    """Return a table of differences between the same regime in several studies.

    Args:
        studies: by what is said of them: "600 steps"; each is compared with the first, on the
            categories, seeds and test shapes that it has too.
        only: the regimes.
        measures: columns of the samples.
    """
    (base, base_name), *others = studies.items()
    tables = []
    for label, name in others:
        new, old = (_plain_ids(study(n).where(regime=only)) for n in (name, base_name))
        shared = {c: set(new.samples[c]) for c in ("category", "seed", "id")}
        old = old.where(**shared)
        new = new.where(id=set(old.samples["id"]))
        parts = [
            part.samples.assign(
                setup=part.samples["regime"] + f": {of}", run=part.samples["run"] + f": {of}"
            )
            for of, part in ((label, new), (base, old))
        ]
        both = replace(new, samples=pd.concat(parts, ignore_index=True))
        pairs = [(f"{regime}: {label}", f"{regime}: {base}") for regime in only]
        tables.append(differences(both, pairs, measures, "setup", settings=False))
    table = _together(tables)
    return _changes(table.assign(b=table["b"].str.partition(": ")[2]), measures)


def _together(tables: Iterable[pd.DataFrame]) -> pd.DataFrame:
    """Return several tables of `differences` as one: `overall`, shown if they are among all."""
    table = pd.concat(map(overall, tables), ignore_index=True)
    # Each was corrected for its own comparisons; a stricter p can only take `shown` away.
    table["shown"] &= np.array(holm(table["p"].tolist())) < LEVEL
    return table


def change(name: str, a: str, b: str, measure: str) -> str:
    """Return the difference a - b with its interval, for a sentence; bold if it is shown."""
    table = _differences(name, ((a, b),), (measure,))
    return _cell(overall(table).iloc[0])


def _cell(row: Any) -> str:
    _, factor, places = _COLUMNS[row["measure"]]
    mean, low, high = (f"{factor * row[n]:+.{places}f}" for n in ("difference", "low", "high"))
    text = f"{mean} [{low}, {high}]"
    return f"**{text}**" if row["shown"] else text


def verdicts(claim: str, studies: Mapping[str, str]) -> str:
    """Return a claim of the paper, what studies say about it, and by which rule.

    Args:
        claim: its name in `CLAIMS`.
        studies: by what is said of them: "sofas and tables".
    """
    judged = {of: CLAIMS[claim](study(name)) for of, name in studies.items()}
    words = {verdict.word for verdict in judged.values()}
    icon = _ICONS[words.pop() if len(words) == 1 else OPEN]
    bullet = "- " if len(judged) > 1 else ""
    lines = [
        f"    {bullet}{of[0].upper()}{of[1:]}: **{verdict.word}**. {verdict.why}."
        for of, verdict in judged.items()
    ]
    said = "\n".join(lines)
    return f'!!! {icon} "{CLAIMS[claim].text}"\n\n{said}\n\n    {CLAIMS[claim].rule}'


def word(claim: str, name: str) -> str:
    """Return the verdict alone: holds, does not hold, not decided."""
    return CLAIMS[claim](study(name)).word


def claim(name: str) -> str:
    """Return the words of a claim."""
    return CLAIMS[name].text


def stability(name: str, only: Sequence[str], **where: Any) -> str:
    """Return how alike the seeds select: share of images with the same template, and Rand index."""
    table = selection_stability(study(name).where(regime=only, **where).samples)
    means = table.groupby("regime", sort=False)[["same_template", "adjusted_rand"]].mean()
    rows = [
        [regime_title(r), f"{means.same_template[r]:.0%}", f"{means.adjusted_rand[r]:.2f}"]
        for r in only
    ]
    return _table(["regime", "same template", "adjusted Rand index"], rows)


def same_template(name: str, regime: str) -> str:
    """Return for how many images two seeds of a regime select the same, for a sentence."""
    table = selection_stability(study(name).where(regime=regime).samples)
    return f"{table['same_template'].mean():.0%}"


def _plain_ids(kept: Study) -> Study:
    """Return it with the ids of a category's own runs, where those of `joint` say the category."""
    ids = kept.samples["id"].str.rpartition("/")[2]
    return replace(kept, samples=kept.samples.assign(id=ids))


def agreement(one: str, other: str, only: Sequence[str], **where: Any) -> str:
    """Return for how many images the same regime and seed select the same in two studies."""
    runs = ["category", "regime", "seed"]
    samples = [study(name).where(regime=only, **where).samples for name in (one, other)]
    both = pd.merge(*samples, on=[*runs, "id", "view"])
    same = (both["template_x"] == both["template_y"]).groupby(both["regime"]).mean()
    return _table(["regime", "same template"], [[regime_title(r), f"{same[r]:.0%}"] for r in only])


def drift(one: str, other: str, measures: Sequence[str], **where: Any) -> str:
    """Return how far apart the mean scores of two trainings of a regime are: the mean over pairs.

    Pairs are the same seed in two studies, and two seeds in the first.
    """
    keys = ["category", "regime", "seed"]
    kept = (study(name).where(**where) for name in (one, other))
    first, second = (part.runs.set_index(keys)[list(measures)] for part in kept)
    same_seed = (first - second).abs().mean()
    pairs = [
        (part.loc[a] - part.loc[b]).abs()
        for _, part in first.groupby(keys[:2])
        for a, b in combinations(part.index, 2)
    ]
    two_seeds = pd.DataFrame(pairs).mean()
    columns = [_COLUMNS[measure] for measure in measures]
    rows = [
        [name, *(f"{k * x:.{places}f}" for x, (_, k, places) in zip(means, columns, strict=True))]
        for name, means in (("the same seed in both", same_seed), ("two seeds", two_seeds))
    ]
    return _table(["", *(heading for heading, _, _ in columns)], rows)


def categories_of(studies: Mapping[str, str], regime: str, measure: str) -> str:
    """Return a table of a measure of one regime: a row per category, a column per study."""
    heading, factor, places = _COLUMNS[measure]
    parts = {label: study(name).where(regime=regime).runs for label, name in studies.items()}
    table = pd.DataFrame({n: runs.groupby("category")[measure].mean() for n, runs in parts.items()})
    return _of_categories(factor * table, [heading, *studies], places)


def budgets_of(studies: Mapping[str, str], regime: str) -> str:
    """Return what the Chamfer distance of one regime is made of, mean over runs, by study."""
    rows = []
    for label, name in studies.items():
        part = study(name).where(regime=regime)
        means = error_budget(part.samples, part.protocol)[_PARTS].mean()
        rows.append([label, *(f"{means[n]:.1f}" for n in _PARTS)])
    return _table(["", *_PARTS], rows)


def right_category(name: str, regime: str) -> str:
    """Return for how many images a joint network selects a template of their own category."""
    samples = study(name).where(regime=regime).samples
    of_template = samples["template"].str.partition("/")[0]
    return f"{(of_template == samples['category']).mean():.1%}"


def budgets(name: str, only: Sequence[Any], by: str = "regime", **where: Any) -> str:
    """Return what the Chamfer distance is made of, a row per category and regime or number."""
    part = study(name).where(**{by: only}, **where)
    runs = part.runs.set_index("run")[["category", by]]
    table = error_budget(part.samples, part.protocol).join(runs)
    means = table.groupby(["category", by], sort=False)[_PARTS].mean()
    rows = [
        [
            category,
            regime_title(str(value)),
            *(f"{means.loc[(category, value), n]:.1f}" for n in _PARTS),
        ]
        for category in runs["category"].unique()
        for value in only
    ]
    return _table(["category", by, *_PARTS], rows)


def course(name: str, only: Sequence[str], column: str, steps: Sequence[int]) -> str:
    """Return how a validation curve runs, mean over the runs of each regime, at some steps."""
    kept = study(name).where(regime=only)
    table = kept.curves.merge(kept.runs[["run", "regime"]], on="run")
    means = table.pivot_table(column, "regime", "step")
    rows = [[regime_title(r), *(f"{means.loc[r, step]:.1f}" for step in steps)] for r in only]
    return _table(["regime", *(f"step {step}" for step in steps)], rows)


def labels(name: str) -> str:
    """Return how well part labels fit, by category and regime: deformed, undeformed, by family."""
    kept = study(name)
    families = family_table(kept.samples, kept.families)
    rows = []
    for (category, regime), part in kept.samples.groupby(["category", "regime"], sort=False):
        gain = beside(replace(kept, samples=part), "undeformed", ["part_iou"])
        of_group = families[(families["category"] == category) & (families["regime"] == regime)]
        by_family = of_group.groupby("family")["mean"].mean()
        means = (part["part_iou"].mean(), part["undeformed_part_iou"].mean())
        cells = [f"{100 * x:.1f}" for x in (*means, by_family["same"], by_family["other"])]
        name_of = regime_title(str(regime))
        rows.append([str(category), name_of, *cells[:2], _cell(gain.iloc[0]), *cells[2:]])
    heads = ["deformed", "as it is", "gain", "same family", "another family"]
    return _table(["category", "regime", *heads], rows)


def by_category(
    name: str, only: Sequence[str], measure: str, references: Mapping[str, str] = _REFERENCES
) -> str:
    """Return a table of a measure, mean over seeds: a row per category, a column per regime.

    Args:
        name: of the study.
        only: the regimes, in this order.
        measure: column of the samples.
        references: shapes shown beside the regimes, by the name of their columns; means over all
            regimes where they depend on the run.
    """
    runs = study(name).where(regime=only).runs
    heading, factor, places = _COLUMNS[measure]
    of_regimes = runs.pivot_table(measure, "category", "regime", sort=False)[list(only)]
    of_others = runs.groupby("category", sort=False)[[f"{r}_{measure}" for r in references]].mean()
    table = factor * of_regimes.join(of_others)
    heads = [heading, *map(regime_title, only), *references.values()]
    return _of_categories(table, heads, places)


def _of_categories(table: pd.DataFrame, heads: Sequence[str], places: int) -> str:
    """Write a table with a row per category, and their mean if there are several."""
    if len(table) > 1:
        table.loc["mean"] = table.mean()
    rows = [[str(c), *(f"{x:.{places}f}" for x in row)] for c, row in table.iterrows()]
    return _table(heads, rows)


def beside(part: Study, shape: str, measures: Sequence[str]) -> pd.DataFrame:
    """Compare what the networks make of images with another shape for the same images.

    Args:
        part: one regime of a study.
        shape: the other's columns begin with it.
        measures: columns of the samples.

    Returns:
        As `differences` gives it.
    """
    other = {measure: part.samples[f"{shape}_{measure}"] for measure in measures}
    run = part.samples["run"] + f", {shape}"
    both = pd.concat(
        [
            part.samples.assign(setup="network"),
            part.samples.assign(setup=shape, run=run, **other),
        ]
    )
    pair = [("network", shape)]
    return differences(replace(part, samples=both), pair, measures, "setup", settings=False)


def against(name: str, only: Sequence[str], shape: str, measures: Sequence[str]) -> str:
    """Return a table of regimes minus another shape, and on how many categories they are better."""
    rows = []
    for regime in only:
        part = study(name).where(regime=regime)
        cells = [regime_title(regime)]
        for measure in measures:
            table = beside(part, shape, [measure])
            sign = -1 if part.protocol.metric(measure).higher_is_better else 1
            each = table[~table["category"].str.startswith("mean of ")]
            better = (sign * each[["low", "high"]] < 0).all(axis=1).sum()
            worse = (sign * each[["low", "high"]] > 0).all(axis=1).sum()
            cells += [_cell(overall(table).iloc[0]), f"{better}, {worse}"]
        rows.append(cells)
    heads = [head for m in measures for head in (_COLUMNS[m][0], "better, worse")]
    return _table(["regime", *heads], rows)


def recipes(measures: Sequence[str] = ("chamfer", "emd", "iou")) -> str:
    """Return the scores that recipes of training reach in some seconds: the quality benchmark's."""
    table = _recipes()
    lengths = sorted(table["asked_seconds"].unique())
    rows = []
    for recipe, part in table.groupby("recipe", sort=False):
        runs = part.set_index("asked_seconds")
        cells = []
        for seconds in lengths:
            run = runs.loc[seconds]
            numbers = (f"{_COLUMNS[m][1] * run[m]:.{_COLUMNS[m][2]}f}" for m in measures)
            taken = f"{run['steps']:,} steps, {run['seconds']:.0f} s"
            cells.append(f"{' / '.join(numbers)} ({taken})")
        rows.append([str(recipe), *cells])
    return _table(["recipe", *(f"{seconds} s" for seconds in lengths)], rows)


def recipes_figure(alt: str) -> str:
    """Draw the recipes' scores into a file beside the pages; return the link to it."""
    write_bytes_atomic(FOLDER / "recipes.svg", to_svg(draw(_recipes())))
    return f"![{alt}](recipes.svg)"


def recipe_of(recipe: str, column: str, seconds: int) -> str:
    """Return a number of a recipe after so many seconds, for a sentence."""
    runs = _recipes().set_index(["recipe", "asked_seconds"])
    _, factor, places = _COLUMNS.get(column, ("", 1, 0))
    return f"{factor * runs.loc[(recipe, seconds), column]:.{places}f}"


def _recipes() -> pd.DataFrame:
    return pd.read_csv(DATA / "quality.csv")


def seeds_of(name: str, column: str, regime: str, **where: Any) -> str:
    """Return a number of a regime's runs for a sentence: its mean over categories and seeds."""
    _, factor, places = _COLUMNS[column]
    return f"{factor * study(name).per_seed(regime, column, **where).mean():.{places}f}"


def figure(kind: str, name: str, alt: str, **columns: Any) -> str:
    """Draw a figure of a study's runs into a file beside the pages; return the link to it."""
    part = study(name).where(**columns)
    draw: dict[str, Callable[[], Figure]] = {
        "curves": lambda: cumulative_curves(part.samples, part.protocol),
        "selection": lambda: selection_histograms(part.samples),
        "budget": lambda: budget_bars(part.samples, part.protocol),
        "counts": lambda: template_count_curves(
            part.runs.assign(protocol=part.protocol.name), part.protocol
        ),
    }
    ending = "".join(f"-{value}" for value in columns.values() if isinstance(value, (str, int)))
    file = f"{name.replace('+', '-')}-{kind}{ending}.svg"
    write_bytes_atomic(FOLDER / file, to_svg(draw[kind]()))
    return f"![{alt}]({file})"


def pages() -> dict[str, str]:
    """Return the text of every page by its name, and write the figures."""
    environment = Environment(
        loader=FileSystemLoader(TEXTS), undefined=StrictUndefined, keep_trailing_newline=True
    )
    functions = (
        setup, scores, changes, changes_in, counts, changes_by_category, change, verdicts, word,
        stability, budgets, course, versions, versus, claim, agreement, same_template, seeds_of,
        labels, figure, by_category, categories_of, against, drift, right_category, budgets_of,
        recipes, recipes_figure, recipe_of,
    )  # fmt: skip
    environment.globals.update({f.__name__: f for f in functions})
    environment.globals["regime_studies"] = _REGIME_STUDIES
    return {
        path.name: _MADE.format(path.name) + environment.get_template(path.name).render()
        for path in sorted(TEXTS.glob("*.md"))
    }


def keep(name: str, runs: Path, protocol: str | None, commands: Sequence[str]) -> None:
    """Keep the finished runs of a folder as a study, or as a part of one."""
    about = {"processor": processor(), "commands": list(commands)}
    file = DATA / f"{name}.zip"
    file.parent.mkdir(parents=True, exist_ok=True)
    write_archive(require_runs(runs), runs, file, about, protocol)
    print(f"{file}: {file.stat().st_size / 1e6:.2f} MB")


def processor() -> str:
    """Return what the numbers depend on: the processor, its instructions, threads, torch.

    So studies are to be kept where, and with the OMP_NUM_THREADS with which, they were trained.
    """
    names = [
        line.partition(":")[2].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    kind = names[0] if names else platform.machine()
    capability = torch.backends.cpu.get_cpu_capability()
    threads = torch.get_num_threads()
    told = "one thread" if threads == 1 else f"{threads} threads"
    return f"{kind} ({capability}, {told}), torch {torch.__version__}"


def compare(name: str, folder: Path) -> None:
    """Print the scores of runs that were trained again beside those of the kept runs."""
    kept = study(name)
    runs = [run for run in require_runs(folder) if run.finished]
    again = load_samples(runs, find_protocol(runs, kept.protocol.name).name)
    again["run"] = [str(Path(run).relative_to(folder)) for run in again["run"]]
    for run, new in again.groupby("run", sort=False):
        old = kept.samples[kept.samples["run"] == run]
        if old.empty:
            print(f"{run}: not in the kept study")
            continue
        both = pd.concat([new.assign(setup="again", run="again"), old.assign(setup="kept")])
        for measure in kept.protocol.metrics:
            row = compare_runs(both, kept.protocol, measure.name, "setup").iloc[0]
            print(f"{run}: {row['statement']}")


def _few(values: pd.Series) -> str:
    return ", ".join(str(value) for value in sorted(set(values)))


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heads, ["---", *["---:"] * (len(heads) - 1)], *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def main() -> int:
    """See the top of this file."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("action", nargs="?", default="write", choices=("write", "keep", "compare"))
    parser.add_argument("study", nargs="?", help="its name")
    parser.add_argument("runs", nargs="?", type=Path, help="folder of its runs")
    parser.add_argument("--protocol", help="keep: whose scores (default: the training's)")
    parser.add_argument("--command", action="append", default=[], help="keep: what trained them")
    given = parser.parse_args()
    actions: dict[str, Callable[[], None]] = {
        "keep": partial(keep, given.study, given.runs, given.protocol, given.command),
        "compare": partial(compare, given.study, given.runs),
    }
    if given.action in actions:
        if given.runs is None:
            parser.error(f"{given.action} needs the name of a study and a folder of runs")
        actions[given.action]()
        return 0
    for name, text in pages().items():
        write_atomic(FOLDER / name, text)
        print(FOLDER / name)
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except UserError as error:
        sys.exit(f"error: {error}")
