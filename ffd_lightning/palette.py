"""One palette and one set of names for regimes, wherever they are drawn.

The colours are Okabe and Ito's, told apart by all kinds of colour vision; without their yellow,
which is lost on white. None stands for good or bad.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import UNKNOWN_PART

REGIME_COLORS = {
    "b": "#0072B2",
    "w": "#D55E00",
    "e": "#009E73",
    "r": "#CC79A7",
    "posterior": "#000000",
}
"""A regime's colour is the same in every figure, page and notebook."""

COLORS = (*REGIME_COLORS.values(), "#E69F00", "#56B4E9")
"""For what is no regime, in this order."""

_REGIME_TITLES = {"b": "base", "w": "log-weighted", "e": "entropy", "r": "regularized"}


def regime_title(name: str) -> str:
    """Return a regime's name for people: the paper's letters with the word they stand for.

    >>> regime_title("b"), regime_title("posterior")
    ('b, base', 'posterior')
    """
    return f"{name}, {_REGIME_TITLES[name]}" if name in _REGIME_TITLES else name


PART_COLORS = (
    (0, 114, 178),
    (230, 159, 0),
    (0, 158, 115),
    (204, 121, 167),
    (86, 180, 233),
    (213, 94, 0),
    (240, 228, 66),
    (51, 34, 136),
    (153, 153, 51),
    (136, 34, 85),
    (127, 127, 127),
    (174, 199, 232),
    (255, 214, 138),
    (127, 205, 187),
    (235, 192, 216),
    (140, 86, 75),
    (150, 120, 200),
    (250, 170, 130),
    (60, 60, 60),
    (0, 80, 60),
)
"""RGB of parts in pictures and files, by their number; they begin again after the last."""


def part_colors(labels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the colour of each part label, (N,) -> (N, 4) RGBA; unknown ones are light grey."""
    table = np.full((256, 4), 255, np.uint8)
    table[:, :3] = np.resize(np.array(PART_COLORS, np.uint8), (256, 3))
    table[UNKNOWN_PART] = (210, 210, 210, 255)
    return table[labels]
