import csv
import hashlib
import json
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
import torch
from commands import run_command
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from ffd_lightning import components
from ffd_lightning.analysis.runs import described_protocols
from ffd_lightning.app.build import build_data, build_network
from ffd_lightning.app.commands.evaluate import evaluate_run
from ffd_lightning.app.config import EvaluateConfig
from ffd_lightning.app.configuration import choose, compose_config, typed_config
from ffd_lightning.app.identity import evaluation_name
from ffd_lightning.app.training_run import train
from ffd_lightning.checkpoint import load_weights
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation import evaluator
from ffd_lightning.evaluation.protocols import (
    PROTOCOLS,
    ModernProtocol,
    PaperProtocol,
)
from ffd_lightning.evaluation.references import (
    SHAPES,
    ShapeRetrieval,
    medoid,
    nearest_by_feature,
)
from ffd_lightning.evaluation.samples import Sample, best_template, encode, predict
from ffd_lightning.evaluation.shapes import PreparedShape, TemplateShape
from ffd_lightning.files import lock_folder
from ffd_lightning.metrics.scalings import SCALINGS
from ffd_lightning.run_folder import RunFolder

ROOT = Path(__file__).parents[2]
SETTINGS = ("regime=e", "split.train_fraction=0.7", "split.val_fraction=0.2")


@pytest.fixture(scope="module")
def trained(tiny_config, tmp_path_factory):
    """A tiny run, its configuration and its data."""
    run = RunFolder(tmp_path_factory.mktemp("run") / "a")
    cfg = tiny_config(*SETTINGS)
    train(cfg, run)
    data = build_data(cfg)
    data.setup()
    return run, cfg, data


@pytest.fixture(scope="module")
def network(trained):
    run, cfg, _ = trained
    result = build_network(cfg)
    load_weights(result, run.checkpoint)
    return result


@pytest.fixture
def copy(trained, tmp_path):
    """The run's folder, free to be written to."""
    return RunFolder(shutil.copytree(trained[0].path, tmp_path / "run"))


def config(run, *overrides):
    """The settings of a command line; the paper's protocol with few points."""
    own = [f"run={run.path}", "progress_bar=false", *overrides]
    if not any(x.startswith("protocol") for x in own):
        own.append("protocol.points=64")
    return typed_config(compose_config("evaluate", EvaluateConfig, own), EvaluateConfig)


def evaluate(run, *overrides):
    return evaluate_run(config(run, *overrides))[0]


FEW = "paper-points-64"  # where results of `config` are


def samples(run, name=FEW):
    return (run.evaluation(name) / "samples.csv").read_text()


def test_what_is_written(copy, trained):
    summary = evaluate(copy)
    rows = list(csv.DictReader(samples(copy).splitlines()))
    data = trained[2]
    assert [row["id"] for row in rows] == list(data.split.test)
    for name in SHAPES:
        for measure in ("chamfer", "emd", "iou"):
            key = f"{name}_{measure}" if name else measure
            assert summary[key] == pytest.approx(np.mean([float(r[key]) for r in rows]))
    assert all(float(r["floor_iou"]) == 1 for r in rows)
    assert 0 < summary["floor_chamfer"] < summary["retrieval_chamfer"]
    assert all(r["resampled_iou"] == r["iou"] for r in rows), "the same mesh"
    assert not any(r["resampled_emd"] == r["emd"] for r in rows), "of other points"
    written = json.loads((copy.evaluation(FEW) / "summary.json").read_text())
    assert (written["step"], written["unit"]) == (8, "64 points, hemisphere of radius 3.2")
    assert not (copy.evaluation(FEW) / "samples.partial").exists()
    before = samples(copy)
    assert evaluate(copy, "evaluation.references=false") == summary, "read back, with references"
    assert samples(copy) == before


def twice_drawn(mesh, count, rng):
    """Points of which each face has its share, and as many of those again, with replacement."""
    corners = mesh.vertices[mesh.faces]
    areas = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    ends = np.round(areas.cumsum() / areas.sum() * count).astype(int)
    faces = np.searchsorted(ends, np.arange(count), side="right")
    order = rng.permutation(faces)
    u, v = rng.random((2, count))
    points = np.empty((count, 3))
    for k, face in enumerate(order):
        s, t = (u[k], v[k]) if u[k] + v[k] <= 1 else (1 - u[k], 1 - v[k])
        a, b, c = corners[face]
        points[k] = a + s * (b - a) + t * (c - a)
    return points[rng.integers(count, size=count)]


