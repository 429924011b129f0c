"""Best, median and worst test samples of runs, with meshes light enough to travel in a page."""

from __future__ import annotations

import io
from collections.abc import Sequence
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
from ffd_lightning.imaging.rendering import render

_COLORS = 128  # of a picture's palette: a third of the bytes, and no difference to the eye


@dataclass(frozen=True)
class Example:
    """One test sample, to be looked at.

    Attributes:
        rank: best, median or worst.
        row: its row of `samples.csv`.
        image: what the network saw, PNG.
        template_image: the selected template seen from the same side, PNG.
        deformed: the reconstruction: that template, deformed.
        truth: the ground truth.
        elevation, azimuth: of the camera, degrees; see `imaging.camera`.
    """

    rank: str
    row: pd.Series
    image: bytes
    template_image: bytes
    deformed: PackedMesh
    truth: PackedMesh
    elevation: float
    azimuth: float


def choose_examples(samples: pd.DataFrame, measure: Measure) -> list[tuple[str, pd.Series]]:
    """Return the best, the median and the worst of a run's samples, fewer where there are fewer.

    Of an even number the better of the two in the middle is taken; of equals the first by id.

    Args:
        samples: of one run, at least one.
        measure: that orders them.
    """
    order = samples.sort_values(["id", "view"]).sort_values(
        measure.name, ascending=not measure.higher_is_better, kind="stable"
    )
    last = len(order) - 1
    places = {"best": 0, "median": last // 2, "worst": last}
    if last < 2:
        places = {"best": 0, "worst": last} if last else {"best": 0}
    return [(rank, order.iloc[place]) for rank, place in places.items()]


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


def make_examples(
    run: OpenRun, samples: pd.DataFrame, measure: Measure, max_bytes: int = MAX_BYTES
) -> list[Example]:
    """Return the best, median and worst test sample of a run.

    Args:
        run: with the weights that the samples are of.
        samples: of this run.
        measure: that orders them.
        max_bytes: of a mesh, before base64.

    Raises:
        DataError: the samples are of other weights, or of other data.
    """
    data, chosen = run.data, choose_examples(samples, measure)
    queries = [Sample(data.prepared.index(row["id"]), int(row["view"])) for _, row in chosen]
    prediction = predict(run.network, data.prepared, queries)
    result = []
    for k, (rank, row) in enumerate(chosen):
        t, query = int(prediction.selected[k]), queries[k]
        if data.bank.ids[t] != row["template"]:
            raise DataError(
                f"the checkpoint selects template {data.bank.ids[t]} for {row['id']}, "
                f"samples.csv says {row['template']}: evaluate the run again (ffd evaluate)"
            )
        camera = data.prepared.camera(*query)
        _, height, width, _ = data.prepared.image_shape
        template = render(data.bank.meshes[t], camera, height=height, width=width, samples=2)
        truth = data.prepared.mesh(query.row)
        size = min(max_bytes, MAX_BYTES)
        result.append(
            Example(
                rank,
                row,
                _png(data.prepared.image(query.row, query.view)),
                _png(template),
                pack(*light_template(data.bank, t, prediction.offsets[k, t], size)),
                pack(*lighten(truth.vertices, truth.faces, size)),
                camera.elevation,
                camera.azimuth,
            )
        )
    return result


def _png(image: NDArray[np.uint8]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image[..., :3]).quantize(_COLORS).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def meshes_json(examples: Sequence[Example]) -> dict[str, dict[str, str | float]]:
    """Return all meshes of examples by their names, each once."""
    meshes = [mesh for example in examples for mesh in (example.deformed, example.truth)]
    return {mesh.name: mesh.as_json() for mesh in meshes}
