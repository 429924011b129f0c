"""The same test images, and what each run makes of them: with meshes that can be turned."""

from __future__ import annotations

import base64
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.analysis.report.meshes import (
    MAX_BYTES,
    PackedMesh,
    light_template,
    lighten,
    pack,
)
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.table import number
from ffd_lightning.errors import DataError, UserError
from ffd_lightning.evaluation.opened import OpenRun, RunOpener
from ffd_lightning.evaluation.protocols import Metric
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render
from ffd_lightning.palette import REGIME_COLORS

DEFORMED, TRUTH = (92, 158, 237), (199, 196, 189)
"""sRGB of reconstructions and of what is true; the page's script draws in the same."""

_MESH_BYTES = 640_000  # of all meshes before base64, so that a page has 1 to 2 MB
_LEAST_BYTES = 12_000  # of a mesh: with fewer, table tops have holes
_IMAGES = 4  # of a category
_ROWS = 12  # of all categories
_STILL = 180, 240  # height and width: twice what a wide screen shows
_THUMBNAIL = 84, 112
_COLORS = 48  # of a flat-shaded picture's palette


class View(NamedTuple):
    """A mesh that can be turned, and the still beneath it."""

    mesh: str
    still: str
    described: str
    true: bool = False


@dataclass(frozen=True)
class Input:
    """One test image, and what it shows.

    Attributes:
        image: what the networks see, PNG.
        truth: the ground truth.
        camera: that meshes are seen by: from the image's side, at the page's own distance.
    """

    image: bytes
    truth: PackedMesh
    camera: Camera


@dataclass(frozen=True)
class Output:
    """What a run makes of an image.

    Attributes:
        row: its row of `samples.csv`.
        deformed: the reconstruction: the selected template, deformed.
    """

    row: pd.Series
    deformed: PackedMesh


@dataclass(frozen=True)
class Opened:
    """Runs that could be opened.

    Attributes:
        runs: by their paths, in the order of the results.
        errors: why others could not, by their paths.
    """

    runs: Mapping[str, OpenRun]
    errors: Mapping[str, str]


def open_runs(results: Results, open_run: RunOpener, limit: int) -> Opened:
    """Open one run of each setting, of at most `limit` settings."""
    chosen = choose_runs(results.scored, limit, results.keys) if limit else []
    folders = {str(run.path): run for run in results.runs}
    runs: dict[str, OpenRun] = {}
    errors: dict[str, str] = {}
    for name in chosen:
        try:
            runs[name] = open_run(folders[name])
        except (UserError, OSError) as error:
            errors[name] = str(error)
    return Opened(runs, errors)


