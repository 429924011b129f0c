"""How evenly templates are used."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike


def selection_entropy(counts: ArrayLike) -> float:
    """Return the entropy, in nats, of how often each template was selected.

    Args:
        counts: selections (or weights) per template, (T,), not negative.

    Raises:
        ValueError: nothing selected, or negative counts.

    >>> round(selection_entropy([5, 5, 0]), 4)
    0.6931
    """
    counts = np.asarray(counts, float)
    if (counts < 0).any() or not counts.sum() > 0:
        raise ValueError("counts must not be negative and must not all be zero")
    share = counts[counts > 0] / counts.sum()
    return float(max(0.0, -(share * np.log(share)).sum()))


def effective_templates(counts: ArrayLike) -> float:
    """Return the effective number of templates, exp(entropy): from 1 to T.

    >>> round(effective_templates([5, 5, 0]), 6)
    2.0
    """
    return float(np.exp(selection_entropy(counts)))
