"""Choosing the images that the paper's figures show, and what runs make of them."""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.analysis.figures.drawing import Picture, View
from ffd_lightning.analysis.runs import (
    described_protocol,
    evaluate_command,
    load_samples,
    own_protocol,
)
from ffd_lightning.analysis.wording import measure_note, scaled_title
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.candidates import PreparedShape, TemplateShape
from ffd_lightning.evaluation.opened import OpenRun, RunOpener
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.run_folder import RunFolder

PICKS = ("spread", "best", "median", "worst", "random")
"""Which test images to show, of those sorted by their scores: `spread` takes them evenly from the
best to the worst; `random` needs no scores."""


@dataclass(frozen=True)
class Choice:
    """Which images a figure shows.

    Attributes:
        models: ids of shapes, whose first images are shown; by `pick` where there are none.
        number: images at most, of `pick`.
        pick: one of `PICKS`.
        protocol: whose scores decide; that of each run's training where it is None.
        seed: of random choice.
    """

    models: tuple[str, ...] = ()
    number: int = 6
    pick: str = "spread"
    protocol: str | None = None
    seed: int = 0


@dataclass(frozen=True)
class Example:
    """One image and what a run makes of it.

    Attributes:
        run: with its data, opened.
        sample: the image.
        weights: of the templates, (T,).
        offsets: of their control points, (T, M, 3).
        score: of the selected template, in words; "" where the image was not evaluated.
        definition: of the score, with its unit and points.
    """

    run: OpenRun
    sample: Sample
    weights: NDArray[np.float32]
    offsets: NDArray[np.float32]
    score: str
    definition: str

    @property
    def name(self) -> str:
        """The model's id, the view where it is not the first, and whether it is no test model."""
        data = self.run.data
        model = data.prepared.ids[self.sample.row]
        view = f", view {self.sample.view}" if self.sample.view else ""
        if model in data.bank.ids:
            return f"{model}{view}\n(a template)"
        return f"{model}{view}" + ("\n(trained on)" if model in data.split.train else "")

    @property
    def truth(self) -> PreparedShape:
        """The model itself."""
        return PreparedShape(self.run.data.prepared, self.sample.row)

    def ranked(self, rank: int = 0) -> int:
        """Return the template of the greatest weight, or of the `rank`-th after it."""
        return int(np.argsort(-self.weights, kind="stable")[rank])

    def template(self, rank: int = 0) -> TemplateShape:
        """Return a template as it is; see `ranked`."""
        return TemplateShape(self.run.data.bank, self.ranked(rank))

    def deformed(self, rank: int = 0) -> TemplateShape:
        """Return a template deformed as the run has it; see `ranked`."""
        index = self.ranked(rank)
        return TemplateShape(self.run.data.bank, index, self.offsets[index])

    def view(self, width: int) -> View:
        """Return the camera that took the image, for pictures of this width."""
        prepared = self.run.data.prepared
        _, rows, columns, _ = prepared.image_shape
        return View(prepared.camera(*self.sample), round(width * rows / columns), width)

    def image(self, view: View) -> Picture:
        """Return what the network saw, in the size of a view."""
        seen = Image.fromarray(self.run.data.prepared.image(*self.sample)[..., :3])
        return np.asarray(seen.resize((view.width, view.height), Image.Resampling.LANCZOS))


class _Scores(NamedTuple):
    """A run's samples under a protocol."""

    table: pd.DataFrame
    protocol: ProtocolDescription

    @property
    def definition(self) -> str:
        """What the main measure is, with its unit and points."""
        measure = self.protocol.main_metric
        return measure_note(measure, self.protocol)


