"""One palette and one set of names for regimes, wherever they are drawn.

The colours are Okabe and Ito's, told apart by all kinds of colour vision; without their yellow,
which is lost on white. None stands for good or bad.
"""

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


def rgb(color: str) -> tuple[int, int, int]:
    """Return the numbers of a colour, 0 to 255.

    >>> rgb("#0072B2")
    (0, 114, 178)
    """
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue


_REGIME_TITLES = {"b": "base", "w": "log-weighted", "e": "entropy", "r": "regularized"}


def regime_title(name: str) -> str:
    """Return a regime's name for people: the paper's letters with the word they stand for.

    >>> regime_title("b"), regime_title("posterior")
    ('b, base', 'posterior')
    """
    return f"{name}, {_REGIME_TITLES[name]}" if name in _REGIME_TITLES else name


_PARTS = bytes.fromhex(
    "0072b2 e69f00 009e73 cc79a7 56b4e9 d55e00 f0e442 332288 999933 882255 "
    "7f7f7f aec7e8 ffd68a 7fcdbb ebc0d8 8c564b 9678c8 faaa82 3c3c3c 00503c"
)
PART_COLORS = tuple(map(tuple, np.frombuffer(_PARTS, np.uint8).reshape(-1, 3).tolist()))
"""RGB of parts in pictures and files, by their number; they begin again after the last."""


def part_colors(labels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the colour of each part label, (N,) -> (N, 4) RGBA; unknown ones are light grey."""
    table = np.full((256, 4), 255, np.uint8)
    table[:, :3] = np.resize(np.array(PART_COLORS, np.uint8), (256, 3))
    table[UNKNOWN_PART] = (210, 210, 210, 255)
    return table[labels]
