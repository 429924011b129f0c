"""One page about all runs of a folder, which holds everything that it shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import datetime
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from ffd_lightning.analysis import plots, tables
from ffd_lightning.analysis.budget import SHARES, error_budget
from ffd_lightning.analysis.paper import PROTOCOL, beside_paper
from ffd_lightning.analysis.report.gallery import data_uri, examples, open_runs
from ffd_lightning.analysis.report.selection import bars, pictures
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.runs import load_runs
from ffd_lightning.analysis.selection import Families, run_families
from ffd_lightning.analysis.table import Table, number
from ffd_lightning.analysis.tables import Ranked
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.opened import RunOpener
from ffd_lightning.evaluation.protocols import Metric
from ffd_lightning.files import write_atomic

_PACKAGE = "ffd_lightning.analysis.report"
_MANY = 12  # rows that are shown unasked


class Section(NamedTuple):
    """A part of the page: its anchor, title, and blocks of HTML below each other."""

    key: str
    title: str
    blocks: Sequence[Markup]


def write_report(
    folder: Path, open_run: RunOpener, protocol: str | None = None, gallery_runs: int = 12
) -> Path:
    """Write `report.html` about all runs below a folder; the same runs give the same bytes.

    Runs that are unfinished, failed, damaged or evaluated under another protocol are listed with
    the reason why they have no results.

    Args:
        folder: of a sweep or a run; its `study.yaml`, if there, names `study`, `question` and
            `command`, and says whether to set the results `beside_paper`.
        open_run: opens the runs whose examples are shown.
        protocol: whose scores are shown; that of most runs where it is None.
        gallery_runs: of how many runs examples are shown, see `gallery.choose_runs`; also
            whose templates have pictures.

    Returns:
        The page's path.

    Raises:
        ConfigError: no run was evaluated under this protocol.
        DataError: no run, or a folder that cannot be written.
    """
    results = Results.read(folder, protocol)
    study = _study(folder)
    opened = open_runs(results, open_run, gallery_runs)
    environment = Environment(
        loader=PackageLoader(_PACKAGE, "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    for name, file in (("style", "page.css"), ("script", "viewer.js")):
        environment.globals[name] = Markup(files(_PACKAGE).joinpath(file).read_text("utf-8"))
    environment.globals["pictures"] = pictures(results, opened)
    sections: list[Section] = []
    meshes: dict[str, Any] = {}
    if len(results.samples):
        ranking = tables.ranked(results)
        sections = [_best(results, ranking), _scores(results, ranking)]
        if compared := tables.pairs(results, ranking):
            blocks = [_details(table.title, table.html()) for table in compared]
            sections.append(Section("pairs", "Pair by pair", blocks))
    else:
        nothing = _text("No run has results yet: see the end of the page.")
        sections = [Section("scores", "All numbers", [nothing])]
    if study.get("beside_paper"):
        sections.append(Section("paper", "Beside the paper", [_beside_paper(results)]))
    if len(results.samples):
        if gallery_runs:
            shown = examples(results, opened, gallery_runs)
            meshes = shown.pop("meshes")
            block = Markup(environment.get_template("gallery.html").render(shown))
            sections.append(Section("examples", "The same images through every run", [block]))
        drawn = Markup(environment.get_template("selection.html").render(bars(results)))
        sections += [_selection(results, drawn), *_budget(results), _curves(results)]
    sections += [_settings(results), *_missing(results)]
    text = environment.get_template("page.html").render(
        title=str(study.get("study") or folder.resolve().name),
        question=study.get("question"),
        command=study.get("command"),
        states=_states(results),
        facts=_facts(results),
        sections=sections,
        meshes=meshes,
    )
    path = folder / "report.html"
    try:
        write_atomic(path, text)
    except OSError as error:
        raise DataError(f"cannot write {path}: {error.strerror or error}") from None
    return path


def _best(results: Results, ranking: Ranked) -> Section:
    """Open with the sentence that says which setting is best in what, and whether it is shown."""
    blocks = [Markup('<p class="lead">{}</p>').format(_lead(results, ranking))]
    table = tables.best_by_metric(results, ranking)
    if table is not None:
        html = table.html()
        folded = len(table.rows) > _MANY
        blocks.append(_details(f"{len(table.rows)} rankings", html) if folded else html)
    if ranking.error:
        blocks.append(_text(f"Settings are not compared: {ranking.error}", "note"))
    if ranking.left_out:
        left = f"Of more than {_MANY} settings the best are compared ({ranking.left_out} are not)."
        blocks.append(_text(left, "note"))
    return Section("best", "Which is best?", blocks)


def _lead(results: Results, ranking: Ranked) -> str:
    """Say who is best by which measures, how many leads are shown, and of how many trainings."""
    found = [(m, b) for m in results.protocol.metrics if (b := ranking.overall(m.name))]
    if not found:
        if ranking.best:
            return "Each category has its own best."
        if len(results.scored) == 1:
            return "One run: there is nothing to compare it with."
        return "Nothing is compared: see the numbers of each run."
    by_best: dict[str, list[str]] = {}
    for measure, best in found:
        by_best.setdefault(next(iter(best.means)), []).append(measure.title)
    told = [f"Best {_listed(names)}: {ranking.titles[k]}." for k, names in by_best.items()]
    shown = sum(best.shown for _, best in found)
    told.append(f"Shown on these test shapes: {shown} of {len(found)} leads.")
    if any(best.seeds == 1 for _, best in found):
        told.append("One training each: another seed may give another order.")
    return " ".join(told)


def _scores(results: Results, ranking: Ranked) -> Section:
    protocol, keys = results.protocol, results.keys
    runs = tables.with_parts(results.scored, results.samples, protocol)
    scores = tables.scores(runs, protocol, keys)
    found = [
        tables.with_intervals(scores, results, ranking),
        tables.references(runs, protocol),
        tables.decomposition(runs, protocol, keys),
        tables.deformed_meshes(runs, keys),
    ]
    blocks = [_titled(table) for table in found if table is not None]
    if lacking := len(results.unscored) + len(results.damaged):
        blocks.append(_text(f"{lacking} more runs have no results (end of the page)."))
    return Section("scores", "All numbers", blocks)


def _beside_paper(results: Results) -> Markup:
    """Return the finished runs beside the paper's Table 3, whatever protocol the page is about."""
    try:
        return beside_paper(load_runs(results.runs, PROTOCOL)).html()
    except DataError as error:
        return _text(f"There is nothing to set beside the paper's Table 3: {error}")


