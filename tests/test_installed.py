"""The wheel, installed and used from another folder."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[1]
TINY = (
    "category=table",
    "templates=t2",
    "data.num_models=24",
    "data.num_points=256",
    "data.render.height=48",
    "data.render.width=64",
    "data.render.samples=1",
    "network.hidden=32",
    "network.bottleneck=8",
    "schedule.steps=2",
    "schedule.batch_size=4",
    "schedule.num_points=64",
    "preparation.workers=1",
    "trainer=cpu",
    "trainer.progress_bar=false",
    "evaluation.references=false",
)
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
    options = ["--no-deps", "--no-build-isolation", "--no-index"]
    subprocess.run([*pip, "wheel", *options, "-w", folder, ROOT], check=True)
    (wheel,) = folder.glob("*.whl")
    target = folder / "site"
    subprocess.run(
        [*pip, "install", "--no-deps", "--no-index", "--target", target, wheel], check=True
    )
    return target


def ffd(installed, folder, *arguments):
    """Run the installed command in a folder that is no checkout."""
    environment = os.environ | {"PYTHONPATH": str(installed), "COLUMNS": "200"}
    done = subprocess.run(
        [sys.executable, "-m", "ffd_lightning", *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, done.stdout + done.stderr


def test_the_wheel_trains_a_sweep_from_any_folder(installed, tmp_path):
    (tmp_path / "my_conf" / "regime").mkdir(parents=True)
    (tmp_path / "my_conf" / "regime" / "own.yaml").write_text(REGIME)
    sweep = ("train", "-m", "--config-dir", "my_conf", "regime=b,own", *TINY)
    code, output = ffd(installed, tmp_path, *sweep)
    assert code == 0, output
    runs = sorted(tmp_path.glob("runs/default/table/*/t2/*/evaluation/paper/samples.csv"))
    assert [run.relative_to(tmp_path).parts[3] for run in runs] == ["b", "own"]
    assert (tmp_path / "runs" / "default" / "report.html").is_file()
    code, output = ffd(installed, tmp_path, "status", "runs=runs")
    assert code == 0, output
    assert "2 finished" in output


def test_the_wheel_has_studies_and_the_help_of_a_users_folder(installed, tmp_path):
    (tmp_path / "my_conf" / "regime").mkdir(parents=True)
    (tmp_path / "my_conf" / "regime" / "own.yaml").write_text(REGIME)
    help_of_train = ("train", "--config-dir", "my_conf", "--help")
    code, output = ffd(installed, tmp_path, *help_of_train)
    assert code == 0, output
    assert re.search(r"^ +regime=b +b, e, own, ", output, re.MULTILINE)
    code, output = ffd(installed, tmp_path, *help_of_train, "all")
    assert code == 0, output
    assert "a regime of one's own" in output
    code, output = ffd(installed, tmp_path, "sweep", "regimes", "--quick", "--dry-run")
    assert code == 0, output
    assert "regime=b,w,e,r" in output


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
    code, output = ffd(installed, tmp_path, "predict", "image=photo.png", "category=sofa")
    assert code == 0, output
    assert "photo.png: sofa (" in output
    assert (tmp_path / "predictions" / "photo" / "mesh.glb").is_file()