def collect(runs: Sequence[RunFolder], choice: Choice, open_run: RunOpener) -> list[list[Example]]:
    """Choose images of each run and predict them.

    Runs that have the first run's images among their test images show the same ones, so that they
    can be compared; others choose their own.

    Args:
        runs: with their checkpoints.
        choice: which images.
        open_run: opens a run.

    Returns:
        The examples of each run.

    Raises:
        ConfigError: no run, no checkpoint, or nothing to show.
        DataError: data that is missing, a model that is not in it, or a run whose scores are needed
            and not there, or of other weights.
    """
    if choice.number < 1:
        raise ConfigError(f"number={choice.number}: at least one image must be shown")
    if choice.pick not in PICKS:
        raise ConfigError(f"pick={choice.pick}: choose one of {', '.join(PICKS)}")
    result: list[list[Example]] = []
    first: list[tuple[str, int]] = []
    for run in runs:
        opened = open_run(run)
        name = choice.protocol or own_protocol(run)
        scores = _scores(run, name)
        if choice.models:
            images = [(model, 0) for model in choice.models]
        elif first and {model for model, _ in first} <= set(opened.data.split.test):
            images = first
        elif choice.pick == "random":
            images = _random(opened, choice)
        elif scores is None:
            raise DataError(
                f"{run.path} has not been evaluated under protocol {name}, so there are no scores "
                f"to choose by: {evaluate_command(run.path, name)}, or choose with "
                "pick=random or models=[ID,ID]"
            )
        else:
            measure = scores.protocol.main_metric
            images = pick_images(scores.table, measure, choice.pick, choice.number)
        first = first or images
        result.append(_examples(opened, images, scores))
    return result


def pick_images(
    table: pd.DataFrame, measure: Metric, pick: str, number: int
) -> list[tuple[str, int]]:
    """Return the ids and views of images, the better first, but for `worst`.

    Args:
        table: of one run, with `id`, `view` and the measure; of equal scores the first by id leads.
        measure: that orders the images.
        pick: which of them, not `random`.
        number: at most; all where there are fewer.
    """
    order = table.sort_values(["id", "view"]).sort_values(
        measure.name, ascending=not measure.higher_is_better, kind="stable"
    )
    count = len(order)
    number = min(number, count)
    if pick == "spread" and number > 1:
        places = np.linspace(0, count - 1, number).round().astype(int)
    elif pick == "worst":
        places = np.arange(count)[::-1][:number]
    elif pick == "best":
        places = np.arange(number)
    else:
        places = (count - number) // 2 + np.arange(number)
    chosen = order.iloc[places]
    return [(str(i), int(view)) for i, view in zip(chosen["id"], chosen["view"], strict=True)]


def _scores(run: RunFolder, name: str) -> _Scores | None:
    """Return a run's scores under a protocol, None where it was not evaluated under it."""
    protocol = described_protocol(run, name)
    if protocol is None or not (run.evaluation(name) / "samples.csv").is_file():
        return None
    return _Scores(load_samples([run], name), protocol)


def _random(opened: OpenRun, choice: Choice) -> list[tuple[str, int]]:
    """Return the first views of some test shapes, in the order of their ids."""
    test = sorted(opened.data.split.test)
    number = min(choice.number, len(test))
    drawn = np.random.default_rng(choice.seed).choice(len(test), number, replace=False)
    return [(test[k], 0) for k in sorted(drawn)]


def _examples(
    opened: OpenRun, images: Sequence[tuple[str, int]], scores: _Scores | None
) -> list[Example]:
    """Predict images, and look up their scores."""
    data, path = opened.data, opened.folder.path
    for model, _ in images:
        if model not in data.prepared.ids:
            close = difflib.get_close_matches(model, data.prepared.ids, 3)
            hint = f"; close to it: {', '.join(close)}" if close else ""
            raise DataError(f"there is no shape {model!r} in the data of {path}{hint}")
    samples = [Sample(data.prepared.index(model), view) for model, view in images]
    prediction = predict(opened.network, data.prepared, samples)
    known = {} if scores is None else scores.table.set_index(["id", "view"]).to_dict("index")
    result = []
    for k, image in enumerate(images):
        score = definition = ""
        if scores is not None and (row := known.get(image)):
            selected = data.bank.ids[int(prediction.selected[k])]
            if row["template"] != selected:
                raise DataError(
                    f"the checkpoint of {path} selects template {selected} for {image[0]}, "
                    f"samples.csv says {row['template']}: evaluate the run again (ffd evaluate)"
                )
            measure, definition = scores.protocol.main_metric, scores.definition
            score = score_text(measure, row[measure.name])
        weights, offsets = prediction.weights[k], prediction.offsets[k]
        result.append(Example(opened, samples[k], weights, offsets, score, definition))
    return result


def score_text(measure: Metric, value: float) -> str:
    """Return a measure's value as people read it: "Chamfer x 1000: 83.1"."""
    return f"{scaled_title(measure)}: {measure.factor * value:.1f}"