def _selection(results: Results, drawn: Markup) -> Section:
    families: Families = {}
    blocks = [drawn]
    try:
        families = run_families(results.runs)
    except DataError as error:
        blocks.append(_text(f"Families are not shown: {error}", "note"))
    blocks.append(_titled(tables.selection(results, families)))
    try:
        if (agreement := tables.seeds_agree(results.samples)) is not None:
            blocks.append(_titled(agreement))
    except DataError as error:
        blocks.append(_text(f"Seeds are not held against each other: {error}", "note"))
    return Section("selection", "Template selection", blocks)


def _budget(results: Results) -> list[Section]:
    try:
        error_budget(results.samples, results.protocol)
    except DataError:  # no run has its references, or more is better
        return []
    told = f"What the {results.protocol.main_metric.title} of each run is made of."
    figure = plots.budget_bars(results.samples, results.protocol)
    note = "; ".join(f"{share.name}: {share.meaning}" for share in SHARES)
    blocks = [_plots([plot(figure, told, told)]), _text(f"{note}.", "note")]
    return [Section("budget", "Error budget", blocks)]


def _curves(results: Results) -> Section:
    protocol, main = results.protocol, results.protocol.main_metric
    others = [m for m in protocol.metrics if m.higher_is_better != main.higher_is_better]
    shown = [main, *others[:1]]
    found = []
    if results.scored["templates"].nunique() > 1 and "setup" not in results.keys:
        for measure in shown:
            title = f"{measure.title} against T"
            figure = plots.template_count_curves(results.scored, protocol, measure.name)
            found.append(plot(figure, title, f"{title}."))
    for category, samples in results.samples.groupby("category", sort=False):
        for measure in shown:
            found.append(
                plot(
                    plots.cumulative_curves(samples, protocol, measure.name),
                    f"Cumulative {measure.title} of {category}. {_medians(samples, measure)}",
                    f"{measure.title} of the selected template on category {category}: deformed "
                    "(solid) and as it is (dotted). Further up is better.",
                )
            )
    return Section("curves", "Distribution of scores", [_plots(found)])


