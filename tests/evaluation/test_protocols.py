import copy
import csv
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from ffd_lightning.app.open_run import open_run
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation import evaluator
from ffd_lightning.evaluation.evaluator import (
    EvaluatedNetwork,
    EvaluationOptions,
    Shapes,
    evaluate,
    protocol_key,
)
from ffd_lightning.evaluation.protocols import PROTOCOLS, Measure, ProtocolDescription
from ffd_lightning.evaluation.samples import predict


@pytest.mark.parametrize("name", list(PROTOCOLS))
def test_a_description_travels_through_json(name):
    protocol = PROTOCOLS[name]
    description = ProtocolDescription.of(protocol)
    again = ProtocolDescription.from_json(json.loads(json.dumps(description.to_json())))
    assert again == description
    assert hash(again) == hash(description)
    assert again.name == protocol.name == name
    for measure, original in zip(again.measures, protocol.measures, strict=True):
        assert measure.factor == original.factor
        assert measure.arrow == original.arrow
        assert again.measure(measure.name) == original


def test_the_main_measure_is_the_first_distance():
    measures = [Measure("a", "", True), Measure("b", ""), Measure("c", "")]
    assert ProtocolDescription("mine", "", tuple(measures)).main_measure.name == "b"
    assert ProtocolDescription("mine", "", tuple(measures[:1])).main_measure.name == "a"
    with pytest.raises(ConfigError, match="mine has no measure 'd': choose one of a, b, c"):
        ProtocolDescription("mine", "", tuple(measures)).measure("d")


class Shares:
    """A protocol of another package, with whatever settings."""

    name, measures = "shares", ()

    def __init__(self, setting):
        self.setting = setting


@dataclass(frozen=True)
class Frozen:
    """The same, as a dataclass."""

    setting: object


@pytest.mark.parametrize("kind", [Shares, Frozen])
@pytest.mark.parametrize(
    ("one", "other"),
    [
        ((0.01,), (0.5,)),
        ([1, 2], [2, 1]),
        ({"at": [0.1]}, {"at": [0.2]}),
        (Path("a"), Path("b")),
        (frozenset("ab"), frozenset("ac")),
        (np.arange(2000), np.arange(2000) + (np.arange(2000) == 1000)),
        (Frozen((1,)), Frozen((2,))),
        (len, max),
    ],
)
def test_protocols_of_other_settings_share_nothing(kind, one, other):
    assert protocol_key(kind(one)) != protocol_key(kind(other))
    assert protocol_key(kind(one)) == protocol_key(kind(copy.copy(one)))


@pytest.mark.parametrize("protocol", PROTOCOLS.values(), ids=list(PROTOCOLS))
def test_the_keys_of_our_protocols_stay(protocol):
    assert protocol_key(protocol) == repr(protocol)


class Warmth:
    """A protocol of another package, as small as one can be."""

    name, note, needs_parts = "warmth", "no unit", False
    measures = (Measure("warmth", "how warm it is", True, 1.0),)

    def __repr__(self):
        return "Warmth()"

    def truth(self, shape, rng):
        return 20.0

    def score(self, shape, truth, rng):
        return {"warmth": truth}


def test_results_say_what_they_were_measured_with(tiny_run, tmp_path, monkeypatch):
    run = open_run(tiny_run)
    subsets = run.data.split.train, run.data.split.test
    models = [Shapes(run.data.prepared, run.data.rows(ids)) for ids in subsets]
    evaluated = EvaluatedNetwork(run.network, run.data.bank, *models, run.step)
    protocol, options = Warmth(), EvaluationOptions(references=False, progress=False)
    summary = evaluate(evaluated, protocol, tmp_path, options)
    assert summary["warmth"] == 20
    content = json.loads((tmp_path / "summary.json").read_text())
    assert content["protocol"] == {
        "name": "warmth",
        "note": "no unit",
        "measures": [
            {
                "name": "warmth",
                "definition": "how warm it is",
                "higher_is_better": True,
                "factor": 1.0,
            }
        ],
    }
    with (tmp_path / "template_ranking.csv").open() as file:
        ranking = list(csv.DictReader(file))
    prepared = run.data.prepared
    assert len(ranking) == len(run.data.bank)
    for row in ranking:
        assert row["family"] == prepared.families[prepared.index(row["id"])] != ""

    counted = []
    predict = evaluator.predict
    monkeypatch.setattr(evaluator, "predict", lambda *a: (counted.append(1), predict(*a))[1])
    assert evaluate(evaluated, protocol, tmp_path, options) == summary
    assert counted == [], "read back"
    protocol.measures = (replace(protocol.measures[0], definition="how warm it feels"),)
    assert evaluate(evaluated, protocol, tmp_path, options) == summary
    assert counted == [1], "what is said of it has changed"
    assert np.isfinite(list(summary.values())).all()


def test_a_ranking_is_the_same_however_many_images_are_counted_at_once(tiny_run, monkeypatch):
    run = open_run(tiny_run)
    data, network = run.data, run.network
    samples = Shapes(data.prepared, data.rows(data.split.train)).samples(all_views=False)
    assert len(samples) % 4 > 0
    whole = evaluator.rank_templates(network, data.bank, data.prepared, samples)
    monkeypatch.setattr(evaluator, "_AT_ONCE", 4)
    chunked = evaluator.rank_templates(network, data.bank, data.prepared, samples)
    means = predict(network, data.prepared, samples).weights.mean(0)
    weights = dict(zip(data.bank.ids, means.tolist(), strict=True))
    for found in (whole, chunked):
        assert sum(row["count"] for row in found) == len(samples)
        assert {row["id"]: row["mean_weight"] for row in found} == pytest.approx(weights, rel=1e-5)
    assert [(r["id"], r["count"]) for r in whole] == [(r["id"], r["count"]) for r in chunked]
