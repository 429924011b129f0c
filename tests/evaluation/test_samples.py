from dataclasses import replace

import numpy as np

from ffd_lightning.evaluation.protocols import Measure
from ffd_lightning.evaluation.samples import score_sample
from ffd_lightning.evaluation.shapes import PreparedShape


class Mean:
    """A protocol that tells shapes apart."""

    name, note, needs_parts = "mean", "", False
    measures = (Measure("mean", ""),)

    def truth(self, shape, rng):
        return None

    def score(self, shape, truth, rng):
        return {"mean": float(shape.prepared.cloud(shape.row).mean())}


def test_shapes_of_one_row_of_two_sets_are_two(prepared):
    """As where a network is evaluated on a set that is not the one of its training."""
    other = replace(prepared, taken=tuple(range(len(prepared)))[::-1])
    shapes = {"floor": PreparedShape(prepared, 4), "retrieval": PreparedShape(other, 4)}
    scores = score_sample(Mean(), prepared, 4, shapes, 0)
    expected = [np.float32(x.cloud(4).mean()) for x in (prepared, other)]
    assert [scores["floor_mean"], scores["retrieval_mean"]] == expected
    assert expected[0] != expected[1]
