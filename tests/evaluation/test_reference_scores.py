import json
import shutil
import time
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from torch import nn

from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation import evaluator, reference_scores
from ffd_lightning.evaluation.evaluator import (
    EvaluatedNetwork,
    EvaluationOptions,
    Shapes,
    evaluate,
)
from ffd_lightning.evaluation.protocols import Measure, PaperProtocol, PartProtocol
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.nn.network import FfdPrediction

PROTOCOL = PaperProtocol(points=24)


class Network(nn.Module):
    """Outputs and features that follow from the image's colours and a seed."""

    def __init__(self, bank, seed):
        super().__init__()
        shape = (3, len(bank), *bank.control_points.shape[1:])
        drawn = torch.Generator().manual_seed(seed)
        self.offsets = nn.Parameter(0.3 * torch.randn(shape, generator=drawn))
        self.logits = nn.Parameter(40 * torch.randn(shape[:2], generator=drawn))
        self.mixing = nn.Parameter(torch.randn(3, 8, generator=drawn))

    def forward(self, images):
        return self.predict(self.features(images))

    def features(self, images):
        colours = 1 - images.float().mean((2, 3)) / 255
        return torch.cat([colours, colours @ self.mixing], 1)

    def predict(self, features):
        colours = features[:, :3]
        logits = colours @ self.logits
        offsets = torch.einsum("bc,ctmx->btmx", colours, self.offsets)
        return FfdPrediction(logits.softmax(1), logits.softmax(1), offsets, logits)


@pytest.fixture(scope="module")
def sets(tmp_path_factory):
    """Tables and chairs, with two images each."""
    render = RenderSettings(height=16, width=16, samples=1, azimuths=(30, 200))
    root = tmp_path_factory.mktemp("data")
    return [
        Preparation(ProceduralSource(9), name, 128, render, root, workers=2, progress=False).run()
        for name in ("table", "chair")
    ]


@dataclass(frozen=True)
class Case:
    """An evaluation of the first nine shapes of a set: templates, training and test shapes."""

    prepared: object
    seed: int = 0  # of the network
    templates: tuple = (0, 1)
    trained_on: tuple = (2, 3, 4, 5)
    tested_on: tuple = (6, 7, 8)
    bank: dict = field(default_factory=dict)
    protocol: object = PROTOCOL
    options: dict = field(default_factory=dict)

    def run(self, folder, shared=None, **more):
        """Evaluate into a folder, and return the bytes of `samples.csv`."""
        ids = [self.prepared.ids[row] for row in self.templates]
        bank = TemplateBank.of(self.prepared, ids, **{"max_edge": 0.2, **self.bank})
        rows = (np.array(x, np.int64) for x in (self.trained_on, self.tested_on))
        shapes = [Shapes(self.prepared, x) for x in rows]
        evaluated = EvaluatedNetwork(Network(bank, self.seed), bank, *shapes, step=0)
        settings = {"progress": False, "shared": shared, **self.options, **more}
        evaluate(evaluated, self.protocol, folder, EvaluationOptions(**settings))
        return (folder / "samples.csv").read_bytes()


@pytest.fixture(autouse=True)
def fits(monkeypatch):
    """What was fitted, a list that grows; fits are quick and bad, of the same arguments."""
    made = []

    def fit(bank, cloud, seed):
        made.append(seed)
        generator = torch.Generator().manual_seed(seed)
        offsets = cloud.std() * torch.randn(bank.control_points.shape[1:], generator=generator)
        return 1, (0.1 * offsets).numpy()

    monkeypatch.setattr(reference_scores, "fitted_template", fit)
    return made


@pytest.fixture
def runs(tmp_path):
    """Names of folders to evaluate into, each once."""
    return (tmp_path / f"run{k}" for k in range(100))


@pytest.fixture
def shared(tmp_path):
    return tmp_path / "data" / "references"


@pytest.fixture
def only(shared):
    """Return a function to the one file that is shared."""
    return lambda: next(iter(list(shared.iterdir())[-1:])) if shared.is_dir() else None


