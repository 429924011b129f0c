"""Section: test samples to be looked at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import pandas as pd

from ffd_lightning.analysis.report.elements import data_uri
from ffd_lightning.analysis.report.gallery import Example, choose_runs, make_examples, meshes_json
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.analysis.wording import measure_title, number
from ffd_lightning.errors import UserError
from ffd_lightning.evaluation.opened import RunOpener
from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription

_MESH_BYTES = 2_600_000  # of all meshes before base64: a page of some 4 MB


class Card(NamedTuple):
    """An example: what the network saw, the template it took, and the names of both meshes."""

    rank: str
    id: str
    template: str
    image: str
    template_image: str
    deformed: str
    truth: str
    azimuth: str
    elevation: str
    scores: Sequence[tuple[str, str]]


class RunExamples(NamedTuple):
    """The examples of a run, or why there are none."""

    title: str
    cards: Sequence[Card] = ()
    error: str = ""


@dataclass(frozen=True)
class Examples:
    """Test samples to be looked at.

    Attributes:
        measure: that orders them.
        runs: whose samples are shown.
        available: how many runs have samples.
        limit: of how many runs samples are shown at most.
        meshes: that they show, by name.
    """

    key: ClassVar[str] = "examples"
    title: ClassVar[str] = "Examples"

    measure: Measure
    runs: Sequence[RunExamples]
    available: int
    limit: int
    meshes: Mapping[str, Mapping[str, str | float]]


def gallery(sweep: Sweep, open_run: RunOpener, limit: int) -> Examples | None:
    """Return the examples of at most `limit` runs, None where there are none to show."""
    scored = sweep.scored
    if scored.empty or limit < 1:
        return None
    chosen = choose_runs(scored, limit, sweep.keys)
    measure = sweep.protocol.main_measure
    runs = {str(run.path): run for run in sweep.runs}
    shown: list[RunExamples] = []
    meshes: dict[str, Mapping[str, str | float]] = {}
    for name in chosen:
        samples = sweep.samples[sweep.samples["run"] == name]
        try:
            opened = open_run(runs[name])
            examples = make_examples(opened, samples, measure, _MESH_BYTES // (6 * len(chosen)))
        except (UserError, OSError) as error:
            shown.append(RunExamples(sweep.labels[name], error=str(error)))
            continue
        meshes |= meshes_json(examples)
        cards = [_card(example, sweep.protocol) for example in examples]
        shown.append(RunExamples(sweep.title(name), cards))
    return Examples(measure, shown, len(scored), limit, meshes)


def _card(example: Example, protocol: ProtocolDescription) -> Card:
    return Card(
        example.rank,
        str(example.row["id"]),
        str(example.row["template"]),
        data_uri(example.image, "image/png"),
        data_uri(example.template_image, "image/png"),
        example.deformed.name,
        example.truth.name,
        f"{example.azimuth:g}",
        f"{example.elevation:g}",
        _scores(example.row, protocol),
    )


def _scores(row: pd.Series, protocol: ProtocolDescription) -> list[tuple[str, str]]:
    """Return names and numbers: the first measures, and the first of the template as it is."""
    shown = [(m, "") for m in protocol.measures[:3]]
    shown += [(m, "undeformed_") for m in protocol.measures[:1] if f"undeformed_{m.name}" in row]
    result = [
        (f"{prefix.rstrip('_')} {measure_title(m.name)}", number(m.factor * row[prefix + m.name]))
        for m, prefix in shown
    ]
    return [*result, ("template weight", f"{row['weight']:.2f}")] if "weight" in row else result
