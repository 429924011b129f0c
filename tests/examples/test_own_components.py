"""A package with components of its own, installed, used by every command, and then not there."""

import json
import signal
import subprocess
import sys

import numpy as np
import pytest
from commands import ROOT, killed_training, python
from PIL import Image

TINY = (
    "data.num_points=256",
    "data.render.height=48",
    "data.render.width=64",
    "data.render.samples=1",
    "data.count=30",
    "network.hidden=32",
    "network.bottleneck=8",
    "schedule.batch_size=4",
    "schedule.num_points=64",
    "trainer.checkpoint_every=2",
    "schedule.steps=8",
    "preparation.workers=1",
    "trainer=cpu",
    "trainer.progress_bar=false",
    "callbacks.figure_examples=2",
)
OWN = (
    "data=boxes",
    "category=custom",
    "category.name=box",
    "split=every_fifth",
    "encoder=patches",
    "encoder.channels=8",
    "regime/selection=taught",
    "regime/term=[smoothness]",
    "regime.terms.smoothness.weight=0.1",
    "template_strategy=by_height",
    "templates=t2",
    "protocol=extents",
    "augmentation=specks",
    "optimizer=rmsprop",
    "lr_schedule=linear",
    "callback=[frozen_start]",
    "callback.frozen_start.steps=1",
)


def ffd(*arguments, folder, packages=None, program=("-m", "ffd_lightning")):
    """Run the command in a folder, with or without the example package: exit code, output."""
    path = ROOT if packages is None else f"{ROOT}:{packages}"
    done = python(*program, *arguments, folder=folder, path=path)
    return done.returncode, done.stdout + done.stderr


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Install the example package."""
    target = tmp_path_factory.mktemp("packages")
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation"]
    source = str(ROOT / "examples" / "own_components")
    subprocess.run([*pip, "--no-index", "--target", str(target), source], check=True)
    return target


@pytest.fixture(scope="module")
def trained(packages, tmp_path_factory):
    """Train with the package, killed on the way and resumed: folder, run, output."""
    folder = tmp_path_factory.mktemp("work")
    settings = (*OWN, *TINY)
    killed = ("-c", killed_training(5))
    code, output = ffd(*settings, folder=folder, packages=packages, program=killed)
    assert code == -signal.SIGKILL, output
    (checkpoint,) = folder.rglob("last.ckpt")
    before = checkpoint.stat().st_mtime_ns
    code, output = ffd("train", *settings, folder=folder, packages=packages)
    assert code == 0, output
    assert checkpoint.stat().st_mtime_ns > before
    return folder, checkpoint.parents[1], output


def test_all_components_are_used_and_named(trained):
    _, run, output = trained
    settings = (run / "config.yaml").read_text()
    named = ("boxes", "every_fifth", "specks", "patches", "taught", "smoothness", "by_height")
    for part in (*named, "extents", "rmsprop", "linear", "frozen_start", "own-components 0.1.0"):
        assert part in settings
    assert json.loads((run / "status.json").read_text())["state"] == "finished"
    assert "side_error" in output
    summary = json.loads((run / "evaluation" / "extents" / "summary.json").read_text())
    assert 0 < summary["side_error"] < 1
    assert [m["name"] for m in summary["protocol"]["metrics"]] == ["side_error"]


def test_its_settings_are_in_help_and_checked(trained, packages):
    folder, _, _ = trained
    _, output = ffd("train", "--help", "all", folder=folder, packages=packages)
    for words in ("encoder=patches", "own-components 0.1.0", "channels=16", "temperature=0.5"):
        assert words in output
    wrong = ("train", "encoder=patches", "encoder.chanels=3")
    code, output = ffd(*wrong, folder=folder, packages=packages)
    assert code == 1
    assert "Did you mean encoder.channels?" in output


def test_evaluated_under_its_protocol_with_other_settings(trained, packages):
    folder, run, _ = trained
    settings = (f"run={run}", "protocol=extents", "protocol.points=100")
    command = ("evaluate", *settings, "evaluation.references=false")
    code, output = ffd(*command, folder=folder, packages=packages)
    assert code == 0, output
    assert "100 points" in output


def test_predicts_from_the_checkpoint_alone(trained, packages, tmp_path):
    _, run, _ = trained
    checkpoint = tmp_path / "model.ckpt"
    checkpoint.write_bytes((run / "checkpoints" / "last.ckpt").read_bytes())
    picture = np.full((60, 80, 3), 255, np.uint8)
    picture[20:45, 25:60] = (120, 60, 30)
    Image.fromarray(picture).save(tmp_path / "photo.png")
    predict = ("predict", "run=model.ckpt", "image=photo.png", "preview=false", "points=50")
    code, output = ffd(*predict, folder=tmp_path, packages=packages)
    assert code == 0, output
    assert (tmp_path / "predictions" / "photo" / "mesh.glb").is_file()
    code, output = ffd(*predict, "out=others", folder=tmp_path)
    assert code == 1
    assert "encoder 'patches' comes from own-components 0.1.0, which is not here" in output
