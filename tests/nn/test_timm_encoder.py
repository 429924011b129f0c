import pytest
import torch

from ffd_lightning.nn.encoders.timm import TimmEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork

SIZE = (64, 96)

try:
    import timm
except (ImportError, RuntimeError):  # RuntimeError: a torchvision built for another torch
    timm = None
pytestmark = pytest.mark.skipif(timm is None, reason="timm cannot be imported")


@pytest.mark.parametrize(
    ("name", "out_channels", "stride"),
    [("test_resnet", 96, 32), ("test_vit", 64, 16), ("test_efficientnet", 256, 32)],
)
def test_feature_maps_feed_the_network(name, out_channels, stride):
    encoder = TimmEncoder(name, SIZE)
    assert encoder.out_channels == out_channels
    assert encoder.output_size(SIZE) == (SIZE[0] // stride, SIZE[1] // stride)
    network = TemplateFfdNetwork(encoder, SIZE, 3, 8, hidden=16)
    prediction = network(torch.rand(2, 3, *SIZE))
    assert prediction.offsets.shape == (2, 3, 8, 3)
    prediction.template_logits.square().sum().backward()
    assert all(p.grad is not None for p in encoder.parameters())


def test_tokens_become_the_grid_of_their_patches():
    torch.manual_seed(0)
    encoder = TimmEncoder("test_vit", SIZE).eval()
    images = torch.randn(1, 3, *SIZE)
    tokens = encoder.model(images)[0, encoder.num_prefix_tokens :]
    features = encoder(images)[0]
    for row, column in ((0, 0), (1, 0), (2, 5), (3, 2)):
        torch.testing.assert_close(features[:, row, column], tokens[row * 6 + column])


def test_channels_last_models_are_turned_round():
    size = (64, 128)
    encoder = TimmEncoder("swin_tiny_patch4_window7_224", size).eval()
    images = torch.randn(1, 3, *size)
    with torch.no_grad():
        features, raw = encoder(images), encoder.model(images)
    assert features.shape == (1, encoder.out_channels, *encoder.output_size(size))
    assert encoder.output_size(size) == (2, 4)
    assert torch.equal(features[0, 7], raw[0, :, :, 7])
