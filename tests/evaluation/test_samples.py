import numpy as np
import pytest
import torch
from torch import nn
from torch.nn.functional import avg_pool2d, normalize

from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.candidates import PreparedShape
from ffd_lightning.evaluation.protocols import Metric, Protocol
from ffd_lightning.evaluation.samples import Sample, predict, score_sample
from ffd_lightning.nn.encoders.base import ImageEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork


class Mean(Protocol):
    """A protocol that tells shapes apart."""

    metrics, name = (Metric("mean", ""),), "mean"

    def truth(self, shape, rng):
        return None

    def score(self, candidate, truth, rng):
        return {"mean": candidate.prepared.cloud(candidate.row).mean()}


@pytest.mark.parametrize("given", [{}, 3.0, {"mean": "much"}, {"mean": np.nan}])
def test_scores_that_are_no_numbers_are_said(prepared, monkeypatch, given):
    monkeypatch.setattr(Mean, "score", lambda *_: given)
    with pytest.raises(ConfigError, match="'mean': its score must give a finite number"):
        score_sample(Mean(), prepared, 0, {"": PreparedShape(prepared, 0)}, 0)


class OfOneSize(ImageEncoder):
    """An encoder that is built for one size of images, as a ViT is."""

    def __init__(self, size):
        super().__init__()
        self.out_channels, self.size = 3 * size[0] * size[1], size

    def output_size(self, image_size):
        return 1, 1

    def forward(self, images):
        assert images.shape[2:] == self.size
        return images.reshape(len(images), -1, 1, 1)


@pytest.mark.parametrize("shrink", [1, 2])
def test_outputs_are_of_images_as_the_network_sees_them(prepared, shrink):
    size = prepared.image_shape[1] // shrink, prepared.image_shape[2] // shrink
    network = TemplateFfdNetwork(OfOneSize(size), (48, 64), 2, 8, shrink=shrink)
    nn.init.normal_(network.heads.logits.weight)
    samples = [Sample(0), Sample(3)]
    found = predict(network, prepared, samples, workers=2)
    images = np.stack([prepared.image(row)[..., :3].transpose(2, 0, 1) for row in (0, 3)])
    seen = avg_pool2d(torch.from_numpy(images).double(), shrink).flatten(1)
    expected = normalize(seen - seen.mean(1, keepdim=True), dim=1)
    torch.testing.assert_close(
        torch.from_numpy(found.features).double(), expected, atol=1e-5, rtol=0
    )
    with torch.no_grad():
        outputs = network(torch.from_numpy(images))
    np.testing.assert_allclose(found.weights, outputs.template_weights, atol=1e-5)
    np.testing.assert_allclose(found.offsets, outputs.offsets, atol=1e-5)
    alone = predict(network, prepared, samples[1:])
    np.testing.assert_array_equal(alone.offsets[0], found.offsets[1], "whatever its company")