def test_the_numbers_are_the_papers(copy, trained, network):
    """Chamfer, EMD and IoU of a sample again, from the definitions and by other libraries."""
    evaluate(copy, "evaluation.references=false")
    row = list(csv.DictReader(samples(copy).splitlines()))[2]
    data = trained[2]
    place = data.prepared.index(row["id"])
    mesh = data.prepared.mesh(place)
    used = mesh.vertices[np.unique(mesh.faces)]
    center = (
        PaperProtocol().truth(PreparedShape(data.prepared, place), np.random.default_rng()).frame
    )
    radius = np.linalg.norm(used - center.center, axis=1).max()
    key = int.from_bytes(hashlib.sha256(row["id"].encode()).digest()[:8], "big")
    truth = twice_drawn(mesh, 64, np.random.default_rng([0, key, 0]))
    drawn = np.random.default_rng([0, key, 1]).integers(256, size=64)
    t = data.bank.ids.index(row["template"])
    moved = (
        data.bank.control_points[t] + predict(network, data.prepared, [Sample(place)]).offsets[0, t]
    )
    cloud = (data.bank.deformation_matrix[t] @ moved).numpy()[drawn].astype(float)
    a, b = ((x - center.center) * 3.2 / radius for x in (cloud, truth))
    distances = cdist(a, b)
    chamfer = (distances.min(0) ** 2).mean() + (distances.min(1) ** 2).mean()
    assert float(row["chamfer"]) == pytest.approx(chamfer, rel=1e-4)
    pairs = linear_sum_assignment(distances)
    assert float(row["emd"]) == pytest.approx(distances[pairs].mean(), rel=1e-4)


def test_nothing_but_the_checkpoint_and_the_seed_decides_the_numbers(copy):
    one = evaluate(copy, "evaluation.workers=1")
    first = samples(copy)
    assert evaluate(copy, "evaluation.workers=3", "restart=true") == one
    other = evaluate(copy, "evaluation.seed=1")
    assert samples(copy) == first
    assert samples(copy, f"{FEW}_seed-1") != first
    assert other["chamfer"] != one["chamfer"]
    assert other["iou"] == one["iou"], "voxels are not drawn"


def test_training_ends_with_the_same_evaluation(trained, monkeypatch):
    run = trained[0]
    before = samples(run, "paper")
    monkeypatch.setattr(evaluator, "score_shapes", None)
    summary = evaluate(run, "evaluation.references=false", "protocol=paper")
    assert summary.items() <= run.status["summary"].items()
    assert samples(run, "paper") == before


def test_templates_are_ranked_on_the_validation_shapes(copy, trained):
    """As the same network ranks them where it is evaluated on those."""
    data = trained[2]
    evaluate(copy, "evaluation.references=false", "evaluation.subset=val")
    folder = copy.evaluation(FEW, "val")
    rows = list(csv.DictReader((folder / "samples.csv").read_text().splitlines()))
    assert [row["id"] for row in rows] == list(data.split.val)
    ranking = (copy.path / "template_ranking.csv").read_text()
    assert ranking == (folder / "template_ranking.csv").read_text()
    text = copy.config.read_text()
    copy.config.write_text(text.replace("val_fraction: 0.2", "val_fraction: 0.0"))
    with pytest.raises(ConfigError, match=r"evaluation\.subset=val: there are no validation"):
        evaluate(copy, "evaluation.subset=val")


def test_a_finished_run_is_evaluated_again_under_another_protocol(copy, trained, tiny_config):
    cfg = tiny_config(*SETTINGS, "protocol=modern", "protocol.points=100")
    weights = torch.load(copy.checkpoint, weights_only=True)["state_dict"]
    summary = train(cfg, copy)
    assert summary["fscore_2"] > 0
    told = copy.status["evaluation"]
    assert told["name"] == "modern-points-100"
    assert "points=100" in told["settings"]
    assert (told["references"], told["subset"]) == (False, "test")
    again = torch.load(copy.checkpoint, weights_only=True)["state_dict"]
    assert all(torch.equal(again[name], value) for name, value in weights.items())


