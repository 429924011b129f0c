"""What a data set holds, before anything is prepared.

    ffd doctor data=shapenet data.root=DIR

Settings are those of prepare; category=chair looks at one category alone. A few shapes of each
category are prepared on trial, in a folder that is removed again, and drawn beside shapes that
stand as they should: sheets=DIR says where to (by default <paths.data>/sheets), sheets=null draws
nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ffd_lightning.app.build import build_preparations, build_source
from ffd_lightning.app.checks import validate
from ffd_lightning.app.config import CategoryConfig, DoctorConfig, Split
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.studies import absent_categories, say_absent
from ffd_lightning.data.categories import PAPER_CATEGORIES, SYNSETS
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.preparation.trial import Finding, examine
from ffd_lightning.data.source import Source
from ffd_lightning.data.sources.shapenet import ShapeNetSource
from ffd_lightning.data.splits import AutoSplit, SplitInput, make_split
from ffd_lightning.data.templates.summary import outlier_note, outlier_rows
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.terminal import table_console

SCHEMA = DoctorConfig

_EXAMPLES = 3  # shapes named for each reason


def report(findings: list[Finding], console: Console) -> None:
    """Print a table of categories, and below it what a user should know."""
    table = Table(box=None, header_style="bold")
    for column in ("category", "shapes", "unusable", "paper's templates", "prepared"):
        table.add_column(column, justify="left" if column == "category" else "right")
    for finding in findings:
        if finding.problem:
            table.add_row(finding.name, "-", "-", "-", "-")
            continue
        there = len(finding.templates) - len(finding.absent)
        table.add_row(
            finding.name,
            f"{finding.shapes:,}",
            f"{len(finding.unusable):,}",
            f"{there} of {len(finding.templates)}" if finding.templates else "-",
            "yes" if finding.prepared else "no",
        )
    console.print(table)
    for finding in findings:
        for line in _notes(finding):
            console.print(f"{finding.name}: {line}", markup=False, highlight=False, soft_wrap=True)


def _notes(finding: Finding) -> list[str]:
    if finding.problem:
        return [finding.problem]
    lines = list(finding.notes)
    reasons: dict[str, list[str]] = {}
    for shape_id, reason in finding.unusable.items():
        reasons.setdefault(reason, []).append(shape_id)
    lines += [f"{len(ids):,} shapes: {why} ({_some(ids)})" for why, ids in reasons.items()]
    if finding.absent:
        lines.append(
            f"{len(finding.absent)} of the paper's templates are absent or cannot be used, "
            f"`medoids` ones take their places: {', '.join(finding.absent)}"
        )
    if finding.rejected:
        examples = "; ".join(f"{i}: {why}" for i, why in list(finding.rejected.items())[:_EXAMPLES])
        lines.append(f"{len(finding.rejected)} of {finding.trial} tried are rejected ({examples})")
    if finding.warnings:
        tried = "" if finding.prepared else " of those tried"
        lines.append(f"warnings{tried}: {finding.warnings}")
    if finding.prepared:
        lines.append(f"{finding.prepared}")
    if finding.sheet:
        lines.append(finding.sheet)
    return lines


def _some(ids: list[str]) -> str:
    return ", ".join(ids[:_EXAMPLES]) + (", ..." if len(ids) > _EXAMPLES else "")


def _summary(cfg: DoctorConfig, source: Source) -> list[str]:
    """Return what is true of all categories together."""
    lines = []
    if cfg.data.name == "shapenet":
        absent = absent_categories(source, PAPER_CATEGORIES)
        if absent:
            left = ",".join(name for name in PAPER_CATEGORIES if name not in absent)
            lines.append(
                f"of the paper's 13 categories there are not: {say_absent(source, absent)}. "
                f"The study paper_table then needs category={left}"
            )
    return lines


def _count(source: Source, name: str) -> int:
    """Return how many shapes a category has, 0 for a folder without any."""
    try:
        return len(source.shape_ids(name))
    except DataError:
        return 0


def _check_level(root: Path, counts: list[int]) -> None:
    """Refuse a folder of shapes where one of categories is meant.

    Raises:
        ConfigError: hardly any of its folders holds more than one shape.
    """
    if len(counts) > 3 and sum(count > 1 for count in counts) <= len(counts) // 10:
        raise ConfigError(
            f"data.root={root} seems to be the folder of one category: it has {len(counts)} "
            f"folders of one shape each. Set data.root={root.absolute().parent}"
        )


def _examined(cfg: DoctorConfig, name: str) -> Finding:
    """Look at one category, and draw it."""
    (one,) = build_preparations(replace(cfg, category=CategoryConfig(name=name)))
    sheet = None if cfg.sheets is None else Path(cfg.sheets) / f"{cfg.data.name}-{name}.png"
    finding = examine(one, cfg.data.name == "shapenet", sheet)
    if not finding.problem:
        finding.notes = [*_parts_notes(one), *_split_notes(one, finding)]
    return finding


def _parts_notes(preparation: Preparation) -> list[str]:
    """Return of how many shapes the parts are annotated, where that was asked for."""
    source, category = preparation.source, preparation.category
    if not isinstance(source, ShapeNetSource) or source.parts is None:
        return []
    known = SYNSETS.get(category, category) in source.parts.synsets()
    annotated = set(source.parts.ids(category)) if known else set()
    count = len(annotated.intersection(source.shape_ids(category)))
    return [f"parts of {count:,} shapes are annotated"]


def _split_notes(preparation: Preparation, finding: Finding) -> list[str]:
    """Return whether there are shapes enough, and which of those prepared are outliers."""
    if finding.prepared:
        prepared = PreparedSet.open(finding.prepared)
        ids, note = prepared.ids, outlier_note(prepared, outlier_rows(prepared))
    else:
        ids, note = tuple(preparation.shape_ids), ""
        ids = tuple(i for i in ids if i not in finding.unusable)
    shapes = SplitInput(finding.name, ids, (), preparation.source.split(finding.name))
    try:
        few = make_split(ids, AutoSplit()(shapes), Split.val_fraction).warning()
    except DataError as error:
        few = str(error)
    return [*([f"by the default split {few}"] if few else []), *([note] if note else [])]


def main(arguments: Sequence[str]) -> int:
    """Examine what the overrides name: every category of the source, or the one that is given."""
    if not arguments or {"-h", "--help"} & set(arguments):
        print(__doc__)
        return 0
    cfg = typed_config(compose_config("prepare", DoctorConfig, arguments), DoctorConfig)
    validate(cfg)
    console = table_console()
    source = build_source(cfg)
    names = cfg.category.members or [cfg.category.name]
    if not any(a.startswith("category") for a in arguments):
        names = source.categories()
        order = {name: k for k, name in enumerate(SYNSETS)}
        names.sort(key=lambda name: (order.get(name, len(order)), name))
    if not names:
        source.shape_ids(cfg.category.name)  # raises, and says why
    if cfg.data.name == "folder" and len(names) > 1:
        _check_level(Path(cfg.data.settings["root"]), [_count(source, name) for name in names])
    with Console(stderr=True).status("") as status:
        findings = []
        for k, name in enumerate(names):
            status.update(f"looking at {name} ({k + 1} of {len(names)})")
            findings.append(_examined(cfg, name))
    root = cfg.data.settings.get("root")
    console.print(f"{cfg.data.name}{'' if root is None else f' in {root}'}\n", highlight=False)
    report(findings, console)
    console.print()
    for line in _summary(cfg, source):
        console.print(line, markup=False, highlight=False, soft_wrap=True)
    return 1 if any(finding.problem for finding in findings) else 0
