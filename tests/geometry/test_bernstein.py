import math

import numpy as np
import pytest
import torch

from ffd_lightning.geometry.bernstein import bernstein_basis


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5, 9])
def test_matches_the_closed_form(degree):
    t = torch.linspace(0, 1, 23, dtype=torch.float64)
    closed = np.stack(
        [
            math.comb(degree, i) * t.numpy() ** i * (1 - t.numpy()) ** (degree - i)
            for i in range(degree + 1)
        ],
        axis=-1,
    )
    np.testing.assert_allclose(bernstein_basis(t, degree).numpy(), closed, atol=1e-14)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_partition_of_unity_and_linear_precision(dtype):
    t = torch.rand(4, 5, dtype=dtype, generator=torch.Generator().manual_seed(0))
    basis = bernstein_basis(t, 4)
    assert basis.shape == (4, 5, 5)
    assert basis.dtype == dtype
    torch.testing.assert_close(basis.sum(-1), torch.ones_like(t))
    torch.testing.assert_close(basis @ torch.linspace(0, 1, 5, dtype=dtype), t)


def test_gradients_are_right_at_the_ends_too():
    t = torch.tensor([0.0, 0.3, 1.0], dtype=torch.float64, requires_grad=True)
    assert torch.autograd.gradcheck(lambda x: bernstein_basis(x, 3), (t,))
    assert torch.autograd.gradgradcheck(lambda x: bernstein_basis(x, 3), (t,))


def test_refuses_negative_degrees():
    with pytest.raises(ValueError, match="degree"):
        bernstein_basis(torch.zeros(2), -1)