def _medians(samples: pd.DataFrame, measure: Metric) -> str:
    """Return what a cumulative curve says, for those who do not see it."""
    labels = plots.run_labels(samples)
    medians = samples.groupby("run", sort=False)[measure.name].median()
    values = (f"{labels[str(run)]} {number(measure.factor * m)}" for run, m in medians.items())
    return f"Medians of the deformed templates: {'; '.join(values)}."


def _settings(results: Results) -> Section:
    table, shared = tables.differing_settings(results)
    items = Markup("<ul>{}</ul>").format(
        Markup("").join(Markup("<li>{}</li>").format(x) for x in shared)
    )
    blocks = [_text("All runs have the same settings.")]
    if table is not None:
        many = len(table.rows) > _MANY
        blocks = [_details(table.title, table.html()) if many else table.html()]
    blocks.append(_details(f"{len(shared)} settings that all runs share", items))
    return Section("settings", "Settings", blocks)


def _missing(results: Results) -> list[Section]:
    table = tables.without_results(results)
    return [] if table is None else [Section("missing", table.title, [table.html()])]


def plot(figure: Figure, alt: str, caption: str) -> Markup:
    """Return a figure with its description and caption.

    It is an image of its own, since names inside of it recur in others.
    """
    source = data_uri(plots.to_svg(figure), "image/svg+xml")
    return Markup(
        '<figure class="plot"><img src="{}" alt="{}"><figcaption>{}</figcaption></figure>\n'
    ).format(source, alt, caption)


def _plots(figures: Sequence[Markup]) -> Markup:
    single = " single" if len(figures) == 1 else ""
    return Markup('<div class="figures{}">\n{}</div>').format(single, Markup("").join(figures))


def _titled(table: Table) -> Markup:
    return Markup("<h3>{}</h3>\n{}").format(table.title, table.html())


def _text(words: str, kind: str = "") -> Markup:
    return (
        Markup('<p class="{}">{}</p>').format(kind, words)
        if kind
        else Markup("<p>{}</p>").format(words)
    )


def _details(summary: str, block: Markup) -> Markup:
    return Markup("<details><summary>{}</summary>\n{}</details>").format(summary, block)


def _study(folder: Path) -> dict[str, Any]:
    """Return what `study.yaml` says, {} where there is none.

    Raises:
        ConfigError: it is damaged.
    """
    file = folder / "study.yaml"
    if not file.is_file():
        return {}
    try:
        study = yaml.safe_load(file.read_text(encoding="utf-8"))
        reason = "" if isinstance(study, dict) else "it is no mapping"
    except (OSError, ValueError, yaml.YAMLError) as error:
        reason = " ".join(str(error).split())
    if reason:
        raise ConfigError(f"{file} cannot be read ({reason}): mend or remove it")
    return {str(key): value for key, value in study.items()}


def _states(results: Results) -> list[tuple[str, int]]:
    """Return how many runs are in which state."""
    counts = {str(k): int(count) for k, count in results.table["state"].value_counts().items()}
    if results.damaged:
        counts["damaged"] = len(results.damaged)
    return sorted(counts.items())


def _facts(results: Results) -> dict[str, str]:
    """Return the other names and values at the top of the page."""
    found = {"Protocol": results.protocol.name}
    found["Categories"] = ", ".join(dict.fromkeys(map(str, results.table["category"])))
    if len(results.samples):
        sizes = sorted({int(n) for n in results.scored["num_samples"]})
        span = f"{sizes[0]:,}" if len(sizes) == 1 else f"{sizes[0]:,} to {sizes[-1]:,}"
        found["Test samples of a run"] = span
    times = [str(time) for run in results.runs if (time := run.status.get("time"))]
    try:
        last = max(datetime.fromisoformat(time).date() for time in times)
        found["Last run"] = f"{last:%d %B %Y}".lstrip("0")
    except ValueError:
        pass  # no status, or a time that nobody can read
    return found


def _listed(names: Iterable[str]) -> str:
    """Join words: "a, b and c"."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last
