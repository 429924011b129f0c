"""Factors of weights that fade as training goes on."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

Annealing = Callable[[int], float]
"""From the step, counted from 0, to the factor of a term's weight."""


def constant(step: int) -> float:
    """Return 1: the weight stays as it is."""
    return 1.0


def exponential_annealing(step: int, annealing_steps: float) -> float:
    r"""Return $e^{-b / b_0}$, the factor of an annealed weight at step b.

    Args:
        step: index of the step, from 0.
        annealing_steps: b_0; infinity keeps the weight constant.

    Source: the paper's equation 13.

    >>> exponential_annealing(0, 100), round(exponential_annealing(100, 100), 4)
    (1.0, 0.3679)
    """
    return math.exp(-step / annealing_steps)


def linear_annealing(step: int, annealing_steps: float) -> float:
    r"""Return $\max(1 - b / b_0, 0)$, the factor of a weight that is gone after b_0 steps.

    Args:
        step: index of the step, from 0.
        annealing_steps: b_0; infinity keeps the weight constant.

    Source: the authors' released code; the paper does not use it.

    >>> [linear_annealing(step, 100) for step in (0, 25, 100, 101)]
    [1.0, 0.75, 0.0, 0.0]
    """
    return max(1 - step / annealing_steps, 0.0)


_FADING = {"exponential": exponential_annealing, "linear": linear_annealing}
ANNEALINGS = ("constant", *_FADING)
"""What a term's `annealing` can be."""


def make_annealing(name: str, annealing_steps: float) -> Annealing:
    """Return an annealing by name.

    Args:
        name: one of `ANNEALINGS`.
        annealing_steps: b_0, over which `exponential` falls by a factor of e and `linear` to 0.

    Raises:
        ValueError: another name.
    """
    if name not in ANNEALINGS:
        raise ValueError(f"annealing={name} must be one of {', '.join(ANNEALINGS)}")
    if name == "constant":
        return constant
    return partial(_FADING[name], annealing_steps=annealing_steps)
