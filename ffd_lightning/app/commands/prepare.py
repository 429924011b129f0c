"""`ffd prepare`: prepared data, without training."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ffd_lightning.app.config import PrepareCommandConfig, Split
from ffd_lightning.app.configuration import run_hydra
from ffd_lightning.errors import DataError
from ffd_lightning.terminal import counted

if TYPE_CHECKING:
    from ffd_lightning.data.preparation.preparation import Preparation

_TRIED = 16  # shapes of a category, evenly spread over its sorted ids


def main(arguments: Sequence[str]) -> None:
    """Prepare what the command line names."""
    run_hydra("prepare", PrepareCommandConfig, prepare, arguments)


def prepare(cfg: PrepareCommandConfig) -> None:
    """Prepare a category, or several; with `cfg.trial`, print what is to be known before."""
    from ffd_lightning.app.build import build_preparations
    from ffd_lightning.app.checks import validate
    from ffd_lightning.data.preparation.overview import describe
    from ffd_lightning.data.templates.distances import outlier_note, outlier_rows
    from ffd_lightning.data.twins import twin_note, twins

    validate(cfg)
    preparations = build_preparations(cfg)
    if cfg.trial:
        there = preparations[0].source.categories()
        print(f"data={cfg.data.name}: categories {', '.join(sorted(there))}")
    for preparation in preparations:
        if cfg.trial:
            for line in _tried(preparation, cfg):
                print(f"{preparation.category}: {line}")
            continue
        known = preparation.target.exists()
        prepared = preparation.run()
        if known:  # else the preparation has said it
            print(*describe(prepared), sep="\n", file=sys.stderr)
        published = preparation.source.split(preparation.category)
        notes = (
            outlier_note(prepared, outlier_rows(prepared)),
            twin_note(twins(prepared.originals), published),
        )
        for note in filter(None, notes):
            print(f"{preparation.category}: {note}", file=sys.stderr)


def _tried(preparation: Preparation, cfg: PrepareCommandConfig) -> Iterator[str]:
    """Yield what is to be known of a category; a few shapes are prepared in a temporary folder."""
    from ffd_lightning.data.categories import paper_templates
    from ffd_lightning.data.preparation.overview import count_warnings, describe, write_sheet
    from ffd_lightning.data.preparation.prepared import PreparedSet
    from ffd_lightning.data.splits import AutoSplit, SplitInput, make_split

    source, category, ids = preparation.source, preparation.category, preparation.shape_ids
    rejected = source.rejected(category)
    usable = [i for i in ids if i not in rejected]
    unusable = {i: rejected[i] for i in ids if i in rejected}
    count = len(preparation.origins)
    made = f", {counted(count, 'deformed variant')} to train on" if count else ""
    yield f"{counted(len(ids), 'shape')}{made}, {_listed(unusable, 'cannot be used')}"
    if not usable:
        return
    shapes = SplitInput(category, tuple(usable), tuple(unusable), source.split(category))
    try:
        split = make_split(usable, AutoSplit()(shapes), Split.val_fraction)
        train, val, test = map(len, split)
        usual = f"{train:,} to train on, {val:,} to validate on and {test:,} to test on"
        yield f"by the default split, before templates are taken out: {split.warning() or usual}"
    except DataError as error:
        yield f"by the default split, {error}"
    templates = paper_templates(category) if cfg.data.name == "shapenet" else ()
    if absent := [i for i in templates if i not in usable]:
        yield (
            f"{len(absent)} of the paper's {len(templates)} templates are absent or cannot be "
            f"used, others take their places: {', '.join(absent)}"
        )
    if preparation.target.exists():
        yield from describe(PreparedSet.open(preparation.target))
        return
    with tempfile.TemporaryDirectory() as folder:
        limit = min(_TRIED, preparation.limit or _TRIED)
        trial = replace(preparation, root=Path(folder), limit=limit, variants=0, progress=False)
        try:
            tried = trial.run()
        except DataError as error:
            yield str(error)
            return
        reasons = {i: why for i, why in tried.rejected.items() if i not in unusable}
        yield f"{len(tried) + len(reasons)} tried, {_listed(reasons, 'rejected')}"
        if warnings := count_warnings(tried):
            yield f"warnings of those tried: {warnings}"
        file = Path(cfg.paths.data) / "sheets" / f"{cfg.data.name}-{category}-trial.png"
        yield write_sheet(tried, file)


def _listed(reasons: Mapping[str, str], what: str) -> str:
    """Return how many shapes there is a reason for, and a few."""
    from ffd_lightning.data.preparation.overview import some_reasons

    return f"{len(reasons):,} {what}" + (f" ({some_reasons(reasons)})" if reasons else "")
