"""The CUDA backend: on a GPU where there is one, else in Triton's interpreter, on the CPU.

The interpreter has to be chosen before triton is imported, so `test_in_the_interpreter` runs this
file again in a process of its own.
"""

import os
import re
import subprocess
import sys

import pytest
import torch

from ffd_lightning.geometry.nearest import torch_backend

triton = pytest.importorskip("triton")

INTERPRETED = os.environ.get("TRITON_INTERPRET") == "1"
DEVICE = "cuda" if torch.cuda.is_available() and not INTERPRETED else "cpu"
runs = pytest.mark.skipif(DEVICE == "cpu" and not INTERPRETED, reason="needs a GPU or interpreter")


@pytest.fixture
def backend():
    from ffd_lightning.geometry.nearest import triton_backend

    return triton_backend


def clouds(*shape, seed=0):
    return torch.randn(*shape, 3, generator=torch.Generator().manual_seed(seed)).to(DEVICE)


def pairs(a, b, count):
    """Indices that share clouds where count exceeds their number."""
    numbers = torch.arange(count, device=DEVICE)
    return numbers * len(a) // count, numbers % len(b)


def check(backend, a, b, count):
    """Compare with the oracle; where neighbours are equally near, either index will do."""
    index_a, index_b = pairs(a, b, count)
    result = backend.search(a, b, index_a, index_b)
    expected = torch_backend.search(a, b, index_a, index_b)
    for got, want in zip(result, expected, strict=True):
        assert got.dtype == want.dtype
        assert got.shape == want.shape
    pair_a, pair_b = a[index_a], b[index_b]
    for at, points, others in ((0, pair_a, pair_b), (2, pair_b, pair_a)):
        torch.testing.assert_close(result[at], expected[at], rtol=1e-5, atol=0, equal_nan=True)
        named = others.gather(1, result[at + 1][..., None].expand(-1, -1, 3))
        found = result[at].isfinite()
        attained = (points - named).square().sum(-1)
        torch.testing.assert_close(attained[found], expected[at][found], rtol=1e-5, atol=0)
        assert (result[at + 1][~found] == 0).all()
    return result


@runs
@pytest.mark.parametrize(
    ("n", "m"), [(1, 1), (5, 3), (31, 1), (1, 70), (64, 64), (130, 67), (97, 2100)]
)
def test_agrees_with_torch(backend, n, m):
    check(backend, clouds(2, n, seed=1), clouds(3, m, seed=2), 3)


@runs
def test_points_that_are_not_finite(backend):
    a, b = clouds(2, 70), clouds(2, 40, seed=1)
    a[0, 3], a[0, 68, 1], a[1, 0, 2] = torch.nan, torch.inf, -torch.inf
    b[0, 39, 0], b[0, 7], b[1, 5] = torch.nan, torch.inf, -torch.inf
    check(backend, a, b, 2)
    b[:] = torch.nan
    d_ab, i_ab, d_ba, i_ba = check(backend, a, b, 2)
    assert d_ab[0, 0] == torch.inf
    assert d_ba.isnan().all()
    assert not i_ab.any()
    assert not i_ba.any()


@pytest.mark.skipif(INTERPRETED, reason="is in it")
def test_in_the_interpreter():
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
    environment |= {"TRITON_INTERPRET": "1", "CUDA_VISIBLE_DEVICES": ""}
    options = ("-p", "no:cacheprovider", "--noconftest")  # which loads what is not needed here
    command = [sys.executable, "-m", "pytest", *options, __file__]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if "only 0-dimensional arrays can be converted" in done.stdout:
        pytest.skip("the interpreter of triton before 3.9 does not know numpy 2.4")
    assert done.returncode == 0, done.stdout
    assert re.search(r"\b[1-9]\d* passed|^\.{5}", done.stdout, re.MULTILINE), done.stdout
