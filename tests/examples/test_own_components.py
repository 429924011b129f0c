"""A package with components of its own, installed, used by every command, and then not there."""

import json
import signal
import subprocess
import sys

import pytest
from commands import ROOT, SAVING, in_one_process, killed, python, run_command
from conftest import TINY, photo_in

NOT_THEIRS = ("category", "templates", "encoder", "data.num_models", "evaluation", "protocol")
SMALL = ("data.count=30", *(x for x in TINY if not x.startswith(NOT_THEIRS)))
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


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Install the example package."""
    target = tmp_path_factory.mktemp("packages")
    pip = [sys.executable, "-m", "pip", "install", "-q", "--no-deps", "--no-build-isolation"]
    source = str(ROOT / "examples" / "own_components")
    subprocess.run([*pip, "--no-index", "--target", str(target), source], check=True)
    return target


@pytest.fixture(scope="module")
def used(packages, tmp_path_factory):
    """Train with the package, killed on the way, resume, use the run: run, what commands left."""
    folder, path = tmp_path_factory.mktemp("work"), f"{ROOT}:{packages}"
    code = killed("train", SAVING, "on_train_batch_start", 6)
    done = python("-c", code, *OWN, *SMALL, folder=folder, path=path)
    assert done.returncode == -signal.SIGKILL, done.stderr
    (checkpoint,) = folder.rglob("last.ckpt")
    before = checkpoint.stat().st_mtime_ns
    run = checkpoint.parents[1]
    measured = ("protocol=extents", "protocol.points=100", "evaluation.references=false")
    commands = {
        "train": ("train", *OWN, *SMALL),
        "help": ("train", "--help", "all"),
        "mistake": ("train", "encoder=patches", "encoder.chanels=3"),
        "evaluate": ("evaluate", f"run={run}", *measured),
    }
    found = in_one_process(*commands.values(), folder=folder, path=path)
    assert checkpoint.stat().st_mtime_ns > before
    return run, dict(zip(commands, found, strict=True))


def test_all_components_are_used_and_named(used):
    run, commands = used
    assert commands["train"].returncode == 0, commands["train"].stderr
    settings = (run / "config.yaml").read_text()
    named = ("boxes", "every_fifth", "specks", "patches", "taught", "smoothness", "by_height")
    for part in (*named, "extents", "rmsprop", "linear", "frozen_start", "own-components 0.1.0"):
        assert part in settings
    assert json.loads((run / "status.json").read_text())["state"] == "finished"
    assert "side_error" in commands["train"].stdout
    summary = json.loads((run / "evaluation" / "extents" / "summary.json").read_text())
    assert 0 < summary["side_error"] < 1
    assert [m["name"] for m in summary["protocol"]["metrics"]] == ["side_error"]


def test_their_settings_are_in_help_and_checked_and_other_settings_evaluate(used):
    _, commands = used
    for words in ("encoder=patches", "own-components 0.1.0", "channels=16", "temperature=0.5"):
        assert words in commands["help"].stdout
    assert commands["mistake"].returncode == 1
    assert "Did you mean encoder.channels?" in commands["mistake"].stderr
    assert commands["evaluate"].returncode == 0, commands["evaluate"].stderr
    assert "100 points" in commands["evaluate"].stdout


def test_predicts_from_the_checkpoint_alone(used, packages, tmp_path):
    """In a process that nothing but the checkpoint tells of the package."""
    run, _ = used
    checkpoint = tmp_path / "model.ckpt"
    checkpoint.write_bytes((run / "checkpoints" / "last.ckpt").read_bytes())
    photo_in(tmp_path)
    words = ("predict", "run=model.ckpt", "image=photo.png", "preview=false", "points=50")
    done = python("-m", "ffd_lightning", *words, folder=tmp_path, path=f"{ROOT}:{packages}")
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "predictions" / "photo" / "mesh.glb").is_file()
    done = run_command(*words, "out=others", cwd=tmp_path)  # here it is not installed
    assert done.returncode == 1
    assert "encoder 'patches' comes from own-components 0.1.0, which is not here" in done.stderr