def examples(results: Results, opened: Opened, limit: int) -> dict[str, Any]:
    """Return what `gallery.html` shows: images of each category through the opened runs.

    Returns:
        `measure` that orders the images, `grids` (of each category its rows, or why there are
        none), `errors` of runs that are not shown, how many `runs` of `available` ones are shown,
        the `limit`, and all `meshes` by name.
    """
    shown = results.samples[results.samples["run"].isin(opened.runs)]
    categories = list(dict.fromkeys(shown["category"].astype(str)))
    count = max(1, min(_IMAGES, _ROWS // max(1, len(categories))))
    pairs = shown[["run", "category"]].drop_duplicates()
    size = max(_LEAST_BYTES, _MESH_BYTES // max(1, count * (len(pairs) + len(categories))))
    meshes: dict[str, Mapping[str, str | float]] = {}
    grids = []
    for category in categories:
        samples = shown[shown["category"] == category]
        rows, why = [], ""
        try:
            rows = _rows(results, opened, category, samples, count, size, meshes)
        except (UserError, OSError) as error:
            why = str(error)
        grids.append({"category": category, "rows": rows, "error": why})
    return {
        "measure": results.protocol.main_metric,
        "grids": grids,
        "errors": [(results.name(run), why) for run, why in opened.errors.items()],
        "runs": len(opened.runs),
        "available": len(results.scored),
        "limit": limit,
        "meshes": meshes,
    }


def _rows(
    results: Results,
    opened: Opened,
    category: str,
    samples: pd.DataFrame,
    count: int,
    size: int,
    meshes: dict[str, Mapping[str, str | float]],
) -> list[dict[str, Any]]:
    """Return the rows of a category; their meshes are added to `meshes`."""
    # Trained together with other categories, a shape is called <category>/<id>.
    bare = samples["id"].str.removeprefix(f"{category}/")
    chosen = choose_images(samples.assign(id=bare), results.protocol.main_metric, count)
    if not chosen:
        raise DataError("the runs share no test images")
    outputs: dict[str, list[Output]] = {}
    for run, own in samples.groupby("run", sort=False):
        of_image = own.set_index([bare[own.index], "view"], drop=False)
        rows = [of_image.loc[(image["id"], image["view"])] for image in chosen.values()]
        outputs[str(run)] = reconstruct(opened.runs[str(run)], rows, size)
    names = list(outputs)
    result = []
    for k, rank in enumerate(chosen):
        of_runs = {run: outputs[run][k] for run in names}
        image = read_input(opened.runs[names[0]], of_runs[names[0]].row.to_dict(), size)
        result.append(_row(results, rank, image, of_runs))
        for mesh in (image.truth, *(output.deformed for output in of_runs.values())):
            meshes[mesh.name] = mesh.as_json()
    return result


def _row(
    results: Results, rank: str, image: Input, outputs: Mapping[str, Output]
) -> dict[str, Any]:
    measure = results.protocol.main_metric
    first = next(iter(outputs.values())).row
    fit = fit_of([image.truth, *(output.deformed for output in outputs.values())])
    scores = [float(output.row[measure.name]) for output in outputs.values()]
    best = (max if measure.higher_is_better else min)(scores)
    settings = results.table.set_index("run")
    columns = []
    for (run, output), score in zip(outputs.items(), scores, strict=True):
        row = settings.loc[run].to_dict()
        title = results.title(row) if results.told_apart_by else "the network"
        picture = still(output.deformed, DEFORMED, image.camera, fit)
        columns.append(
            {
                "title": title,
                "color": REGIME_COLORS.get(str(row["regime"]), ""),
                "view": View(
                    output.deformed.name, data_uri(picture, "image/png"), f"{title}, {rank}"
                ),
                "score": f"{measure.title} {number(measure.factor * score)}",
                "best": score == best and len(set(scores)) > 1,
                "template": str(output.row["template"]),
                "weight": f"{output.row['weight']:.0%}" if "weight" in output.row else "",
            }
        )
    truth = still(image.truth, TRUTH, image.camera, fit)
    family = f", {first['family']}" if isinstance(first.get("family"), str) else ""
    return {
        "rank": rank,
        "name": f"{first['id']}{family}",
        "image": data_uri(image.image, "image/png"),
        "columns": columns,
        "truth": View(
            image.truth.name, data_uri(truth, "image/png"), f"ground truth, {rank}", True
        ),
        "azimuth": f"{image.camera.azimuth:g}",
        "elevation": f"{image.camera.elevation:g}",
        "fit": f"{fit:.4g}",
    }


def choose_images(samples: pd.DataFrame, measure: Metric, count: int = 4) -> dict[str, pd.Series]:
    """Return the images that are shown: the best, the median, the worst, and where runs differ.

    Images are ordered by the mean over the runs, of those that all runs were tested on. Of an even
    number the better of the two in the middle is taken; of equals the first by id.

    Args:
        samples: of one run or several, of one category.
        measure: that orders them.
        count: of images at most; of fewer than three the median, then the worst.

    Returns:
        What each is, and its id and view: a row of a table of the images.
    """
    scores = samples.pivot(index=["id", "view"], columns="run", values=measure.name).dropna()
    sign = -1 if measure.higher_is_better else 1
    order = (sign * scores.mean(1)).sort_index().sort_values(kind="stable").index
    if not len(order):
        return {}
    last = len(order) - 1
    places = {"best": 0, "median": last // 2, "worst": last}
    if last < 2:
        places = {"best": 0, "worst": last} if last else {"best": 0}
    wanted = [name for name in ("median", "worst", "best") if name in places][:count]
    chosen: dict[str, tuple[str, int]] = {}
    for name, place in places.items():
        if name in wanted:
            chosen[name] = order[place]
    spread = (scores.max(axis=1) - scores.min(axis=1)).drop(list(chosen.values()))
    if len(scores.columns) > 1 and len(chosen) < count and spread.max() > 0:
        chosen["where runs differ most"] = spread.idxmax()
    return {name: pd.Series({"id": i, "view": v}) for name, (i, v) in chosen.items()}


def choose_runs(
    runs: pd.DataFrame, limit: int, keys: Sequence[str] = ("category", "regime", "templates")
) -> list[str]:
    """Return the runs that are shown: one per setting, and of many settings a spread.

    Seeds of a setting look alike, so the first stands for all. Of more than `limit` settings those
    at even distances in the table's order are taken, the first and the last among them.

    Args:
        runs: a row per run, with `run` and the columns `keys`.
        limit: runs at most, 0 for none.
        keys: what runs share that are seeds of each other.
    """
    firsts = runs.drop_duplicates(list(keys))["run"].tolist()
    if len(firsts) <= limit:
        return firsts
    places = np.linspace(0, len(firsts) - 1, limit).round().astype(int)
    return [firsts[place] for place in places]


def read_input(run: OpenRun, row: Mapping[str, object], max_bytes: int = MAX_BYTES) -> Input:
    """Return a test image of a run's data.

    Args:
        run: with the data.
        row: with the image's `id` and `view`.
        max_bytes: of the mesh, before base64.
    """
    prepared = run.data.prepared
    query = Sample(prepared.index(str(row["id"])), int(str(row["view"])))
    seen, truth = prepared.camera(*query), prepared.mesh(query.row)
    return Input(
        _png(prepared.image(query.row, query.view)[..., :3], 128),
        pack(*lighten(truth.vertices, truth.faces, min(max_bytes, MAX_BYTES))),
        Camera(seen.azimuth, seen.elevation),
    )


def reconstruct(
    run: OpenRun, rows: Sequence[pd.Series], max_bytes: int = MAX_BYTES
) -> list[Output]:
    """Return what a run makes of test images.

    Args:
        run: with the weights that its samples are of.
        rows: of its `samples.csv`.
        max_bytes: of a mesh, before base64.

    Raises:
        DataError: the samples are of other weights, or of other data.
    """
    data = run.data
    queries = [Sample(data.prepared.index(row["id"]), int(row["view"])) for row in rows]
    prediction = predict(run.network, data.prepared, queries)
    result = []
    for k, row in enumerate(rows):
        t = int(prediction.selected[k])
        if data.bank.ids[t] != row["template"]:
            raise DataError(
                f"the checkpoint selects template {data.bank.ids[t]} for {row['id']}, "
                f"samples.csv says {row['template']}: evaluate the run again (ffd evaluate)"
            )
        size = min(max_bytes, MAX_BYTES)
        deformed = light_template(data.bank, t, prediction.offsets[k, t], size)
        result.append(Output(row, pack(*deformed)))
    return result


def fit_of(meshes: Sequence[PackedMesh]) -> float:
    """Return by how much meshes are shrunk so that all are seen whole, 1 or less."""
    reach = [
        m.scale / 32767 * float(np.linalg.norm(m.vertices.astype(float), axis=1).max())
        for m in meshes
    ]
    return min(1.0, 0.5 / max(reach))


def still(mesh: PackedMesh, color: tuple[int, int, int], camera: Camera, fit: float) -> bytes:
    """Return a mesh as the page's script draws it first, as PNG on nothing.

    Args:
        mesh: what is seen.
        color: of all its faces.
        camera: from where.
        fit: by how much the mesh is shrunk.
    """
    vertices = mesh.vertices.astype(np.float64) * (mesh.scale * fit / 32767)
    colors = np.tile(np.array([*color, 255], np.uint8), (len(mesh.faces), 1))
    return _rendered(Mesh(vertices, mesh.faces.astype(np.int64), colors), camera, _STILL)


def thumbnail(mesh: Mesh) -> bytes:
    """Return a small picture of a template, as PNG on nothing."""
    return _rendered(mesh, Camera(), _THUMBNAIL)


def data_uri(content: bytes, kind: str) -> str:
    """Return bytes as an address that holds them."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _rendered(mesh: Mesh, camera: Camera, size: tuple[int, int]) -> bytes:
    """Render a mesh without the white that it is rendered over."""
    image = render(mesh, camera, height=size[0], width=size[1], samples=2)
    alpha = image[..., 3:].astype(np.float64) / 255
    colors = (image[..., :3] - 255 * (1 - alpha)) / np.maximum(alpha, 1 / 255)
    clear = np.concatenate([colors.clip(0, 255).round().astype(np.uint8), image[..., 3:]], axis=2)
    return _png(clear, _COLORS)


def _png(image: NDArray[np.uint8], colors: int) -> bytes:
    """Return a picture with a palette of so many colours: a third of the bytes."""
    method = Image.Quantize.FASTOCTREE if image.shape[2] == 4 else None
    buffer = io.BytesIO()
    Image.fromarray(image).quantize(colors, method).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
