import numpy as np
import pytest
import torch
from scipy.spatial.distance import cdist

from ffd_lightning.geometry import nearest
from ffd_lightning.geometry.nearest import nearest_neighbors


def clouds(*shape, seed=0, dtype=torch.float64):
    return torch.randn(*shape, 3, dtype=dtype, generator=torch.Generator().manual_seed(seed))


@pytest.fixture(params=["numba", "torch"])
def backend(request, monkeypatch):
    monkeypatch.setattr(nearest, "_on_cpu", lambda _: request.param == "numba")
    monkeypatch.setattr(nearest, "_CHUNK_DISTANCES", 300)
    return request.param


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize(("n", "m"), [(1, 1), (5, 3), (64, 65), (130, 67), (3, 300)])
def test_exact_both_ways(backend, dtype, n, m):
    a, b = clouds(3, n, seed=1, dtype=dtype), clouds(3, m, seed=2, dtype=dtype)
    result = nearest_neighbors(a, b)
    for k in range(3):
        squared = cdist(a[k].numpy(), b[k].numpy(), "sqeuclidean")
        np.testing.assert_allclose(result.a_to_b[k], squared.min(1), rtol=1e-5)
        np.testing.assert_allclose(result.b_to_a[k], squared.min(0), rtol=1e-5)
        rows, columns = np.arange(n), np.arange(m)
        np.testing.assert_allclose(squared[rows, result.a_to_b_index[k]], squared.min(1), rtol=1e-5)
        np.testing.assert_allclose(
            squared[result.b_to_a_index[k], columns], squared.min(0), rtol=1e-5
        )


def test_shared_clouds_broadcast(backend):
    a, b = clouds(2, 4, 9), clouds(2, 1, 7, seed=1)
    result = nearest_neighbors(a, b)
    assert result.a_to_b.shape == (2, 4, 9)
    assert result.b_to_a.shape == (2, 4, 7)
    one = nearest_neighbors(a[1, 2], b[1, 0])
    torch.testing.assert_close(result.a_to_b[1, 2], one.a_to_b)
    torch.testing.assert_close(result.b_to_a_index[1, 2], one.b_to_a_index)


def test_gradients_reach_shared_clouds(backend):
    a, b = clouds(2, 2, 5).requires_grad_(), clouds(2, 1, 4, seed=1).requires_grad_()

    def f(a, b):
        result = nearest_neighbors(a, b)
        return (result.a_to_b * torch.arange(5)).sum(), result.b_to_a.square().sum()

    assert torch.autograd.gradcheck(f, (a, b))


def test_ties_and_duplicates_give_distance_zero(backend):
    a = clouds(6)
    result = nearest_neighbors(torch.cat([a, a]), a)
    assert (result.a_to_b == 0).all()
    assert (result.b_to_a == 0).all()


def test_repeats_to_the_last_bit():
    def run():
        a = clouds(8, 30, 50, dtype=torch.float32).requires_grad_()
        b = clouds(8, 1, 50, seed=1, dtype=torch.float32).requires_grad_()
        result = nearest_neighbors(a, b)
        (result.a_to_b.sum() + result.b_to_a.sum()).backward()
        return a.grad, b.grad

    for first, second in zip(run(), run(), strict=True):
        assert torch.equal(first, second)


@pytest.mark.parametrize(
    ("a", "b", "match"),
    [
        (torch.zeros(0, 3), torch.zeros(1, 3), "empty"),
        (torch.zeros(2, 2), torch.zeros(2, 2), "3 coordinates"),
        (torch.zeros(2, 3), torch.zeros(2, 3, dtype=torch.float64), "differ"),
    ],
)
def test_refuses(a, b, match):
    with pytest.raises(ValueError, match=match):
        nearest_neighbors(a, b)