def test_another_network_finds_the_scores_and_they_change_nothing(sets, runs, shared, fits):
    first, second = Case(sets[0]), Case(sets[0], seed=1)
    alone = [case.run(next(runs)) for case in (first, second)]
    assert alone[0] != alone[1]
    assert len(fits) == 6
    assert first.run(next(runs), shared) == alone[0]
    assert len(fits) == 9
    assert second.run(next(runs), shared, workers=3) == alone[1]
    assert first.run(next(runs), shared) == alone[0]
    assert len(fits) == 9, "all were known"


def test_only_what_depends_on_the_network_is_scored_again(sets, runs, shared, monkeypatch):
    Case(sets[0]).run(next(runs), shared)
    scored, score = [], PaperProtocol.score
    monkeypatch.setattr(PaperProtocol, "score", lambda *a: (scored.append(a[1]), score(*a))[1])
    monkeypatch.setattr(reference_scores, "medoid", None)
    monkeypatch.setattr(reference_scores, "ShapeRetrieval", None)
    Case(sets[0], seed=1).run(next(runs), shared)
    # the model, its points drawn again, its template, the best deformed, the most similar image
    assert len(scored) <= 5 * 3 + 1, "and the floor of one, which tells whether the rest holds"


def with_digest(prepared):
    return replace(prepared, manifests=({**prepared.manifests[0], "sha256": "another"},))


@pytest.mark.parametrize(
    "change",
    [
        {"templates": (1, 0)},
        {"templates": (0, 2), "trained_on": (3, 4, 5)},
        {"trained_on": (2, 3, 4)},
        {"trained_on": (5, 4, 3, 2)},
        {"tested_on": (6, 7)},
        {"protocol": PaperProtocol(points=25)},
        {"protocol": PartProtocol()},
        {"options": {"seed": 1}},
        {"bank": {"degrees": (1, 7, 3)}},
        {"bank": {"max_edge": 0.15}},
    ],
    ids=str,
)
def test_another_evaluation_does_not_read_them(sets, runs, shared, fits, change):
    Case(sets[0]).run(next(runs), shared)
    other = replace(Case(sets[0], seed=1), **change)
    expected = other.run(next(runs))
    made = len(fits)
    assert other.run(next(runs), shared) == expected
    assert len(fits) - made == len(other.tested_on)
    assert len(list(shared.iterdir())) == 2


def test_other_data_does_not_read_them(sets, runs, shared, fits, monkeypatch, tmp_path):
    Case(sets[0]).run(next(runs), shared)
    Case(with_digest(sets[0])).run(next(runs), shared)
    assert len(fits) == 6
    monkeypatch.setattr(evaluator, "FORMAT_VERSION", -1)
    Case(sets[0]).run(next(runs), shared)
    assert len(fits) == 9
    moved = PreparedSet.open(shutil.copytree(sets[0].path, tmp_path / "moved"))
    with np.load(moved.file(0)) as arrays:  # of a template, with its id
        changed = {**arrays, "points": arrays["points"] + 1}
    np.savez(moved.file(0), **changed)
    Case(moved).run(next(runs), shared)
    assert len(fits) == 12
    assert len(list(shared.iterdir())) == 4


def test_all_images_of_a_shape_have_the_same_references(sets, runs, shared, fits):
    every = Case(sets[0], options={"all_views": True})
    expected = every.run(next(runs))
    assert len(expected.splitlines()) == 1 + 2 * 3
    assert len(fits) == 3, "also within an evaluation"
    Case(sets[0], seed=1).run(next(runs), shared)
    assert every.run(next(runs), shared) == expected
    assert len(fits) == 6


def damage(content, how):
    middle = len(content) // 2
    if how == "a digit":
        place = next(k for k in range(middle, len(content)) if content[k : k + 1].isdigit())
        return (
            content[:place] + (b"1" if content[place:][:1] != b"1" else b"2") + content[place + 1 :]
        )
    return {"cut off": content[:middle], "no scores": b"{}"}[how]


@pytest.mark.parametrize("how", ["cut off", "a digit", "no scores"])
def test_a_damaged_file_is_made_anew(sets, runs, shared, fits, only, how):
    case = Case(sets[0])
    expected = case.run(next(runs), shared)
    file = only()
    good = file.read_bytes()
    file.write_bytes(damage(good, how))
    assert file.read_bytes() != good
    assert case.run(next(runs), shared) == expected
    assert len(fits) == 6
    assert json.loads(file.read_bytes()) == json.loads(good)


