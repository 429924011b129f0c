import torch

from ffd_lightning.nn.heads import ConditionedHeads


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
