"""That the benchmarks run and hide nothing; how fast anything is, is not tested."""

import logging

import pytest
import torch

from benchmarks import nearest, training_step
from benchmarks.timing import compete

CPU = torch.device("cpu")
SMALL = (("QUERIES", 4), ("TEMPLATES", 2), ("POINTS", 64))


def test_peers_are_timed_and_one_that_fails_is_named(monkeypatch):
    def fails(a, b):
        raise RuntimeError("no\ncompiler")

    peers = {"torch.cdist": nearest._cdist, "scipy": nearest._scipy, "broken": fails}
    monkeypatch.setattr(nearest, "peers", lambda device: peers)
    for name, value in SMALL:
        monkeypatch.setattr(nearest, name, value)
    rows = {row.name: row for row in nearest.measure(CPU, quick=True)}
    assert rows["ffd_lightning numba"].ratio == 1
    assert rows["torch.cdist"].ratio > 0
    assert rows["scipy"].ratio > 0
    assert rows["broken"].note == "failed: RuntimeError: no compiler"
    assert rows["backward"].seconds > 0


def test_a_peer_that_finds_other_neighbours_is_no_peer():
    a, b = nearest.clouds(1, 2, 50, CPU, torch.float32)
    index = torch.zeros(2, 50, dtype=torch.int64)
    with pytest.raises(AssertionError, match="liar finds other neighbours"):
        nearest.check("liar", lambda *_: (index, index), a, b)


def test_candidates_that_do_a_part_are_scaled():
    _, part = compete("x", {"all": (lambda: None, 1), "part": (lambda: None, 1e-6)}, 2)
    assert part.ratio > 1
    assert "of the work" in part.note


def test_a_training_step_and_its_parts_are_timed(monkeypatch):
    for name, value in (*SMALL, ("_MODELS", 12)):
        monkeypatch.setattr(training_step, name, value)
    logger = logging.getLogger("lightning.pytorch")
    monkeypatch.setattr(logger, "setLevel", lambda _: None)  # for other tests
    rows = {row.name: row for row in training_step.measure(CPU, quick=True)}
    assert {"full step", "full step, trainer.residency=device", "part: batch"} <= set(rows)
    assert all(row.seconds > 0 for row in rows.values())
