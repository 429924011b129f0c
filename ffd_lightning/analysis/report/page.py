"""One page about all runs of a folder, which holds everything that it shows."""

from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import pandas as pd
import yaml
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from ffd_lightning.analysis import plots, tables
from ffd_lightning.analysis.compare import is_mean
from ffd_lightning.analysis.naming import differing
from ffd_lightning.analysis.paper import PROTOCOL, beside_paper
from ffd_lightning.analysis.report.gallery import Meshes, data_uri, gallery, open_runs
from ffd_lightning.analysis.report.selection import bars, pictures
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.table import Table
from ffd_lightning.errors import DataError, UserError
from ffd_lightning.evaluation.opened import RunOpener
from ffd_lightning.files import write_atomic

_PACKAGE = "ffd_lightning.analysis.report"


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
        protocol: whose scores are shown; by default that of most trainings.
        gallery_runs: of how many runs examples are shown, and pictures of the templates: the first
            seed of each setting, of more settings a spread.

    Returns:
        The page's path.

    Raises:
        DataError: no run, or none evaluated under this protocol; `study.yaml` is damaged.
    """
    results, about = Results.read(folder, protocol), folder / "study.yaml"
    try:
        study = dict(yaml.safe_load(about.read_text("utf-8"))) if about.is_file() else {}
    except (TypeError, ValueError, yaml.YAMLError):
        raise DataError(f"{about} is damaged: run the study again, or remove it") from None
    opened = open_runs(results, open_run, gallery_runs)
    environment = _environment()
    environment.globals["pictures"] = pictures(results, opened)

    def drawn(template: str, values: dict[str, Any]) -> Markup:
        return Markup(environment.get_template(template).render(values))

    sections: list[Section] = []
    meshes: Meshes = {}
    if results.samples.empty:
        nothing = _text("No run has results yet: see the end of the page.")
        sections.append(Section("scores", "All numbers", [nothing]))
    else:
        sections += [_best(results), _scores(results)]
    if study.get("beside_paper"):
        sections.append(Section("paper", "Beside the paper", [_beside_paper(folder)]))
    if not results.samples.empty:
        if gallery_runs:
            shown, meshes = gallery(results, opened, gallery_runs)
            block = drawn("gallery.html", shown)
            sections.append(Section("examples", "The same images through every run", [block]))
        sections.append(_selection(results, drawn("selection.html", bars(results))))
        sections.append(Section("plots", "Distribution of scores", [_curves(results)]))
    sections.append(_settings(results))
    if (missing := tables.without_results(results)) is not None:
        sections.append(Section("missing", missing.title, [missing.html()]))
    states = results.runs["state"].value_counts().sort_index()
    page = drawn(
        "page.html",
        {
            "title": str(study.get("study") or folder.resolve().name),
            "question": study.get("question"),
            "command": study.get("command"),
            "states": [(str(state), int(count)) for state, count in states.items()],
            "facts": {
                "Protocol": results.protocol.name,
                "Categories": ", ".join(results.runs["category"].dropna().unique()),
            },
            "sections": sections,
            "meshes": meshes,
        },
    )
    path = folder / "report.html"
    write_atomic(path, page)
    return path


def _environment() -> Environment:
    """Return where the page's templates are, with its style and its script."""
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
    return environment


def _best(results: Results) -> Section:
    """Open with the sentence that says which setting is best in what, and what is decided."""
    try:
        found = tables.best(results)
    except DataError as error:
        return Section("best", "Which is best?", [_text(str(error), "lead")])
    lead = _text(" ".join(verdict(results, found)), "lead")
    return Section("best", "Which is best?", [lead, tables.best_by_metric(results, found).html()])


