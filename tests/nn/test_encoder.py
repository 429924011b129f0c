import pytest
import torch

from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1


@pytest.mark.parametrize("size", [(97, 130), (31, 64), (33, 95)])
def test_output_size_is_that_of_the_feature_map(size):
    encoder = MobileNetV1(0.25, batch_norm_momentum=1.0)
    features = encoder(torch.randn(2, 3, *size))
    assert features.shape == (2, encoder.out_channels, *encoder.output_size(size))
    momenta = {m.momentum for m in encoder.modules() if isinstance(m, torch.nn.BatchNorm2d)}
    assert momenta == {1.0}


def test_impossible_settings_say_so():
    with pytest.raises(ValueError, match=r"width=0.01"):
        MobileNetV1(0.01)
    with pytest.raises(ConfigError, match="20x300 pixels are too small"):
        MobileNetV1().output_size((20, 300))
