import multiprocessing
import os
import subprocess
import sys

import numpy as np
import pytest
import torch
from scipy.spatial.distance import cdist

from ffd_lightning.geometry import nearest
from ffd_lightning.geometry.nearest import nearest_neighbors, torch_backend


def clouds(*shape, seed=0, dtype=torch.float64):
    return torch.randn(*shape, 3, dtype=dtype, generator=torch.Generator().manual_seed(seed))


@pytest.fixture(params=["numba", "torch"])
def backend(request, monkeypatch):
    monkeypatch.setattr(torch_backend, "_CHUNK_DISTANCES", 300)
    return request.param


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize(("n", "m"), [(1, 1), (5, 3), (64, 65), (130, 67), (3, 300), (1030, 9)])
def test_exact_both_ways(backend, dtype, n, m):
    a, b = clouds(3, n, seed=1, dtype=dtype), clouds(3, m, seed=2, dtype=dtype)
    result = nearest_neighbors(a, b, backend)
    for k in range(3):
        squared = cdist(a[k].numpy(), b[k].numpy(), "sqeuclidean")
        np.testing.assert_allclose(result.a_to_b[k], squared.min(1), rtol=1e-5)
        np.testing.assert_allclose(result.b_to_a[k], squared.min(0), rtol=1e-5)
        rows, columns = np.arange(n), np.arange(m)
        np.testing.assert_allclose(squared[rows, result.a_to_b_index[k]], squared.min(1), rtol=1e-5)
        np.testing.assert_allclose(
            squared[result.b_to_a_index[k], columns], squared.min(0), rtol=1e-5
        )


def test_shared_clouds_broadcast_and_have_gradients(backend):
    a, b = clouds(2, 3, 5).requires_grad_(), clouds(2, 1, 4, seed=1).requires_grad_()
    result, one = nearest_neighbors(a, b, backend), nearest_neighbors(a[1, 2], b[1, 0], backend)
    for name, values in one._asdict().items():
        torch.testing.assert_close(getattr(result, name)[1, 2], values)

    def f(a, b):
        result = nearest_neighbors(a, b, backend)
        return (result.a_to_b * torch.arange(5)).sum(), result.b_to_a.square().sum()

    assert torch.autograd.gradcheck(f, (a, b))
    with pytest.raises(NotImplementedError, match="no second derivatives"):
        torch.autograd.functional.hessian(
            lambda x: nearest_neighbors(x, b, backend).a_to_b.sum(), a
        )


@pytest.mark.parametrize("bad", [torch.nan, torch.inf, -torch.inf])
def test_points_that_are_not_finite_are_nobodys_neighbour(backend, bad):
    a, b = clouds(2, 20), clouds(2, 20, seed=1)
    a[0, 3, 1] = bad
    b[:, 0, 2] = bad
    b[1] = bad
    result = nearest_neighbors(a, b, backend)
    squared = cdist(a[0, :3].numpy(), b[0, 1:].numpy(), "sqeuclidean")
    np.testing.assert_allclose(result.a_to_b[0, :3], squared.min(1))
    np.testing.assert_array_equal(result.a_to_b_index[0, :3], squared.argmin(1) + 1)
    assert result.a_to_b[0, 3].isnan()
    assert result.b_to_a[0, 0].isnan()
    assert not (result.b_to_a_index[0] == 3).any()
    a[1] = 1e300  # squares overflow
    for far in (result, nearest_neighbors(a, -a, backend)):
        assert far.a_to_b[1].isinf().all()
        assert (far.a_to_b_index[1] == 0).all()


def test_backend_is_chosen_by_device_and_dtype(monkeypatch):
    half = torch.rand(5, 3, dtype=torch.float16)
    assert nearest_neighbors(half, half).a_to_b.dtype == torch.float16, "in plain torch"
    cpu, cuda = torch.device("cpu"), torch.device("cuda")
    assert nearest.usable_backends(cpu, torch.float64) == ["numba", "torch"]
    monkeypatch.setattr(nearest, "_triton_works", lambda _: True)
    assert nearest.usable_backends(cuda, torch.float32) == ["triton", "torch"]
    assert nearest.usable_backends(cuda, torch.float64) == ["torch"]
    monkeypatch.setattr(nearest, "_triton_works", lambda _: False)
    assert nearest.usable_backends(cuda, torch.float32) == ["torch"]


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_forked_process_has_threads_of_its_own():
    torch.set_num_threads(2)
    a, b = clouds(4, 10), clouds(4, 10, seed=1)
    expected = nearest_neighbors(a, b)
    context = multiprocessing.get_context("fork")
    with context.Pool(1) as pool:
        result = pool.apply_async(nearest_neighbors, (a, b)).get(timeout=600)
    assert all(torch.equal(x, y) for x, y in zip(result, expected, strict=True))


def test_compiled_code_needs_no_place_on_disk(tmp_path):
    code = (
        "import numba.core.caching as c\n"
        "c.CacheImpl._locator_classes = []\n"
        "import torch; from ffd_lightning.geometry.nearest import nearest_neighbors as n\n"
        "print(n(torch.zeros(1, 3), torch.ones(1, 3)).a_to_b.item())"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.split() == ["3.0"], done.stderr
