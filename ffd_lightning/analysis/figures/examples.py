"""Test images, and what runs make of them: what figures and the report show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ffd_lightning.analysis.results import (
    described_protocol,
    evaluate_command,
    own_protocol,
    read_samples,
)
from ffd_lightning.errors import DataError, did_you_mean
from ffd_lightning.evaluation.candidates import PreparedShape, TemplateShape
from ffd_lightning.evaluation.figures import View
from ffd_lightning.evaluation.opened import OpenRun, RunOpener
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.imaging.grid import Picture
from ffd_lightning.run_folder import RunFolder

T = TypeVar("T")
Query = tuple[str, int]
"""A shape's id, and which of its images."""


@dataclass(frozen=True)
class Example:
    """One image and what a run makes of it.

    Attributes:
        weights: of the templates, (T,).
        offsets: of their control points, (T, M, 3).
        scores: its row of `samples.csv`, under `protocol`; {} where it was not evaluated.
    """

    run: OpenRun
    sample: Sample
    weights: NDArray[np.float32]
    offsets: NDArray[np.float32]
    scores: Mapping[str, Any] = field(default_factory=dict)
    protocol: ProtocolDescription | None = None

    @property
    def name(self) -> str:
        """The shape's id, the view where it is not the first, and whether it is no test shape."""
        data = self.run.data
        shape_id = data.prepared.ids[self.sample.row]
        view = f", view {self.sample.view}" if self.sample.view else ""
        if shape_id in data.bank.ids:
            return f"{shape_id}{view}\n(a template)"
        return f"{shape_id}{view}" + ("\n(trained on)" if shape_id in data.split.train else "")

    @property
    def score(self) -> str:
        """The main score in words; "" where there is none."""
        if self.protocol is None or not self.scores:
            return ""
        measure = self.protocol.main_metric
        return score_text(measure, self.scores[measure.name])

    @property
    def truth(self) -> PreparedShape:
        """The true shape."""
        return PreparedShape(self.run.data.prepared, self.sample.row)

    @property
    def image(self) -> Picture:
        """What the network saw."""
        return self.run.data.prepared.image(*self.sample)

    def ranked(self, rank: int = 0) -> int:
        """Return the template of the greatest weight, or of the `rank`-th after it."""
        return int(np.argsort(-self.weights, kind="stable")[rank])

    def template(self, rank: int = 0) -> TemplateShape:
        """Return a template as it is; see `ranked`."""
        return TemplateShape(self.run.data.bank, self.ranked(rank))

    def deformed(self) -> TemplateShape:
        """Return the template of the greatest weight, deformed as the run has it."""
        index = self.ranked()
        return TemplateShape(self.run.data.bank, index, self.offsets[index])

    def view(self, width: int) -> View:
        """Return the camera that took the image, for pictures of this width."""
        return View.of(self.run.data.prepared, self.sample, width)


def collect(
    runs: Sequence[RunFolder],
    open_run: RunOpener,
    models: Sequence[str] = (),
    number: int = 6,
    pick: str = "spread",
    protocol: str | None = None,
    seed: int = 0,
) -> list[list[Example]]:
    """Choose images of each run and predict them.

    Runs that have the first run's images among their test images show the same ones, so that they
    can be compared; others choose their own.

    Args:
        runs: that are shown.
        open_run: opens one.
        models: ids of shapes, whose first images are shown; by `pick` where there are none.
        number: images at most, of `pick`.
        pick: which test images, of those sorted by their scores: `best`, `median`, `worst`,
            `spread`, which takes them evenly from the best to the worst, or `random`, which needs
            no scores.
        protocol: whose scores decide; that of each run's training where it is None.
        seed: of random choice.

    Raises:
        DataError: a shape that is not in the data, or a run whose scores are needed and not there,
            or of other weights.
    """
    result: list[list[Example]] = []
    first: list[Query] = []
    for run in runs:
        opened, name = open_run(run), protocol or own_protocol(run)
        described = described_protocol(run, name)
        samples = None if described is None else read_samples(run, described)
        test = sorted(opened.data.split.test)
        if models:
            queries = [(model, 0) for model in models]
        elif first and {model for model, _ in first} <= set(test):
            queries = first
        elif pick == "random":
            rng = np.random.default_rng(seed)
            drawn = rng.choice(len(test), min(number, len(test)), replace=False)
            queries = [(test[k], 0) for k in sorted(drawn)]
        elif samples is None or described is None:
            way = evaluate_command(run, name) if run.finished else "let its training end"
            raise DataError(
                f"{run.path} has not been evaluated under protocol {name}, so there are no scores "
                f"to choose by: {way}, or choose with pick=random or models=[ID,ID]"
            )
        else:
            order = in_order(samples.assign(run=""), described.main_metric).index.tolist()
            queries = picked(order, pick, number)
        first = first or queries
        result.append(reconstruct(opened, queries, samples, described))
    return result


def in_order(samples: pd.DataFrame, measure: Metric) -> pd.DataFrame:
    """Return scores, the best first: a row per image that all runs were tested on, a column each.

    Rows (index `id`, `view`) are ordered by their mean over runs, of equals the first by id leads.
    """
    scores = samples.pivot(index=["id", "view"], columns="run", values=measure.name).dropna()
    sign = -1 if measure.higher_is_better else 1
    means = (sign * scores.mean(axis=1)).sort_index()
    return scores.loc[means.sort_values(kind="stable").index]


def picked(order: Sequence[T], pick: str, number: int) -> list[T]:
    """Return what is picked of a list that begins with the best: so many at most, see `collect`."""
    count, number = len(order), min(number, len(order))
    middle = range((count - number) // 2, (count - number) // 2 + number)
    places = {
        "spread": np.linspace(0, count - 1, number).round().astype(int) if number > 1 else middle,
        "best": range(number),
        "median": middle,
        "worst": range(count - 1, count - 1 - number, -1),
    }[pick]
    return [order[place] for place in places]


def reconstruct(
    run: OpenRun,
    queries: Sequence[Query],
    samples: pd.DataFrame | None = None,
    protocol: ProtocolDescription | None = None,
) -> list[Example]:
    """Return what a run makes of images.

    Args:
        run: with the weights that its samples are of.
        queries: which images.
        samples: of the run, with the scores of images that were evaluated.
        protocol: of the scores.

    Raises:
        DataError: a shape that is not in the data, or samples of other weights.
    """
    data, path = run.data, run.folder.path
    for shape_id, _ in queries:
        if shape_id not in data.prepared.ids:
            near = did_you_mean(shape_id, data.prepared.ids)
            raise DataError(f"there is no shape {shape_id!r} in the data of {path}.{near}")
    images = [Sample(data.prepared.index(shape_id), view) for shape_id, view in queries]
    prediction = predict(run.network, data.prepared, images)
    scores: dict[Query, Any] = {}
    if samples is not None:
        scores = samples.set_index(["id", "view"], drop=False).to_dict("index")
    result = []
    for k, query in enumerate(queries):
        row, selected = scores.get(query, {}), data.bank.ids[int(prediction.selected[k])]
        if row and row["template"] != selected:
            raise DataError(
                f"the checkpoint of {path} selects template {selected} for {query[0]}, "
                f"samples.csv says {row['template']}: evaluate the run again (ffd evaluate)"
            )
        weights, offsets = prediction.weights[k], prediction.offsets[k]
        result.append(Example(run, images[k], weights, offsets, row, protocol))
    return result


def score_text(measure: Metric, value: float) -> str:
    """Return a measure's value as people read it: "Chamfer x 1000: 83.1"."""
    return f"{measure.scaled_title}: {measure.factor * value:.1f}"
