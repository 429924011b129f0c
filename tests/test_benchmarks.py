"""That the benchmarks run and hide nothing; how fast anything is, is not tested."""

import json
import logging

import pandas as pd
import pytest
import torch
from conftest import TINY

from benchmarks import nearest, quality, training_step
from benchmarks.timing import compete
from ffd_lightning.app.checks import validate

CPU = torch.device("cpu")


def test_a_peer_that_fails_or_is_missing_is_named(monkeypatch):
    def fails(a, b):
        raise RuntimeError("no\ncompiler")

    def peers(device):
        return {"torch.cdist": nearest._cdist, "broken": fails}, {"gone": "ModuleNotFoundError"}

    monkeypatch.setattr(nearest, "peers", peers)
    for name, value in (("QUERIES", 4), ("TEMPLATES", 2), ("POINTS", 64)):
        monkeypatch.setattr(nearest, name, value)
    rows = {row.name: row for row in nearest.measure(CPU, quick=True)}
    assert rows["ffd_lightning numba"].ratio == 1
    assert rows["torch.cdist"].ratio > 0
    assert rows["broken"].note == "failed: RuntimeError: no compiler"
    assert rows["gone"].note == "absent: ModuleNotFoundError"
    assert rows["floor"].seconds > 0
    assert rows["backward"].seconds > 0


def test_a_peer_that_finds_other_neighbours_is_no_peer():
    a, b = nearest.clouds(1, 2, 50, CPU, torch.float32)
    index = torch.zeros(2, 50, dtype=torch.int64)
    with pytest.raises(AssertionError, match="liar finds other neighbours"):
        nearest._check({"liar": lambda *_: (index, index)}, a, b)


def test_peers_find_the_neighbours():
    a, b = nearest.clouds(1, 2, 50, CPU, torch.float32)
    found, missing = nearest.peers(CPU)
    always = ("torch.cdist", "torch, matrix form", "scipy cKDTree, threads")
    nearest._check({name: found[name] for name in always}, a, b)
    assert {"pytorch3d", "pykdtree", "faiss IndexFlatL2", "KeOps"} <= set(found) | set(missing)


def test_candidates_that_do_a_part_are_scaled():
    rows = compete("x", "all", {"all": lambda: None, "part": lambda: None}, 2, {"part": 1e-6})
    part = next(row for row in rows if row.name == "part")
    assert part.ratio > 1
    assert "of the work" in part.note


def test_a_training_step_and_its_parts_are_timed(monkeypatch):
    for name, value in (("QUERIES", 4), ("TEMPLATES", 2), ("POINTS", 64), ("_MODELS", 12)):
        monkeypatch.setattr(training_step, name, value)
    logger = logging.getLogger("lightning.pytorch")
    monkeypatch.setattr(logger, "setLevel", lambda _: None)  # for other tests
    rows = {row.name: row for row in training_step.measure(CPU, quick=True)}
    assert {"full step", "full step, trainer.residency=device", "part: batch"} <= set(rows)
    assert all(row.seconds > 0 for row in rows.values())


def test_every_recipe_is_a_valid_training(tiny_config):
    recipes = quality.read_recipes()
    assert next(iter(recipes)) == "b", "what the others are held against"
    for overrides in recipes.values():
        validate(tiny_config("data.num_points=1024", *overrides))


def test_other_settings_or_lengths_are_other_runs(tmp_path):
    recipes = {"b": ["regime=b"], "P, one cycle": ["regime=posterior"]}
    found = quality.trials(recipes, ["category=car"], [20, 10], [0, 1], tmp_path)
    assert [(t.asked, t.seed, t.recipe) for t in found[:3]] == [
        (10, 0, "b"),
        (10, 0, "P, one cycle"),
        (10, 1, "b"),
    ]
    others = quality.trials(recipes, [], [20, 10], [0, 1], tmp_path)
    folders = {str(trial.folder.path) for trial in (*found, *others)}
    assert len(folders) == 16
    again = quality.trials(recipes, [], [10], [0, 1], tmp_path)
    assert [t.folder for t in again] == [t.folder for t in others[:4]], "resumed"


def test_recipes_become_points(tiny_config, data_root, tmp_path, monkeypatch, capfd):
    recipes = {"b": ["regime=b"], "broken": ["regime=none_of_them"]}
    timed = quality._seconds_per_step
    monkeypatch.setattr(quality, "_seconds_per_step", lambda trial: timed(trial) and 0.5)
    settings = [*TINY, f"paths.data={data_root}", "split.val_fraction=0.2"]
    rows, files = quality.measure(recipes, settings, [2], [0], tmp_path)
    assert [row.note.split(":")[0] for row in rows][1] == "failed"
    assert "none_of_them" in capfd.readouterr().err
    (point,) = pd.read_csv(tmp_path / "quality.csv").to_dict("records")
    assert (point["recipe"], point["steps"], point["category"]) == ("b", 4, "table")
    assert point["seconds"] == pytest.approx(4 * point["seconds_per_step"])
    assert point["seconds"] > 0
    run = quality.trials(recipes, settings, [2], [0], tmp_path / "quality")[0].folder
    results = run.evaluation("paper")
    assert not (results / "samples.csv").exists(), "test shapes are not looked at"
    summary = json.loads((run.evaluation("paper", "val") / "summary.json").read_text())
    assert [point[name] for name in ("chamfer", "emd", "iou")] == pytest.approx(
        [summary[name] for name in ("chamfer", "emd", "iou")]
    )
    assert all(file.stat().st_size > 0 for file in files)

    monkeypatch.setattr(quality.subprocess, "run", None)
    assert quality.measure({"b": recipes["b"]}, settings, [2], [0], tmp_path)[0] == rows[:1]
