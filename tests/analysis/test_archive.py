"""A study's archive holds what its runs hold."""

import re
import shutil
import zipfile

import numpy as np
import pandas as pd
import pytest

from ffd_lightning.analysis.archive import read_archive, write_archive
from ffd_lightning.analysis.runs import find_runs, load_samples
from ffd_lightning.analysis.selection import run_families
from ffd_lightning.errors import DataError


@pytest.fixture(scope="module")
def study(tiny_run, tmp_path_factory):
    root = tmp_path_factory.mktemp("study")
    for seed in (0, 1):
        folder = root / "table" / "r" / f"seed{seed}"
        shutil.copytree(tiny_run.path, folder)
        config = folder / "config.yaml"
        config.write_text(config.read_text().replace("\nseed: 0", f"\nseed: {seed}"))
    return root


def test_scores_come_back(study, tmp_path):
    runs = find_runs(study)
    write_archive(runs, study, tmp_path / "study.zip", {"machine": "a small one"})
    found = read_archive(tmp_path / "study.zip")
    expected = load_samples(runs)
    assert set(found.samples["run"]) == {"table/r/seed0", "table/r/seed1"}
    assert list(found.samples["id"]) == list(expected["id"])
    assert list(found.samples["family"]) == list(expected["family"])
    families = run_families(runs)
    for run, template, family in zip(
        expected["run"], expected["template"], found.samples["template_family"], strict=True
    ):
        assert family == families[run][template] != ""
    assert set(found.families) == {"table/r/seed0", "table/r/seed1"}
    numbers = expected.select_dtypes("number").columns
    np.testing.assert_allclose(found.samples[numbers], expected[numbers], rtol=1e-4)
    assert found.protocol.name == "paper"
    assert found.about["machine"] == "a small one"
    assert found.about["settings"]["regime.name"] == "r"
    assert list(found.settings["seed"]) == [0, 1]
    assert (found.curves.groupby("run")["step"].max() == 8).all()
    assert found.curves["box_chamfer"].gt(0).all()


def test_the_same_study_gives_the_same_file(study, tmp_path):
    for name in ("a.zip", "b.zip"):
        write_archive(find_runs(study), study, tmp_path / name)
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()


def test_no_folder_of_the_machine_is_kept(study, tmp_path):
    write_archive(find_runs(study), study, tmp_path / "study.zip")
    with zipfile.ZipFile(tmp_path / "study.zip") as archive:
        text = "".join(archive.read(name).decode() for name in archive.namelist())
    assert str(tmp_path.parent) not in text
    assert not re.search(r'["\s,](/\w+)+', text)


def test_nothing_finished_and_nothing_there(tmp_path):
    with pytest.raises(DataError, match="finished"):
        write_archive([], tmp_path, tmp_path / "study.zip")
    (tmp_path / "broken.zip").write_bytes(b"no zip")
    for name in ("broken.zip", "absent.zip"):
        with pytest.raises(DataError, match="no archive"):
            read_archive(tmp_path / name)


def test_a_run_without_a_log_has_no_curve(tiny_run, tmp_path):
    shutil.copytree(tiny_run.path, tmp_path / "run")
    shutil.rmtree(tmp_path / "run" / "tensorboard")
    write_archive(find_runs(tmp_path), tmp_path, tmp_path / "study.zip")
    assert read_archive(tmp_path / "study.zip").curves.empty
    assert isinstance(read_archive(tmp_path / "study.zip").samples, pd.DataFrame)
