"""One page about all runs of a folder.

    python -m ffd_lightning.analysis.report DIR
    python -m ffd_lightning.analysis.report DIR protocol=modern data_root=data gallery=4

The page, `DIR/report.html`, holds everything that it shows and opens from disk, without a network.
The protocol is the one that most runs were evaluated under, unless it is named; `data_root` is
where the prepared data is, if not where the runs left it; `gallery` is of how many runs examples
are shown: 12 unless it is given, 0 for none.
"""

from __future__ import annotations

import sys
from datetime import datetime
from html import escape
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import Any

from omegaconf import OmegaConf

from ffd_lightning.analysis.report import distributions, examples, listings, scores
from ffd_lightning.analysis.report.fragments import facts, paragraph
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.app.cli import run_app
from ffd_lightning.errors import ConfigError
from ffd_lightning.files import write_atomic

GALLERY_RUNS = 12


def write_report(
    folder: Path,
    protocol: str | None = None,
    data_root: Path | None = None,
    gallery_runs: int = GALLERY_RUNS,
) -> Path:
    """Write `report.html` about all runs below a folder; the same runs give the same bytes.

    Runs that are unfinished, failed, damaged or evaluated under another protocol are listed with
    the reason why they have no results.

    Args:
        folder: of a sweep or a run; its `study.yaml`, if there, names `study`, `question` and
            `command`.
        protocol: whose scores are shown; that of most samples where it is None.
        data_root: where the runs' prepared data is (`paths.data`), if not where it was.
        gallery_runs: of how many runs examples are shown, see `gallery.choose_runs`.

    Returns:
        The page's path.

    Raises:
        ConfigError: no such protocol.
        DataError: no run, or a folder that cannot be written.
    """
    sweep = Sweep.read(folder, protocol)
    study = _study(folder)
    gallery, meshes = examples.gallery(sweep, data_root, gallery_runs)
    sections = [
        scores.results(sweep),
        scores.comparisons(sweep),
        distributions.curves(sweep),
        distributions.selection(sweep, data_root),
        gallery,
        listings.settings(sweep),
        listings.missing(sweep),
    ]
    title = str(study.get("study") or folder.resolve().name)
    page = files("ffd_lightning.analysis.report")
    read = {name: (page / name).read_text(encoding="utf-8") for name in _PARTS}
    text = Template(read["page.html"]).substitute(
        title=escape(title),
        style=read["page.css"],
        script=read["viewer.js"],
        lead=paragraph(str(study["question"]), "lead") if study.get("question") else "",
        facts=facts(_facts(sweep)),
        contents="\n".join(_link(section) for section in sections if section),
        sections="\n".join(section for section in sections if section),
        meshes=meshes.replace("<", "\\u003c"),
        footer=_footer(study),
    )
    path = folder / "report.html"
    write_atomic(path, text)
    return path


_PARTS = ("page.html", "page.css", "viewer.js")


def _study(folder: Path) -> dict[str, Any]:
    """Return what `study.yaml` says, {} where there is none.

    Raises:
        ConfigError: it is damaged.
    """
    file = folder / "study.yaml"
    if not file.is_file():
        return {}
    try:
        study = OmegaConf.to_container(OmegaConf.load(file))
        assert isinstance(study, dict)
    except Exception as error:  # a YAML parser meets anything in a damaged file
        reason = (str(error) or "it is no mapping").splitlines()[0]
        raise ConfigError(f"{file} cannot be read ({reason}): mend or remove it") from None
    return {str(key): value for key, value in study.items()}


def _facts(sweep: Sweep) -> dict[str, str]:
    """Return the numbers at the top of the page, as HTML."""
    counts = sweep.table["state"].value_counts()
    if sweep.damaged:
        counts["damaged"] = len(sweep.damaged)
    shown = ", ".join(
        f'<span class="{escape(str(state))}">{count} {escape(str(state))}</span>'
        for state, count in sorted(counts.items())
    )
    result = {"Runs": shown, "Protocol": escape(sweep.protocol.name)}
    result["Categories"] = escape(", ".join(dict.fromkeys(map(str, sweep.table["category"]))))
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


def _link(section: str) -> str:
    """Return a link to a section, made from its first lines: `<section id="...">`, `<h2>...`."""
    key = section.split('"', 2)[1]
    title = section.split("<h2>", 1)[1].split("</h2>", 1)[0]
    return f'<a href="#{key}">{title}</a>'


def _footer(study: dict[str, Any]) -> str:
    made = "<p>Made by <code>python -m ffd_lightning.analysis.report</code>."
    if study.get("command"):
        made += f" The runs: <code>{escape(str(study['command']))}</code>"
    return f"{made}</p>"


def main(arguments: list[str]) -> int:
    """Write the report of the folder that is named and print its path.

    Raises:
        ConfigError: no folder, or an argument that there is not.
    """
    if not arguments or {"-h", "--help"} & set(arguments):
        print(__doc__)
        return 0 if arguments else 2
    given = dict(a.split("=", 1) for a in arguments if "=" in a)
    folders = [a for a in arguments if "=" not in a]
    unknown = sorted(set(given) - {"protocol", "data_root", "gallery"})
    if unknown or len(folders) != 1:
        wrong = f"there is no {unknown[0]}=" if unknown else f"{len(folders)} folders are named"
        raise ConfigError(f"{wrong}: give one folder and protocol=, data_root=, gallery=")
    gallery = given.get("gallery", str(GALLERY_RUNS))
    if not gallery.isdigit():
        raise ConfigError(f"gallery={gallery} must be a number of runs, 0 for none")
    root = given.get("data_root")
    folder = Path(folders[0])
    print(
        write_report(
            folder,
            given.get("protocol"),
            None if root is None else Path(root),
            int(gallery),
        )
    )
    return 0


if __name__ == "__main__":
    run_app(lambda: sys.exit(main(sys.argv[1:])))
