import numpy as np
import pytest
import torch
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from ffd_lightning.metrics.chamfer import chamfer, chamfer_l1


def naive(pred, target, power):
    """Oracle: all distances."""
    distances = cdist(pred, target) ** power
    return distances.min(axis=1).mean() + distances.min(axis=0).mean()


def pair(num_pred=90, num_target=140, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(num_pred, 3)), rng.normal(size=(num_target, 3))


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("sizes", [(1, 1), (1, 50), (90, 140), (300, 20), (64, 64)])
def test_equals_all_distances(sizes, power):
    pred, target = pair(*sizes)
    assert chamfer(pred, target, power) == pytest.approx(naive(pred, target, power), rel=1e-13)
    assert chamfer_l1(pred, target) == pytest.approx(naive(pred, target, 1) / 2, rel=1e-13)


def test_equals_a_tree_on_large_clouds():
    pred, target = pair(17_000, 20_000)
    forth, back = cKDTree(target).query(pred)[0], cKDTree(pred).query(target)[0]
    assert chamfer(pred, target) == pytest.approx(np.mean(forth**2) + np.mean(back**2), rel=1e-13)


def test_known_shapes():
    line = np.arange(10.0)[:, None] * [1, 0, 0]
    assert chamfer(line, line + [0, 0.5, 0]) == pytest.approx(0.5)
    assert chamfer(line, line + [0, 0.5, 0], power=1) == pytest.approx(1)
    assert chamfer_l1(line, line + [0, 0.5, 0]) == pytest.approx(0.5)
    # 4 of the target lie within 0.25 of it, a fifth at 10.
    assert chamfer([[0.0, 0, 0]], [[0.25, 0, 0]] * 4 + [[10, 0, 0]]) == pytest.approx(
        0.25**2 + (4 * 0.25**2 + 100) / 5
    )
    assert chamfer(line, line[::-1].copy()) == 0


def test_symmetric_and_scales_with_its_power():
    pred, target = pair()
    assert chamfer(pred, target) == chamfer(target, pred)
    assert chamfer(pred * 4, target * 4) == 16 * chamfer(pred, target)
    assert chamfer(pred * 4, target * 4, power=1) == 4 * chamfer(pred, target, power=1)


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("num", [777, 1024])
def test_independent_of_the_batch(num, dtype, power):
    generator = torch.Generator().manual_seed(0)
    pred, target = torch.randn(2, 9, num, 3, generator=generator).to(dtype)
    together = chamfer(pred, target, power)
    for size in (1, 2, 4):
        parts = [chamfer(*c, power) for c in zip(pred.split(size), target.split(size), strict=True)]
        assert torch.equal(torch.cat(parts), together)
    assert torch.equal(chamfer(pred[3], target[3], power), together[3])


def test_independent_of_the_batch_with_long_rows():
    """torch's own mean of 40,000 values depends on whether there is one row or several."""
    generator = torch.Generator().manual_seed(0)
    # float64: sums of float32 values are free of rounding here
    pred = torch.rand(12, 40_000, 3, generator=generator, dtype=torch.float64)
    target = pred[:1, :8]
    together = chamfer(pred, target)
    assert torch.equal(torch.stack([chamfer(p, target[0]) for p in pred]), together)


def test_batches_broadcast():
    rng = np.random.default_rng(1)
    pred, target = rng.random((2, 1, 30, 3)), rng.random((3, 50, 3))
    found = chamfer(pred, target)
    assert found.shape == (2, 3)
    assert found == pytest.approx(np.array([[naive(p[0], t, 2) for t in target] for p in pred]))


@pytest.mark.parametrize(
    ("dtype", "tolerance"),
    [(torch.float64, 1e-13), (torch.float32, 1e-6), (torch.bfloat16, 1e-6)],
)
def test_tensors_give_tensors(dtype, tolerance):
    pred, target = (torch.tensor(x).to(dtype).requires_grad_() for x in pair())
    found = chamfer(pred, target)
    oracle = naive(pred.detach().double().numpy(), target.detach().double().numpy(), 2)
    assert found.dtype == torch.float64
    assert found.shape == ()
    assert not found.requires_grad
    assert found.item() == pytest.approx(oracle, rel=tolerance)
    mixed = chamfer(pred, target.detach().double().numpy())
    assert isinstance(mixed, torch.Tensor)
    assert mixed.item() == pytest.approx(oracle, rel=1e-13)


@pytest.mark.parametrize(
    ("pred", "target", "message"),
    [
        (np.zeros((0, 3)), np.zeros((4, 3)), "pred_points holds no points"),
        (np.zeros((4, 3)), np.zeros((4, 2)), "target_points must be"),
        (np.zeros(3), np.zeros((4, 3)), "pred_points must be"),
        (np.zeros((4, 3)), np.full((4, 3), np.inf), "target_points holds values"),
        (np.zeros((2, 4, 3)), np.zeros((3, 4, 3)), "do not go together"),
        (np.zeros((0, 4, 3)), np.zeros((4, 3)), "no pair"),
        (np.zeros((4, 3)), np.full((4, 3), 1e200), "overflow"),
    ],
)
def test_refuses(pred, target, message):
    for function in (chamfer, chamfer_l1):
        with pytest.raises(ValueError, match=message):
            function(pred, target)


@pytest.mark.parametrize("power", [0, 3, "2", None])
def test_refuses_other_powers(power):
    with pytest.raises(ValueError, match="power"):
        chamfer(*pair(), power)
