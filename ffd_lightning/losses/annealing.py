"""Terms that fade as training goes on."""

from __future__ import annotations

import math


def exponential_annealing(step: int, annealing_steps: float) -> float:
    r"""Return :math:`e^{-b / b_0}`, the factor of an annealed weight at step b.

    Args:
        step: index of the batch, from 0.
        annealing_steps: b_0; infinity keeps the weight constant.

    Source: the paper's equation for kappa_e.

    >>> exponential_annealing(0, 100), round(exponential_annealing(100, 100), 4)
    (1.0, 0.3679)
    """
    return math.exp(-step / annealing_steps)
