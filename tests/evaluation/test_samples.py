from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn
from torch.nn.functional import avg_pool2d, normalize

from ffd_lightning.evaluation.protocols import Measure
from ffd_lightning.evaluation.samples import Sample, encode, predict, score_sample
from ffd_lightning.evaluation.shapes import PreparedShape
from ffd_lightning.nn.encoders.base import ImageEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork


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
def test_features_are_of_images_as_the_network_sees_them(prepared, shrink):
    size = prepared.image_shape[1] // shrink, prepared.image_shape[2] // shrink
    network = TemplateFfdNetwork(OfOneSize(size), (48, 64), 2, 8, shrink=shrink)
    nn.init.normal_(network.heads.logits.weight)
    shown = [Sample(0), Sample(3)]
    found, features = predict(network, prepared, shown), encode(network, prepared, shown)
    images = np.stack([prepared.image(row)[..., :3].transpose(2, 0, 1) for row in (0, 3)])
    seen = avg_pool2d(torch.from_numpy(images).double(), shrink).flatten(1)
    expected = normalize(seen - seen.mean(1, keepdim=True), dim=1)
    torch.testing.assert_close(features.double(), expected, atol=1e-5, rtol=0)
    with torch.no_grad():
        outputs = network(torch.from_numpy(images))
    np.testing.assert_allclose(found.weights, outputs.template_weights, atol=1e-6)
    np.testing.assert_allclose(found.offsets, outputs.offsets, atol=1e-6)