def test_all_views(tiny_config, tmp_path):
    run = RunFolder(tmp_path)
    few = ("data.num_models=10", "split.train_fraction=0.6", "schedule.steps=2")
    views = ("data.render.azimuths=[30,200]", "network.batch_norm_momentum=1")
    train(tiny_config(*few, *views), run)
    one = evaluate(run)
    rows = list(csv.DictReader(samples(run).splitlines()))
    both = evaluate(run, "evaluation.all_views=true")
    views = list(csv.DictReader(samples(run, "paper-all-views_points-64").splitlines()))
    assert [row["view"] for row in views] == ["0", "1"] * len(rows)
    assert [r["emd"] for r in views if r["view"] == "0"] == [r["emd"] for r in rows]
    assert [r["emd"] for r in views if r["view"] == "1"] != [r["emd"] for r in rows]
    assert both["floor_emd"] == pytest.approx(one["floor_emd"])


def test_one_evaluation_at_a_time_and_none_of_a_network_that_has_diverged(copy, tmp_path):
    with lock_folder(copy.evaluation(FEW), ""), pytest.raises(ConfigError, match="evaluates"):
        evaluate(copy)
    content = torch.load(copy.checkpoint, weights_only=True)
    name = next(n for n in content["state_dict"] if n.endswith("bias"))
    content["state_dict"][name][:] = float("nan")
    torch.save(content, tmp_path / "nan.ckpt")
    with pytest.raises(DataError, match="not finite"):
        evaluate(copy, f"checkpoint={tmp_path}/nan.ckpt")


# The first template's control points in one place, all moved alike, and all far apart.
HOPELESS = {
    "collapsed": lambda control: np.float32([0.1, 0.2, 0.1]) - control,
    "far away": lambda control: np.full_like(control, 10),
    "huge": lambda control: 1e4 * control,
}


def hopeless(bank, make):
    return TemplateShape(bank, 0, HOPELESS[make](bank.control_points[0].numpy()))


@pytest.fixture(params=list(PROTOCOLS))
def protocol(request, monkeypatch):
    """Each protocol, with fewer points."""
    for name, scaling in SCALINGS.items():
        monkeypatch.setitem(SCALINGS, name, replace(scaling, num_points=500))
    return ModernProtocol(points=500) if request.param == "modern" else PROTOCOLS[request.param]


def test_better_shapes_score_better_and_hopeless_ones_finitely(trained, protocol):
    data = trained[2]
    truth = PreparedShape(data.prepared, 3)
    reference = protocol.truth(truth, np.random.default_rng(0))

    def scores(shape):
        return protocol.score(shape, reference, np.random.default_rng(1))

    same, other = scores(truth), scores(TemplateShape(data.bank, 0))
    for measure in protocol.measures:
        better = same[measure.name] > other[measure.name]
        assert better == measure.higher_is_better, measure.name
    for make in HOPELESS:
        shape = hopeless(data.bank, make)
        found = scores(shape)
        assert not any(np.isnan(value) for value in shape.distortion().values()), make
        for measure in protocol.measures:
            assert np.isfinite(found[measure.name]), (make, measure.name)
            worse = found[measure.name] - other[measure.name]
            if measure.name != "normal_consistency":
                as_bad = (worse <= 0) if measure.higher_is_better else (worse > 0)
                assert as_bad, (make, measure.name)


