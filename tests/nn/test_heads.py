import torch
from torch import nn

from ffd_lightning.nn.heads import ConditionedHeads, TemplateHeads


def test_table_1_sizes():
    """Offsets are laid out template by template."""
    heads = TemplateHeads(256, (6, 8), num_templates=30, num_control_points=64)
    nn.init.zeros_(heads.offsets.weight)
    with torch.no_grad():
        heads.offsets.bias.copy_(torch.arange(30 * 192))
    features = torch.randn(2, 256, 6, 8)
    assert heads.bottleneck(features).shape == (2, 64, 6, 8)
    dense = next(m for m in heads.shared if isinstance(m, nn.Linear))
    assert (dense.in_features, dense.out_features) == (3072, 512)
    per_template = (heads.offsets.out_features + heads.logits.out_features) / 30
    assert per_template == 192 + 1
    logits, offsets = heads(heads.hidden(features))
    assert logits.shape == (2, 30)
    assert torch.equal(
        offsets, torch.arange(30.0 * 192).reshape(1, 30, 64, 3).expand(2, -1, -1, -1)
    )


def test_conditioned_heads_take_any_templates_in_any_order():
    torch.manual_seed(0)
    heads = ConditionedHeads(16, (2, 2), 8, hidden=32, offset_std=0.1, code=8).eval()
    images, pictures = torch.randn(3, 16, 2, 2), torch.randn(5, 16, 2, 2)
    clouds = torch.rand(5, 50, 3)
    hidden, codes = heads.hidden(images), heads.codes(clouds, heads.hidden(pictures))
    logits, offsets = heads(hidden, codes)
    assert (logits.shape, offsets.shape) == ((3, 5), (3, 5, 8, 3))
    assert min(logits.std(1).min(), offsets.std(1).min()) > 0, "templates are told apart"
    order = torch.tensor([3, 0])
    fewer = heads(hidden, codes[order])
    torch.testing.assert_close(fewer, (logits[:, order], offsets[:, order]))
    shuffled = heads.codes(clouds[:, torch.randperm(50)], heads.hidden(pictures))
    torch.testing.assert_close(shuffled, codes)