def verdict(results: Results, found: pd.DataFrame) -> tuple[str, ...]:
    """Say which setting is best by which metrics, and how many of the leads are shown.

    `found` is what `tables.best` has found in the results.
    """
    overall = found[found["category"].map(is_mean)]
    if overall.empty and results.samples["category"].nunique() == 1:
        overall = found
    if overall.empty:
        return ("Each category has its own best.",)
    sentences = []
    for setting, rows in overall.groupby("a", sort=False):
        *titles, last = (results.protocol.metric(name).title for name in rows["measure"])
        metrics = f"{', '.join(titles)} and {last}" if titles else last
        sentences.append(f"Best {metrics}: {setting}.")
    if overall["trainings"].all():
        count = f"{overall['differs'].sum()} of {len(overall)}"
        decided = f"Shown to hold for other trainings and test shapes: {count} leads."
    else:
        decided = "One training decides nothing: another seed may give another order."
    settings = results.deciding.loc[results.scored["run"]]
    said = f"category regime templates {' '.join(results.scored['variant'])}"
    others = [k for k in settings if settings[k].nunique() > 1 and k.split(".")[0] not in said]
    if others:
        decided += f" The settings differ in {', '.join(others[:3])}, too (see Settings)."
    return " ".join(sentences), decided


def _scores(results: Results) -> Section:
    found = [
        tables.scores(results),
        tables.references(results),
        tables.decomposition(results),
        tables.deformed_meshes(results),
    ]
    blocks = [_titled(table) for table in found if table is not None]
    if lacking := len(results.unscored):
        blocks.append(_text(f"Runs without results: {lacking} (end of the page)."))
    return Section("scores", "All numbers", blocks)


def _beside_paper(folder: Path) -> Markup:
    """Return the finished runs beside the paper's Table 3, whatever protocol the page is about."""
    try:
        return beside_paper(Results.read(folder, PROTOCOL)).html()
    except UserError as error:
        return _text(f"There is nothing to set beside the paper's Table 3: {error}")


def _selection(results: Results, drawn: Markup) -> Section:
    found = filter(None, (tables.selection(results), tables.seeds_agree(results)))
    return Section("selection", "Template selection", [drawn, *map(_titled, found)])


def _curves(results: Results) -> Markup:
    """Return plots of the main metric and of one that goes the other way, with their captions."""
    protocol, main = results.protocol, results.protocol.main_metric
    others = [m for m in protocol.metrics if m.higher_is_better != main.higher_is_better]
    found: list[tuple[Figure, str]] = []
    for metric in [main, *others[:1]]:
        if "templates" in differing(results.scored) and (results.scored["variant"] == "").all():
            figure = plots.template_count_curves(results.scored, protocol, metric.name)
            found.append((figure, f"{metric.title} against T."))
        for category, samples in results.samples.groupby("category", sort=False):
            figure = plots.cumulative_curves(samples, protocol, metric.name, results.samples)
            caption = f"{metric.title} of the selected template on category {category}: "
            caption += "deformed (solid) and as it is (dotted). Further up is better."
            found.append((figure, caption))
    drawn = [
        Markup(
            '<figure class="plot"><img src="{}" alt="{}"><figcaption>{}</figcaption></figure>\n'
        ).format(data_uri(plots.to_svg(figure), "image/svg+xml"), caption, caption)
        for figure, caption in found
    ]
    return Markup('<div class="figures">\n{}</div>').format(Markup("").join(drawn))


def _settings(results: Results) -> Section:
    table, shared = tables.differing_settings(results)
    items = Markup("").join(Markup("<li>{}</li>").format(x) for x in shared)
    same = "All runs have the same settings, but for category and seed."
    blocks = [_text(same) if table is None else table.html()]
    blocks.append(
        Markup("<details><summary>{}</summary>\n<ul>{}</ul></details>").format(
            f"{len(shared)} settings that all runs share", items
        )
    )
    return Section("settings", "Settings", blocks)


def _titled(table: Table) -> Markup:
    return Markup("<h3>{}</h3>\n{}").format(table.title, table.html())


def _text(words: str, kind: str = "text") -> Markup:
    return Markup('<p class="{}">{}</p>').format(kind, words)
