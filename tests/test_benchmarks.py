"""That the benchmarks run and hide nothing; how fast anything is, is not tested."""

import logging

import torch

from benchmarks import training_step


def test_a_training_step_and_its_parts_are_timed(monkeypatch):
    for name, value in {"QUERIES": 4, "TEMPLATES": 2, "POINTS": 64, "_MODELS": 12}.items():
        monkeypatch.setattr(training_step, name, value)
    logger = logging.getLogger("lightning.pytorch")
    monkeypatch.setattr(logger, "setLevel", lambda _: None)  # for other tests
    rows = {row.name: row for row in training_step.measure(torch.device("cpu"), quick=True)}
    assert {"full step", "full step, trainer.residency=device", "part: batch"} <= set(rows)
    assert all(row.seconds > 0 for row in rows.values())
