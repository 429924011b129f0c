"""That the benchmarks run and hide nothing; how fast anything is, is not tested."""

import logging

import pytest
import torch

from benchmarks import nearest, training_step
from benchmarks.timing import compete

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
    assert {"full step", "full step, data.residency=ram", "part: batch"} <= set(rows)
    assert all(row.seconds > 0 for row in rows.values())
