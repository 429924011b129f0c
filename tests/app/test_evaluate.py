import csv
import shutil
import signal
from dataclasses import replace
from pathlib import Path

import pytest
import torch
import trimesh
from commands import killed, python, run_command, train_config
from conftest import FEW, TINY

from ffd_lightning.app.build import build_data
from ffd_lightning.app.commands.evaluate import evaluate_run, read_config
from ffd_lightning.app.first_weights import leak_warning
from ffd_lightning.app.messages import SHOWN, explain
from ffd_lightning.app.training_run import train
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation import evaluator
from ffd_lightning.run_folder import RunFolder

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


@pytest.fixture
def copy(trained, tmp_path):
    """The run's folder, free to be written to."""
    return RunFolder(shutil.copytree(trained[0].path, tmp_path / "run"))


def config(run, *overrides):
    """The settings of a command line; the paper's protocol with few points."""
    own = [f"run={run.path}", "progress_bar=false", *overrides]
    if not any(x.startswith("protocol") for x in own):
        own.append("protocol.points=64")
    return read_config(own)


def evaluate(run, *overrides):
    return evaluate_run(config(run, *overrides))[0]


def samples(run, name=FEW):
    return (run.evaluation(name) / "samples.csv").read_text()


def test_training_ends_with_the_evaluation_of_the_command(copy):
    before = samples(copy)
    file = copy.evaluation(FEW) / "summary.json"
    written = file.stat().st_mtime_ns
    own = ("protocol.points=64", "evaluation.references=false")
    done = run_command("evaluate", f"run={copy.path}", *own, cwd=copy.path.parent)
    assert done.returncode == 0, done.stderr
    assert "selected template, deformed" in done.stdout
    assert (samples(copy), file.stat().st_mtime_ns) == (before, written)
    with pytest.raises(SHOWN) as caught:
        config(copy, "protocol=papre")
    assert "no protocol 'papre'. Did you mean protocol=paper?" in explain(caught.value)


def test_a_finished_run_is_evaluated_again_under_another_protocol(copy, trained, tiny_config):
    cfg = tiny_config(*SETTINGS, "protocol=modern", "protocol.points=100")
    weights = torch.load(copy.checkpoint, weights_only=True)["state_dict"]
    summary = train(cfg, copy)
    assert summary["fscore_2"] > 0
    status = copy.status["evaluation"]
    assert status["name"] == "modern-points-100"
    assert "points=100" in status["settings"]
    assert (status["references"], status["subset"]) == (False, "test")
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


def test_a_killed_evaluation_is_resumed(copy, trained, monkeypatch):
    undisturbed = evaluate(copy, "evaluation.references=false")
    expected = samples(copy)
    shutil.rmtree(copy.evaluation(FEW))
    overrides = ["protocol.points=64", "evaluation.workers=1", "evaluation.references=false"]
    code = killed("evaluate", "ffd_lightning.evaluation.protocols.PaperProtocol", "truth", 4)
    done = python("-c", code, f"run={copy.path}", *overrides)
    assert done.returncode == -signal.SIGKILL, done.stderr
    partial = copy.evaluation(FEW) / "samples.partial"
    kept = partial.read_text()
    left = len(kept.splitlines()) - 1
    assert left > 0
    scored, score = [], evaluator.score_sample

    def count(*arguments):
        scored.append(arguments)
        return score(*arguments)

    monkeypatch.setattr(evaluator, "score_sample", count)
    partial.write_text(f'{kept}{{"id": "table-0000')  # cut off
    assert evaluate(copy, "evaluation.references=false") == undisturbed
    assert samples(copy) == expected
    assert len(scored) == len(trained[2].split.test) - left


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
    copy.set_status("running")  # its last checkpoint is not its last
    evaluate(copy, "evaluation.references=false", "evaluation.seed=1")
    assert not (copy.evaluation(f"{FEW}_seed-1") / "samples.csv").exists()
    assert len(list(copy.evaluation(f"{FEW}_seed-1").glob("weights-*/samples.csv"))) == 1


def test_other_templates(tmp_path):
    """Shapes that are among the templates are not tested, whatever they are called."""
    root, meshes = tmp_path / "shapes" / "table", tmp_path / "meshes"
    root.mkdir(parents=True)
    for k in range(12):
        trimesh.creation.box((1, 1 + k / 9, 2 + k / 5)).export(root / f"{k}.off")
    tiny = [x for x in TINY if not x.startswith("data.num_models")]
    own = [f"paths.data={tmp_path}/data", "data=folder", f"data.root={root.parent}"]
    few = ["heads=conditioned", "heads.draw=3", "schedule.steps=2", "split.train_fraction=0.5"]
    few.append("data.variants=0")
    cfg, run = train_config(*tiny, *own, *few), RunFolder(tmp_path / "run")
    train(cfg, run)
    data = build_data(cfg)
    data.setup()
    evaluate(run)
    before, test = samples(run), data.split.test

    def scored(templates, **how):
        there = set(run.evaluation(FEW).iterdir())
        summary, _ = evaluate_run(replace(config(run), templates=[str(templates)], **how))
        (folder,) = set(run.evaluation(FEW).iterdir()) - there
        rows = list(csv.DictReader((folder / "samples.csv").read_text().splitlines()))
        assert summary["num_samples"] == len(rows)
        retrieved = {x for x in rows[0] if x.endswith("retrieval_chamfer")}
        if Path(templates).is_file():  # what is retrieved is retrieved from the templates
            assert len(retrieved) == 2
            assert all(row[x] == row["medoid_chamfer"] for row in rows for x in retrieved)
        ranking = csv.DictReader((folder / "template_ranking.csv").read_text().splitlines())
        return {row["id"] for row in rows}, {row["id"] for row in ranking}

    everything = set(data.prepared.originals.ids)
    assert scored("train") == (set(test), everything - set(test))
    meshes.mkdir()
    for name, shape in (("a", test[0]), ("b", data.split.train[0])):
        trimesh.load(root / f"{shape}.off").export(meshes / f"{name}.stl")  # the same mesh
    assert scored(meshes) == (set(test[1:]), {"a", "b"})
    assert scored(meshes / "b.stl") == (set(test), {"b"})
    assert scored(meshes, beside=True) == (set(test[1:]), {"a", "b", *data.bank.ids})
    with pytest.raises(ConfigError, match="own shapes, as they are"):
        scored("train", beside=True)
    with pytest.raises(ConfigError, match="among the templates"):
        scored(root)
    assert samples(run) == before
    again = [*tiny, *own, *few[:-1], "split.train_fraction=0.3", f"network.weights={run.path}"]
    fewer = train_config(*again)
    trained = f"of 12 shapes to test on, {12 - len(test)} trained"
    assert trained in leak_warning(fewer, [*everything])
    # Other files of the same names: no scores of its own are lost, and no template is another.
    trimesh.creation.box((3, 1, 1)).export(root / f"{test[0]}.off")
    evaluate(run)
    assert samples(run) == before
    assert len(list(run.evaluation(FEW).glob("data-*/samples.csv"))) == 1
    trimesh.creation.box((3, 1, 1)).export(root / f"{data.bank.ids[0]}.off")
    with pytest.raises(ConfigError, match="shapes were added, removed or changed"):
        evaluate(run)
    run.set_status("running")
    with pytest.raises(DataError, match="has other templates than there are now"):
        train(cfg, run)
    shutil.rmtree(root)
    assert "is not known" in leak_warning(fewer, [*everything])
    with pytest.raises(DataError, match=r"has moved, change its place in .*config\.yaml"):
        evaluate(run)