@pytest.mark.parametrize("place", ["a file", "a folder in its place", "no room"])
def test_where_nothing_can_be_shared_all_is_computed(sets, runs, tmp_path, monkeypatch, place):
    case = Case(sets[0])
    expected = case.run(next(runs))
    shared = tmp_path / "shared"
    if place == "a file":
        shared.write_text("")
    elif place == "no room":
        monkeypatch.setattr(
            reference_scores, "write_atomic", lambda *_: (_ for _ in ()).throw(OSError(28, "full"))
        )
    else:
        case.run(next(runs), shared)
        (file,) = shared.iterdir()
        file.unlink()
        file.mkdir()
        (file / "x").write_text("")
    assert case.run(next(runs), shared) == expected


@pytest.mark.parametrize("killed", [False, True])
def test_an_evaluation_that_was_cut_off_goes_on(sets, runs, shared, fits, only, killed):
    case, folder = Case(sets[0]), next(runs)
    expected = case.run(next(runs))
    score = evaluator.score_shapes

    def journaled():
        return len((folder / "samples.partial").read_text().splitlines()) - 1

    def cut_off(*arguments):
        if len(fits) < 3 + 2:
            return score(*arguments)
        end = time.monotonic() + 60
        while journaled() < 1 and time.monotonic() < end:
            time.sleep(0.01)
        raise KeyboardInterrupt

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluator, "score_shapes", cut_off)
        with pytest.raises(KeyboardInterrupt):
            case.run(folder, shared)
    assert journaled() == 1
    made = len(fits)
    if killed:  # kill -9 leaves the journal alone
        shutil.rmtree(shared)
    assert case.run(folder, shared) == expected
    assert len(fits) - made == 2
    assert case.run(next(runs), shared) == expected
    assert len(fits) - made == 2 + killed, "what the journal had"
    assert set(json.loads(only().read_text())["scores"]) == set(sets[0].ids[6:9])
    assert case.run(next(runs), shared) == expected
    assert len(fits) - made == 2 + killed


class Ruler:
    """A protocol of another package, whose code changes and whose settings do not."""

    name, note, needs_parts = "ruler", "", False
    measures = (Measure("size", ""),)
    code = SimpleNamespace(scale=1.0)

    def truth(self, shape, rng):
        return 0.0

    def score(self, shape, truth, rng):
        return {"size": self.code.scale * float(np.abs(shape.cloud(9, rng)).mean())}


def test_scores_of_a_protocol_that_measures_otherwise_now_are_not_taken(
    sets, runs, shared, fits, monkeypatch
):
    case = Case(sets[0], protocol=Ruler())
    first = case.run(next(runs), shared)
    assert case.run(next(runs), shared) == first
    assert len(fits) == 3
    monkeypatch.setattr(Ruler.code, "scale", 2.0)
    expected = case.run(next(runs))
    assert expected != first
    for _ in range(2):
        assert case.run(next(runs), shared) == expected
    assert len(fits) == 3 + 3 + 3, "alone, and the first of the two"


def test_restart_computes_all_anew(sets, runs, shared, fits, only):
    case, folder = Case(sets[0]), next(runs)
    expected = case.run(folder, shared)
    good, before = only().read_bytes(), only().stat().st_ino
    assert case.run(folder, shared, restart=True) == expected
    assert len(fits) == 6
    assert only().read_bytes() == good
    assert only().stat().st_ino != before, "written anew"


def test_no_references_share_nothing(sets, runs, shared, fits):
    Case(sets[0]).run(next(runs), shared, references=False)
    assert not shared.exists()
    assert fits == []


def test_joined_sets_and_parts_share_too(sets, runs, shared, fits):
    tables = {"templates": (0, 9), "trained_on": (2, 3, 12, 13), "tested_on": (6, 15)}
    for protocol in (PROTOCOL, PartProtocol()):
        first, second = (
            Case(PreparedSet.join(sets), seed=seed, protocol=protocol, **tables) for seed in (0, 1)
        )
        expected = second.run(next(runs))
        first.run(next(runs), shared)
        fits.clear()
        assert second.run(next(runs), shared) == expected
        assert fits == []
