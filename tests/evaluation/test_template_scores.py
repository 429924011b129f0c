import numpy as np
import pytest
import torch

from ffd_lightning.data.batches import Batch
from ffd_lightning.evaluation.template_scores import TemplateScoring
from ffd_lightning.geometry.ffd import TemplateSample
from ffd_lightning.nn.network import FfdPrediction


def rand(*shape, seed=0):
    return torch.rand(*shape, generator=torch.Generator().manual_seed(seed))


def naive(a, b):
    squared = torch.cdist(a.double(), b.double()) ** 2
    return float(squared.min(1).values.mean() + squared.min(0).values.mean())


def test_the_selected_template_is_scored_on_every_query_in_the_order_of_the_rows():
    weights = torch.tensor([[0.2, 0.7, 0.1], [0.5, 0.3, 0.2]])
    prediction = FfdPrediction(weights, weights, rand(2, 3, 8, 3) - 0.5, weights.log())
    matrix, control = rand(3, 20, 8, seed=1).softmax(-1), rand(3, 8, 3, seed=2)
    templates = TemplateSample(matrix, control, (1, 1, 1))
    images = torch.zeros(2, 3, 32, 32, dtype=torch.uint8)
    batch = Batch(torch.tensor([4, 9]), images, rand(2, 20, 3, seed=3), templates)
    scoring = TemplateScoring()
    scoring.update(prediction, batch)
    scores = scoring.compute()
    for q, t in ((0, 1), (1, 0)):
        truth = batch.target_points[q]
        moved = matrix[t] @ (control[t] + prediction.offsets[q, t])
        assert scores.deformed[q] == pytest.approx(naive(moved, truth), rel=1e-4)
        assert scores.undeformed[q] == pytest.approx(naive(matrix[t] @ control[t], truth), rel=1e-4)
    assert scores.counts.tolist() == [1, 1, 0]
    summary = scores.summary()
    assert summary["box_chamfer"] == pytest.approx(1000 * scores.deformed.mean(), rel=1e-6)
    assert summary["effective_templates"] == pytest.approx(2)
    scoring.update(prediction, batch._replace(rows=batch.rows - 3))
    joined = scoring.compute()
    assert joined.rows.tolist() == [1, 4, 6, 9]
    np.testing.assert_array_equal(joined.deformed[[1, 3]], scores.deformed)
    np.testing.assert_array_equal(joined.weights[[0, 2]], scores.weights)
