"""The wheel, installed and used from another folder."""

import shutil
import subprocess
import sys

import numpy as np
import pytest
from commands import ROOT, python
from conftest import FEW, TINY
from PIL import Image

SETTINGS = (*TINY, "schedule.steps=2", "preparation.workers=1")
REGIME = """\
# own: a regime of one's own
defaults:
  - selection: weighted
  - _self_

name: own
min_weight: 0.2
terms:
  weighted_chamfer: {term: chamfer}
  offset_penalty: {weight: 0.5, annealing: exponential}
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """Build the wheel and install it into a folder of its own."""
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "-q"]
    options = ["--no-deps", "--no-index"]
    build = [*pip, "wheel", *options, "--no-build-isolation", "-w", folder, ROOT]
    subprocess.run(build, check=True)
    (wheel,), target = folder.glob("*.whl"), folder / "site"
    subprocess.run([*pip, "install", *options, "--target", target, wheel], check=True)
    return target


def ffd(installed, folder, *arguments):
    """Run the installed command in a folder that is no checkout."""
    done = python("-m", "ffd_lightning", *arguments, folder=folder, path=installed)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_the_wheel_has_all_commands_and_trains_a_sweep_from_any_folder(installed, tmp_path):
    (tmp_path / "my_conf" / "regime").mkdir(parents=True)
    (tmp_path / "my_conf" / "regime" / "own.yaml").write_text(REGIME)
    sweep = ("train", "-m", "--config-dir", "my_conf", "regime=b,own", *SETTINGS)
    ffd(installed, tmp_path, *sweep, "callbacks.report=true")
    runs = sorted(tmp_path.glob(f"runs/default/table/*/t2/*/evaluation/{FEW}/samples.csv"))
    assert [run.relative_to(tmp_path).parts[3] for run in runs] == ["b", "own"]
    assert (tmp_path / "runs" / "default" / "report.html").is_file()
    assert "2 finished" in ffd(installed, tmp_path, "status", "runs=runs")
    help_of_train = ffd(installed, tmp_path, "train", "--config-dir", "my_conf", "--help", "all")
    assert "a regime of one's own" in help_of_train
    study = ffd(installed, tmp_path, "sweep", "regimes", "--quick", "--dry-run")
    assert "regime=b,w,e,r" in study


def test_the_wheel_predicts_by_the_model_in_it(installed, joint_checkpoint, tmp_path):
    ours, theirs = (
        {path.name for path in (root / "ffd_lightning" / "pretrained").iterdir() if path.is_file()}
        for root in (ROOT, installed)
    )
    assert theirs == ours, "the wheel has what the checkout has"
    shutil.copy(joint_checkpoint, installed / "ffd_lightning" / "pretrained" / "model.ckpt")
    picture = np.full((60, 80, 3), 255, np.uint8)
    picture[20:45, 25:60] = (120, 60, 30)
    Image.fromarray(picture).save(tmp_path / "photo.png")
    output = ffd(installed, tmp_path, "predict", "image=photo.png", "category=sofa")
    assert "photo.png: sofa (" in output
    assert (tmp_path / "predictions" / "photo" / "mesh.glb").is_file()
