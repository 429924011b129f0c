import pytest
import torch
from torch import nn

from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.network import TemplateHeads


def test_table_1_sizes():
    heads = TemplateHeads(256, (6, 8), num_templates=30, num_control_points=64)
    features = torch.randn(2, 256, 6, 8)
    assert heads.bottleneck(features).shape == (2, 64, 6, 8)
    dense = next(m for m in heads.shared if isinstance(m, nn.Linear))
    assert (dense.in_features, dense.out_features) == (3072, 512)
    per_template = (heads.offsets.out_features + heads.logits.out_features) / 30
    assert per_template == 192 + 1
    logits, offsets = heads(features)
    assert logits.shape == (2, 30)
    assert offsets.shape == (2, 30, 64, 3)


def test_offsets_are_laid_out_template_by_template():
    heads = TemplateHeads(4, (1, 1), num_templates=3, num_control_points=8, hidden=16)
    nn.init.zeros_(heads.offsets.weight)
    with torch.no_grad():
        heads.offsets.bias.copy_(torch.arange(72))
    _, offsets = heads(torch.randn(2, 4, 1, 1))
    # Template 2, control point 5, axis 1 is output 2 * 24 + 5 * 3 + 1.
    assert offsets[:, 2, 5, 1].tolist() == [64.0, 64.0]


def test_first_offsets_are_tiny_and_follow_offset_std():
    torch.manual_seed(0)
    heads = TemplateHeads(16, (2, 2), 4, 64, offset_std=1e-4)
    assert float(heads.offsets.weight.std().detach()) == pytest.approx(1e-4, rel=0.02)
    assert not heads.offsets.bias.any()
    _, offsets = heads(torch.randn(8, 16, 2, 2))
    # Hidden values lie in [0, 6], so the deviation of a sum over 512 is below 6 sqrt(512) 1e-4.
    assert 0 < offsets.std() < 6 * 512**0.5 * 1e-4


def test_training_on_one_image_says_what_to_do():
    heads = TemplateHeads(8, (2, 2), 2, 8, hidden=4)
    with pytest.raises(ConfigError, match=r"schedule.batch_size=2"):
        heads(torch.randn(1, 8, 2, 2))
    logits, _ = heads.eval()(torch.randn(1, 8, 2, 2))
    assert logits.shape == (1, 2)
