"""One page about all runs of a folder, which holds everything that it shows."""

from __future__ import annotations

import re
from datetime import datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

import yaml
from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup, escape

from ffd_lightning.analysis.report import distributions, listings
from ffd_lightning.analysis.report.answers import answers
from ffd_lightning.analysis.report.beside_paper import beside_paper
from ffd_lightning.analysis.report.comparisons import comparisons
from ffd_lightning.analysis.report.examples import examples
from ffd_lightning.analysis.report.matrix import matrix
from ffd_lightning.analysis.report.opened import open_runs
from ffd_lightning.analysis.report.standing import standing
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.analysis.report.templates import pictures
from ffd_lightning.analysis.wording import measure_title
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.opened import RunOpener
from ffd_lightning.files import write_atomic

_PACKAGE = "ffd_lightning.analysis.report"


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
    sweep = Sweep.read(folder, protocol)
    study = _study(folder)
    opened = open_runs(sweep, open_run, gallery_runs)
    shown = examples(sweep, opened, gallery_runs)
    ranked = standing(sweep)
    sections = [
        answers(sweep, ranked),
        matrix(sweep, ranked),
        comparisons(sweep),
        beside_paper(sweep) if study.get("beside_paper") else None,
        shown,
        distributions.selection(sweep),
        distributions.budget(sweep),
        distributions.curves(sweep),
        listings.settings(sweep),
        listings.missing(sweep),
    ]
    text = _template().render(
        title=str(study.get("study") or folder.resolve().name),
        question=study.get("question"),
        command=study.get("command"),
        states=_states(sweep),
        facts=_facts(sweep),
        sections=[section for section in sections if section is not None],
        meshes={} if shown is None else shown.meshes,
        pictures=pictures(sweep, opened),
    )
    path = folder / "report.html"
    try:
        write_atomic(path, text)
    except OSError as error:
        raise DataError(f"cannot write {path}: {error.strerror or error}") from None
    return path


def _template() -> Template:
    environment = Environment(
        loader=PackageLoader(_PACKAGE, "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["measure_title"] = measure_title
    environment.filters["breakable"] = _breakable
    for name, file in (("style", "page.css"), ("script", "viewer.js")):
        environment.globals[name] = Markup(files(_PACKAGE).joinpath(file).read_text("utf-8"))
    return environment.get_template("page.html")


def _breakable(name: str) -> Markup:
    """Return a name that may be broken into lines where its words end."""
    return Markup(re.sub(r"([._/])", r"\1<wbr>", str(escape(name))))


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


def _states(sweep: Sweep) -> list[tuple[str, int]]:
    """Return how many runs are in which state."""
    counts = {
        str(state): int(count) for state, count in sweep.table["state"].value_counts().items()
    }
    if sweep.damaged:
        counts["damaged"] = len(sweep.damaged)
    return sorted(counts.items())


def _facts(sweep: Sweep) -> dict[str, str]:
    """Return the other names and values at the top of the page."""
    result = {"Protocol": sweep.protocol.name}
    result["Categories"] = ", ".join(dict.fromkeys(map(str, sweep.table["category"])))
    if len(sweep.samples):
        sizes = sorted({int(n) for n in sweep.scored["num_samples"]})
        span = f"{sizes[0]:,}" if len(sizes) == 1 else f"{sizes[0]:,} to {sizes[-1]:,}"
        result["Test samples of a run"] = span
    times = [str(time) for run in sweep.runs if (time := run.status.get("time"))]
    try:
        last = max(datetime.fromisoformat(time).date() for time in times)
        result["Last run"] = f"{last:%d %B %Y}".lstrip("0")
    except ValueError:
        pass  # no status, or a time that nobody can read
    return result
