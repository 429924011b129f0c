"""How templates are selected: how evenly, and how alike in two runs."""

import numpy as np
from numpy.typing import ArrayLike


def selection_entropy(counts: ArrayLike) -> float:
    """Return the entropy, in nats, of how often each template was selected.

    Selections, or weights, are counts per template, (T,), not negative and not all zero.

    >>> round(selection_entropy([5, 5, 0]), 4)
    0.6931
    """
    counts = np.asarray(counts, float)
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

    Either has a template (number or name) for each of n >= 2 samples, (n,). 1 for the same groups,
    0 on average for groups drawn at random with the same sizes, never below -0.5. Only the groups
    count, not the names: the templates of the two may be different ones. Else a ValueError.

    Source: Hubert and Arabie, Comparing partitions, Journal of Classification 2 (1985).

    >>> adjusted_rand(["desk", "desk", "bar", "bar"], [3, 3, 1, 1])
    1.0
    >>> adjusted_rand([0, 0, 1, 1], [0, 1, 0, 1])
    -0.5
    """
    if np.shape(a) != np.shape(b) or np.ndim(a) != 1:
        raise ValueError(f"the runs have {np.shape(a)} and {np.shape(b)} samples, not (n,) alike")
    rows, columns = (np.unique(x, return_inverse=True)[1] for x in (a, b))
    cells = rows * (columns.max() + 1) + columns
    both, first, second = (
        sum(x * (x - 1) // 2 for x in np.unique(groups, return_counts=True)[1].tolist())
        for groups in (cells, rows, columns)
    )
    pairs = len(rows) * (len(rows) - 1) // 2
    # Multiplied out into whole numbers, so that 0 / 0 is told from what is merely small.
    expected = 2 * first * second
    largest = (first + second) * pairs
    return 1.0 if largest == expected else (2 * both * pairs - expected) / (largest - expected)
