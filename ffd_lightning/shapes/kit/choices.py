"""Random choices by name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

Rng = np.random.Generator


def draw(rng: Rng, choices: Sequence[str], p: Sequence[float] | None = None) -> str:
    """Draw one of `choices`, evenly or with probabilities `p`."""
    return str(rng.choice(choices, p=p))
