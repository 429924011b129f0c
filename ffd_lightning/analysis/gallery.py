"""Best, median and worst test samples of runs, with meshes light enough to travel in a page."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

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
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.open_run import build_data, read_config
from ffd_lightning.checkpoint import build_network, load_weights
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Measure
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.imaging.rendering import render
from ffd_lightning.run_folder import RunFolder

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
        elevation, azimuth: of the camera, degrees; see `data.rendering`.
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


class ExampleMaker:
    """Makes examples from run folders; runs of the same data and templates share their reading.

    Args:
        measure: that orders samples.
        data_root: where the runs' prepared data is, if not where it was.
        max_bytes: of a mesh, before base64.
    """

    def __init__(
        self, measure: Measure, data_root: Path | None = None, max_bytes: int = MAX_BYTES
    ) -> None:
        self._measure, self._data_root = measure, data_root
        self._max_bytes = min(max_bytes, MAX_BYTES)
        self._known: tuple[str, FfdDataModule] | None = None

    def examples(self, run: RunFolder, samples: pd.DataFrame) -> list[Example]:
        """Return the best, median and worst test sample of a run.

        Args:
            run: with its checkpoint.
            samples: of this run.

        Raises:
            UserError: the checkpoint or the prepared data is missing or does not fit.
        """
        cfg = read_config(run, self._data_root)
        data = self._data(cfg)
        network = build_network(cfg)
        load_weights(network, run.checkpoint)
        chosen = choose_examples(samples, self._measure)
        queries = [Sample(data.prepared.index(row["id"]), int(row["view"])) for _, row in chosen]
        prediction = predict(network, data.prepared, queries)
        result = []
        for k, (rank, row) in enumerate(chosen):
            t, query = int(prediction.selected[k]), queries[k]
            if data.bank.ids[t] != row["template"]:
                raise DataError(
                    f"the checkpoint selects template {data.bank.ids[t]} for {row['id']}, "
                    f"samples.csv says {row['template']}: evaluate the run again (evaluate.py)"
                )
            view = cfg.data.render
            azimuth = view.azimuths[min(query.view, len(view.azimuths) - 1)]
            _, height, width, _ = data.prepared.image_shape
            template = render(
                data.bank.meshes[t],
                height=height,
                width=width,
                elevation=view.elevation,
                azimuth=azimuth,
                samples=2,
            )
            truth = data.prepared.mesh(query.row)
            result.append(
                Example(
                    rank,
                    row,
                    _png(data.prepared.image(query.row, query.view)),
                    _png(template),
                    pack(*light_template(data.bank, t, prediction.offsets[k, t], self._max_bytes)),
                    pack(*lighten(truth.vertices, truth.faces, self._max_bytes)),
                    view.elevation,
                    azimuth,
                )
            )
        return result

    def _data(self, cfg: TrainConfig) -> FfdDataModule:
        """Return the run's data, read anew only where it differs from the last run's."""
        key = repr((cfg.category, cfg.data, cfg.templates, cfg.network.degrees, cfg.paths.data))
        if self._known is None or self._known[0] != key:
            data = build_data(cfg)
            for target in (preparation.target for preparation in data.preparations):
                if not target.exists():  # a report must not begin to prepare data
                    raise DataError(
                        f"its prepared data {target} is not there (data_root=DIR names it)"
                    )
            data.setup()
            self._known = key, data
        return self._known[1]


def _png(image: NDArray[np.uint8]) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(image[..., :3]).quantize(_COLORS).save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def meshes_json(examples: Sequence[Example]) -> dict[str, dict[str, str | float]]:
    """Return all meshes of examples by their names, each once."""
    meshes = [mesh for example in examples for mesh in (example.deformed, example.truth)]
    return {mesh.name: mesh.as_json() for mesh in meshes}
