"""How templates are selected: how evenly, how alike in two runs, how often of the right kind."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def selection_entropy(counts: ArrayLike) -> float:
    """Return the entropy, in nats, of how often each template was selected.

    Selections, or weights, are counts per template, (T,), not negative and not all zero.

    >>> round(selection_entropy([5, 5, 0]), 4)
    0.6931
    """
    counts = _checked(counts)
    share = counts[counts > 0] / counts.sum()
    return float(max(0.0, -(share * np.log(share)).sum()))


def effective_templates(counts: ArrayLike) -> float:
    """Return the effective number of templates, exp(entropy): from 1 to T.

    >>> round(effective_templates([5, 5, 0]), 6)
    2.0
    """
    return float(np.exp(selection_entropy(counts)))


def adjusted_rand(a: ArrayLike, b: ArrayLike) -> float:
    """Return how alike two runs group the same samples by the template they select.

    The adjusted Rand index. Of n samples, n_ij have template i in a and j in b, a_i and b_j are the
    sums over j and over i, and C2(x) = x (x - 1) / 2 counts pairs:

        (sum C2(n_ij) - expected) / ((sum C2(a_i) + sum C2(b_j)) / 2 - expected),
        expected = sum C2(a_i) sum C2(b_j) / C2(n)

    1 for the same groups, 0 on average for groups drawn at random with the same sizes, never below
    -0.5. Only the groups count, not the names: the templates of the two may be different ones. Two
    that put all samples into one group, or each into its own, have 1.

    Source: Hubert and Arabie, Comparing partitions, Journal of Classification 2 (1985).

    Either has a template (number or name) for each sample, (n,), at least two.

    >>> adjusted_rand(["desk", "desk", "bar", "bar"], [3, 3, 1, 1])
    1.0
    >>> adjusted_rand([0, 0, 1, 1], [0, 1, 0, 1])
    -0.5
    """
    rows, columns = _label_numbers(a, b)
    if len(rows) < 2:
        raise ValueError("two samples at least are needed to compare selections")
    cells = rows * (int(columns.max()) + 1) + columns
    both, first, second = (
        sum(x * (x - 1) // 2 for x in np.unique(groups, return_counts=True)[1].tolist())
        for groups in (cells, rows, columns)
    )
    pairs = len(rows) * (len(rows) - 1) // 2
    # Multiplied out into whole numbers, so that 0 / 0 is told from what is merely small.
    expected = 2 * first * second
    largest = (first + second) * pairs
    return 1.0 if largest == expected else (2 * both * pairs - expected) / (largest - expected)


def _label_numbers(a: ArrayLike, b: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return labels as numbers from 0, each (n,)."""
    first, second = np.asarray(a), np.asarray(b)
    if first.ndim != 1 or first.shape != second.shape or not len(first):
        raise ValueError(
            f"two labels of the same samples are needed, got {first.shape} and {second.shape}"
        )
    rows, columns = (np.unique(x, return_inverse=True)[1] for x in (first, second))
    return rows.astype(np.int64), columns.astype(np.int64)


def _checked(counts: ArrayLike) -> NDArray[np.float64]:
    values = np.asarray(counts, float)
    if not (values >= 0).all() or not values.sum() > 0:
        raise ValueError("counts must not be negative and must not all be zero")
    return values
