"""The same test images through several runs, with meshes light enough to travel in a page."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

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
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.opened import OpenRun
from ffd_lightning.evaluation.protocols import Measure
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.imaging.camera import Camera

_COLORS = 128  # of a picture's palette: a third of the bytes, and no difference to the eye


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


def choose_images(samples: pd.DataFrame, measure: Measure, count: int = 4) -> dict[str, pd.Series]:
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
        _png(prepared.image(query.row, query.view)),
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


def _png(image: NDArray[np.uint8]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image[..., :3]).quantize(_COLORS).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
