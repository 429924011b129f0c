"""The wheel, installed and used from another folder."""

import shutil
import subprocess
import sys

import pytest
from commands import ROOT, in_one_process
from conftest import FEW, TINY, photo_in

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


def test_the_wheel_has_all_commands_and_works_from_any_folder(
    installed, joint_checkpoint, tmp_path
):
    (tmp_path / "my_conf" / "regime").mkdir(parents=True)
    (tmp_path / "my_conf" / "regime" / "own.yaml").write_text(REGIME)
    ours, theirs = (
        {path.name for path in (root / "ffd_lightning" / "pretrained").iterdir() if path.is_file()}
        for root in (ROOT, installed)
    )
    assert theirs == ours, "the wheel has what the checkout has"
    shutil.copy(joint_checkpoint, installed / "ffd_lightning" / "pretrained" / "model.ckpt")
    photo_in(tmp_path)
    own = ("--config-dir", "my_conf")
    commands = {
        ("train", "-m", *own, "regime=own", *SETTINGS, "callbacks.report=true"): "Scores",
        ("status", "runs=runs"): "1 finished",
        ("train", *own, "--help", "all"): "a regime of one's own",
        ("sweep", "regimes", "--quick", "--dry-run"): "regime=b,w,e,r",
        ("predict", "image=photo.png", "category=sofa"): "photo.png: sofa (",
    }
    every = in_one_process(*commands, folder=tmp_path, path=installed)
    for done, words in zip(every, commands.values(), strict=True):
        assert done.returncode == 0, done.stderr
        assert words in done.stdout
    runs = sorted(tmp_path.glob(f"runs/default/table/*/t2/*/evaluation/{FEW}/samples.csv"))
    assert [run.relative_to(tmp_path).parts[3] for run in runs] == ["own"]
    assert (tmp_path / "runs" / "default" / "report.html").is_file()
    assert (tmp_path / "predictions" / "photo" / "mesh.glb").is_file()
