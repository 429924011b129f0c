"""That the benchmarks run and hide nothing; how fast anything is, is not tested."""

import logging

import torch

from benchmarks import nearest, training_step

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


def test_a_training_step_and_its_parts_are_timed(monkeypatch):
    for name, value in (*SMALL, ("_MODELS", 12)):
        monkeypatch.setattr(training_step, name, value)
    logger = logging.getLogger("lightning.pytorch")
    monkeypatch.setattr(logger, "setLevel", lambda _: None)  # for other tests
    rows = {row.name: row for row in training_step.measure(CPU, quick=True)}
    assert {"full step", "full step, trainer.residency=device", "part: batch"} <= set(rows)
    assert all(row.seconds > 0 for row in rows.values())
