"""Bernstein polynomials, the basis of free-form deformation."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor


def bernstein_basis(t: Float[Tensor, "*batch"], degree: int) -> Float[Tensor, "*batch {degree+1}"]:
    r"""Evaluate all Bernstein polynomials of one degree.

    $$ B_{i,n}(t) = \binom{n}{i} t^i (1 - t)^{n - i}, \quad 0 \le i \le n $$

    Built up by degree, $B_{i,n} = (1 - t) B_{i,n-1} + t B_{i-1,n-1}$, which stays smooth
    at t = 0 and t = 1 (powers would differentiate to 0 * inf there).

    Args:
        t: parameter values, in [0, 1] inside the box; polynomials, so defined outside too.
        degree: polynomial degree n, 0 or more.

    Returns:
        Values with the index i as last axis; they sum to 1.

    Raises:
        ValueError: negative degree.

    Source: Sederberg and Parry 1986, eq. 2.

    >>> bernstein_basis(torch.tensor(0.5), 2)
    tensor([0.2500, 0.5000, 0.2500])
    """
    if degree < 0:
        raise ValueError(f"degree must be 0 or more, got {degree}")
    basis = [torch.ones_like(t)]
    for _ in range(degree):
        left = [(1 - t) * b for b in basis] + [torch.zeros_like(t)]
        right = [torch.zeros_like(t)] + [t * b for b in basis]
        basis = [a + b for a, b in zip(left, right, strict=True)]
    return torch.stack(basis, dim=-1)
