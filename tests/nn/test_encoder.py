import math

import numpy as np
import pytest
import torch
from torch.nn import functional

from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.mobilenet import EndPadConv2d, MobileNetV1, SamePadConv2d


@pytest.mark.parametrize("size", [(97, 130), (31, 64), (33, 95)])
def test_output_size_is_that_of_the_feature_map(size):
    encoder = MobileNetV1(0.25, batch_norm_momentum=1.0)
    features = encoder(torch.randn(2, 3, *size))
    assert features.shape == (2, encoder.out_channels, *encoder.output_size(size))
    momenta = {m.momentum for m in encoder.modules() if isinstance(m, torch.nn.BatchNorm2d)}
    assert momenta == {1.0}


def test_table_1_and_howard_et_al_sizes():
    encoder = MobileNetV1(0.25)
    assert encoder.out_channels == 256
    assert encoder.output_size((192, 256)) == (6, 8)
    # Howard et al.: 4.2 million parameters at width 1, of which 1.025 million in the dense top;
    # Keras counts 3,228,864 without it, moving statistics (2 per channel) included.
    full = MobileNetV1(1.0)
    moving = sum(buffer.numel() for name, buffer in full.named_buffers() if "running" in name)
    assert sum(p.numel() for p in full.parameters()) + moving == 3_228_864


@pytest.mark.parametrize(
    ("layer", "size"),
    [(SamePadConv2d, 6), (SamePadConv2d, 7), (EndPadConv2d, 6), (EndPadConv2d, 7)],
)
def test_padding_against_a_loop_over_windows(layer, size):
    conv = layer(1, 1, 3, stride=2, bias=False)
    image = torch.randn(1, 1, size, size)
    outputs = math.ceil(size / 2) if layer is SamePadConv2d else size // 2
    # TensorFlow: all the padding that the last window needs, the smaller half in front.
    before = max(2 * (outputs - 1) + 3 - size, 0) // 2 if layer is SamePadConv2d else 0
    padded = functional.pad(image, (before, 4, before, 4))
    expected = torch.zeros(outputs, outputs)
    for i, j in np.ndindex(outputs, outputs):
        expected[i, j] = (padded[0, 0, 2 * i : 2 * i + 3, 2 * j : 2 * j + 3] * conv.weight).sum()
    torch.testing.assert_close(conv(image)[0, 0], expected)


def test_weights_start_in_glorot_uniform_bounds():
    torch.manual_seed(0)
    encoder = MobileNetV1(1.0)
    for name, fan_in, fan_out in (("conv1", 27, 288), ("conv_pw_13", 1024, 1024)):
        weight = encoder.layers.get_submodule(name).weight.detach()
        bound = math.sqrt(6 / (fan_in + fan_out))
        assert weight.abs().max() <= bound
        assert float(weight.std()) == pytest.approx(bound / math.sqrt(3), rel=0.1)
    # Keras counts 9 c inputs and 9 outputs for a depthwise kernel of c channels.
    weight = encoder.layers.get_submodule("conv_dw_13").weight
    assert 0.95 < weight.abs().max() / math.sqrt(6 / (9 * 1024 + 9)) <= 1


def test_impossible_settings_say_so():
    with pytest.raises(ValueError, match=r"width=0.01"):
        MobileNetV1(0.01)
    with pytest.raises(ConfigError, match="20x300 pixels are too small"):
        MobileNetV1().output_size((20, 300))