def test_a_killed_evaluation_is_resumed(copy, trained, monkeypatch):
    undisturbed = evaluate(copy, "evaluation.references=false")
    expected = samples(copy)
    shutil.rmtree(copy.evaluation(FEW))
    code = """
import os, signal
from ffd_lightning.app.main import run
from ffd_lightning.evaluation.protocols import PaperProtocol

truth, calls = PaperProtocol.truth, []

def killed(*arguments):
    calls.append(1)
    if len(calls) == 4:
        os.kill(os.getpid(), signal.SIGKILL)
    return truth(*arguments)

PaperProtocol.truth = killed
run("evaluate")
"""
    overrides = ["protocol.points=64", "evaluation.workers=1", "evaluation.references=false"]
    command = [sys.executable, "-c", code, f"run={copy.path}", *overrides]
    done = subprocess.run(command, cwd=ROOT, capture_output=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    partial = copy.evaluation(FEW) / "samples.partial"
    kept = partial.read_text()
    left = len(kept.splitlines()) - 1
    assert left > 0
    scored, score = [], evaluator.score_shapes

    def count(*arguments):
        scored.append(arguments)
        return score(*arguments)

    monkeypatch.setattr(evaluator, "score_shapes", count)
    for text, again in (
        (f'{kept}{{"id": "table-0000', len(trained[2].split.test) - left),  # cut off
        ("of other settings\n" + kept.partition("\n")[2], len(trained[2].split.test)),
    ):
        scored.clear()
        shutil.rmtree(copy.evaluation(FEW))
        partial.parent.mkdir()
        partial.write_text(text)
        assert evaluate(copy, "evaluation.references=false") == undisturbed
        assert samples(copy) == expected
        assert len(scored) == again


def test_another_checkpoint_and_another_prepared_set(copy, trained, tmp_path):
    run, _, data = trained
    other = tmp_path / "other.ckpt"
    content = torch.load(run.checkpoint, weights_only=True)
    for value in content["state_dict"].values():
        if value.is_floating_point():
            value.mul_(1.01)
    torch.save(content, other)
    first = evaluate(copy, "evaluation.references=false")
    own = samples(copy)
    assert evaluate(copy, "evaluation.references=false", f"checkpoint={other}") != first
    everything = evaluate(copy, "evaluation.references=false", f"prepared={data.prepared.path}")
    assert everything["num_samples"] == len(data.prepared) - 2, "all but the templates"
    same = evaluate(copy, "evaluation.references=false", f"checkpoint={run.checkpoint}")
    assert same == first, "of the same weights, in another file"
    assert samples(copy) == own, "those of the run's own network and shapes are not lost"
    below = [file.parent.name for file in sorted(copy.evaluation(FEW).glob("*/samples.csv"))]
    assert below[0].startswith(f"{data.prepared.path.name}-")
    assert below[1].startswith("weights-")
    assert list(described_protocols(copy)) == ["paper", FEW]
    copy.set_status("running")  # its last checkpoint is not its last
    evaluate(copy, "evaluation.references=false", "evaluation.seed=1")
    assert not (copy.evaluation(f"{FEW}_seed-1") / "samples.csv").exists()
    assert len(list(copy.evaluation(f"{FEW}_seed-1").glob("weights-*/samples.csv"))) == 1


@dataclass(frozen=True)
class Thresholds:
    """A protocol's settings, one of them without a default."""

    within: tuple[float, ...]
    places: list[int] = field(default_factory=lambda: [1])
    name: str = "shares"


def test_the_name_of_results_follows_from_all_settings_of_the_protocol(copy, monkeypatch):
    monkeypatch.setattr(components, "_registered", dict(components._registered))
    components.component("protocol", "shares")(Thresholds)
    given = [{"within": [0.01]}, {"within": [0.5]}, {"within": [0.01], "places": [1, 2]}]
    protocols = [choose("protocol", {"name": "shares", **x}, "protocol") for x in given]
    names = [evaluation_name(replace(config(copy), protocol=x)) for x in protocols]
    assert len(set(names)) == 3
    assert all(name.startswith("shares-") for name in names)


def test_what_is_missing_is_said(copy, tiny_config, tmp_path):
    other = RunFolder(tmp_path / "four")
    train(tiny_config("templates=t4", "schedule.steps=2"), other)
    for settings, error, message in (
        ({"run": "/no/such"}, ConfigError, "there is no run"),
        ({"run": __file__}, ConfigError, "is a checkpoint, .* give run=RUN checkpoint=FILE"),
        ({"checkpoint": "/no/such.ckpt"}, ConfigError, "there is no checkpoint"),
        ({"checkpoint": __file__}, DataError, "damaged or no checkpoint"),
        ({"checkpoint": str(other.checkpoint)}, ConfigError, "is of another network"),
        ({"prepared": "/no/such"}, DataError, "is not a prepared set"),
        ({"data_root": "/proc/no"}, DataError, "cannot prepare"),
    ):
        with pytest.raises(error, match=message):
            evaluate_run(replace(config(copy), **settings))


def test_the_modern_protocol(copy):
    summary = evaluate(copy, "protocol=modern", "protocol.points=200")
    for measure in ModernProtocol().measures:
        for name in ("", "undeformed", "floor"):
            assert 0 <= summary[f"{name}_{measure.name}" if name else measure.name] < 2
    assert summary["floor_iou_128"] == summary["floor_iou_32"] == 1
    assert "resampled_iou_32" not in summary, "its points are drawn anew as it is"
    assert summary["floor_chamfer_l1"] < summary["chamfer_l1"]
    assert summary["floor_fscore_2"] > summary["fscore_2"]
    assert 0 <= summary["folded"] <= 1 <= summary["stretch_median"] <= summary["stretch_95"]


def test_surfaces_are_measured_on_the_longest_side_of_the_truth(trained):
    """Twice the size of everything changes nothing, and a shift by 1% of the side is found."""
    data = trained[2]
    mesh = data.prepared.mesh(3)

    class Moved(PreparedShape):
        def mesh(self):
            side = np.ptp(mesh.vertices, axis=0).max()
            return mesh.vertices + (0, 0.011 * side, 0), mesh.faces

    shape, protocol = PreparedShape(data.prepared, 3), ModernProtocol(points=4000)
    truth = protocol.truth(shape, np.random.default_rng(0))
    scores = protocol.score(Moved(data.prepared, 3), truth, np.random.default_rng(0))
    assert 0.003 < scores["chamfer_l1"] < 0.012, "less than the shift where a face lies along it"
    assert scores["hausdorff90"] == pytest.approx(0.011, rel=0.25)


# --- references ---------------------------------------------------------------------------------


def naive(a, b):
    squared = cdist(a.astype(float), b.astype(float)) ** 2
    return squared.min(0).mean() + squared.min(1).mean()


def test_the_nearest_training_shape(prepared):
    among = list(range(5, 20))
    retrieval = ShapeRetrieval(prepared, among)
    for row in (0, 21, 7):
        nearest = retrieval.nearest(prepared.cloud(row))
        distances = [naive(prepared.cloud(row), prepared.cloud(k)) for k in among]
        assert nearest == among[int(np.argmin(distances))]
    assert retrieval.nearest(prepared.cloud(7)) == 7


def test_the_medoid(prepared):
    rows = list(range(3, 12))
    totals = [sum(naive(prepared.cloud(a), prepared.cloud(b)) for b in rows) for a in rows]
    assert medoid(prepared, rows) == rows[int(np.argmin(totals))]


def test_the_most_similar_image(trained, network):
    data = trained[2]
    features = encode(network, data.prepared, [Sample(k) for k in range(10)])
    torch.testing.assert_close(features.norm(dim=1), torch.ones(10))
    known = torch.nn.functional.normalize(torch.randn(8, 50, generator=torch.manual_seed(0)))
    near = torch.nn.functional.normalize(known[[3, 0]] + 0.02)
    assert nearest_by_feature(near, known).tolist() == [3, 0]


def test_the_best_templates(trained):
    data = trained[2]
    offsets = 0.1 * np.random.default_rng(0).normal(size=(2, 64, 3)).astype("f4")
    for row in data.rows(data.split.test)[:4]:
        truth = data.prepared.cloud(int(row))
        as_is = [naive(data.bank.points[t].numpy(), truth) for t in (0, 1)]
        moved = data.bank.deformation_matrix @ (data.bank.control_points + offsets)
        deformed = [naive(moved[t].numpy(), truth) for t in (0, 1)]
        best = [best_template(data.prepared, int(row), data.bank, x) for x in (None, offsets)]
        assert best == [int(np.argmin(as_is)), int(np.argmin(deformed))]


# --- parts --------------------------------------------------------------------------------------


def test_a_prediction_does_not_depend_on_its_company(trained, network):
    data = trained[2]
    alone = predict(network, data.prepared, [Sample(4)])
    company = predict(network, data.prepared, [Sample(1), Sample(4), Sample(9)], workers=2)
    np.testing.assert_array_equal(alone.offsets[0], company.offsets[1])
    np.testing.assert_array_equal(alone.weights[0], company.weights[1])


def test_the_command(copy):
    own = ("evaluate", f"run={copy.path}", "protocol.points=64", "evaluation.references=false")
    done = run_command(*own, cwd=copy.path.parent)
    assert done.returncode == 0, done.stderr
    assert "selected template, deformed" in done.stdout
    assert (copy.evaluation(FEW) / "samples.csv").is_file()
    for override, word in (
        ("run=/no/such", "there is no run /no/such"),
        ("protocol=papre", "no protocol 'papre'. Did you mean protocol=paper?"),
        ("chekpoint=x", "Did you mean checkpoint?"),
        ("evaluation.refrences=false", "Did you mean evaluation.references?"),
        ("protocol.points=0", "protocol.points=0 must be above 0"),
    ):
        done = run_command("evaluate", f"run={copy.path}", override)
        assert done.returncode == 1
        assert word in done.stderr
        assert "Traceback" not in done.stderr
