"""Section: the same test images, and what each run makes of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import pandas as pd

from ffd_lightning.analysis.report.elements import data_uri
from ffd_lightning.analysis.report.gallery import (
    Input,
    Output,
    choose_images,
    fit_of,
    read_input,
    reconstruct,
)
from ffd_lightning.analysis.report.opened import Opened
from ffd_lightning.analysis.report.standing import setting_title
from ffd_lightning.analysis.report.stills import DEFORMED, TRUTH, still
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.analysis.wording import measure_title, number
from ffd_lightning.errors import UserError
from ffd_lightning.evaluation.opened import OpenRun
from ffd_lightning.evaluation.protocols import Measure
from ffd_lightning.palette import REGIME_COLORS

_MESH_BYTES = 640_000  # of all meshes before base64, so that a page has 1 to 2 MB
_LEAST_BYTES = 12_000  # of a mesh: with fewer, table tops have holes
_IMAGES = 4  # of a category
_ROWS = 12  # of all categories


class View(NamedTuple):
    """A mesh that can be turned, and the still beneath it."""

    mesh: str
    still: str
    described: str
    true: bool = False


class Column(NamedTuple):
    """What a run makes of an image.

    Attributes:
        title: of the run; `color` of its regime, "" where it has none.
        view: of its mesh.
        score: by the main measure; `best` in its row.
        template: that it selects, and with which weight.
    """

    title: str
    color: str
    view: View
    score: str
    best: bool
    template: str
    weight: str


class Row(NamedTuple):
    """An image and what the runs make of it."""

    rank: str
    name: str
    image: str
    columns: Sequence[Column]
    truth: View
    azimuth: str
    elevation: str
    fit: str


class Grid(NamedTuple):
    """The rows of a category, or why there are none."""

    category: str
    rows: Sequence[Row] = ()
    error: str = ""


@dataclass(frozen=True)
class Examples:
    """Test images to be looked at.

    Attributes:
        measure: that orders them.
        grids: one per category.
        errors: of runs that are not shown: name and reason.
        runs, available: how many runs are shown, and how many have samples.
        limit: of how many runs are shown at most.
        meshes: that are shown, by name.
    """

    key: ClassVar[str] = "examples"
    title: ClassVar[str] = "The same images through every run"

    measure: Measure
    grids: Sequence[Grid]
    errors: Sequence[tuple[str, str]]
    runs: int
    available: int
    limit: int
    meshes: Mapping[str, Mapping[str, str | float]]


def examples(sweep: Sweep, opened: Opened, limit: int) -> Examples | None:
    """Return the examples of the runs that are opened, None where there are none to show."""
    if sweep.samples.empty or limit < 1:
        return None
    shown = sweep.samples[sweep.samples["run"].isin(opened.runs)]
    categories = list(dict.fromkeys(shown["category"].astype(str)))
    count = max(1, min(_IMAGES, _ROWS // max(1, len(categories))))
    pairs = shown[["run", "category"]].drop_duplicates()
    size = max(_LEAST_BYTES, _MESH_BYTES // max(1, count * (len(pairs) + len(categories))))
    meshes: dict[str, Mapping[str, str | float]] = {}
    grids = []
    for category in categories:
        samples = shown[shown["category"] == category]
        try:
            grids.append(_grid(sweep, opened, category, samples, count, size, meshes))
        except (UserError, OSError) as error:
            grids.append(Grid(category, error=str(error)))
    errors = [(sweep.labels[run], why) for run, why in opened.errors.items()]
    return Examples(
        sweep.protocol.main_measure,
        grids,
        errors,
        len(opened.runs),
        len(sweep.scored),
        limit,
        meshes,
    )


def _grid(
    sweep: Sweep,
    opened: Opened,
    category: str,
    samples: pd.DataFrame,
    count: int,
    size: int,
    meshes: dict[str, Mapping[str, str | float]],
) -> Grid:
    """Return the rows of a category; their meshes are added to `meshes`."""
    measure = sweep.protocol.main_measure
    # Trained together with other categories, a shape is called <category>/<id>.
    bare = samples.assign(id=samples["id"].str.removeprefix(f"{category}/"))
    chosen = choose_images(bare, measure, count)
    if not chosen:
        return Grid(category, error="the runs share no test images")
    names = list(dict.fromkeys(samples["run"]))
    found: dict[str, list[Output]] = {}
    for run in names:
        own = samples[samples["run"] == run].set_axis(bare.index[samples["run"] == run])
        places = [
            own.index[(bare.loc[own.index, ["id", "view"]] == image).all(axis=1)][0]
            for image in chosen.values()
        ]
        found[run] = reconstruct(opened.runs[run], [own.loc[p] for p in places], size)
    first: OpenRun = opened.runs[names[0]]
    rows = []
    for k, rank in enumerate(chosen):
        outputs = {run: found[run][k] for run in names}
        image = read_input(first, outputs[names[0]].row.to_dict(), size)
        rows.append(_row(sweep, rank, image, outputs))
        for mesh in (image.truth, *(output.deformed for output in outputs.values())):
            meshes[mesh.name] = mesh.as_json()
    return Grid(category, rows)


def _row(sweep: Sweep, rank: str, image: Input, outputs: Mapping[str, Output]) -> Row:
    measure = sweep.protocol.main_measure
    first = next(iter(outputs.values())).row
    fit = fit_of([image.truth, *(output.deformed for output in outputs.values())])
    scores = [float(output.row[measure.name]) for output in outputs.values()]
    best = (max if measure.higher_is_better else min)(scores)
    settings = sweep.table.set_index("run")
    columns = []
    for (run, output), score in zip(outputs.items(), scores, strict=True):
        row = settings.loc[run].to_dict()
        title = setting_title(row, sweep.told_apart_by) or "the network"
        picture = still(output.deformed, DEFORMED, image.camera, fit)
        view = View(output.deformed.name, data_uri(picture, "image/png"), f"{title}, {rank}")
        columns.append(
            Column(
                title,
                REGIME_COLORS.get(str(row["regime"]), ""),
                view,
                f"{measure_title(measure.name)} {number(measure.factor * score)}",
                score == best and len(set(scores)) > 1,
                str(output.row["template"]),
                f"{output.row['weight']:.0%}" if "weight" in output.row else "",
            )
        )
    truth = still(image.truth, TRUTH, image.camera, fit)
    family = f", {first['family']}" if isinstance(first.get("family"), str) else ""
    return Row(
        rank,
        f"{first['id']}{family}",
        data_uri(image.image, "image/png"),
        columns,
        View(image.truth.name, data_uri(truth, "image/png"), f"ground truth, {rank}", True),
        f"{image.camera.azimuth:g}",
        f"{image.camera.elevation:g}",
        f"{fit:.4g}",
    )
