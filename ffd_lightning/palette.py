"""One palette and one set of names for regimes, wherever they are drawn.

The colours are Okabe and Ito's, told apart by all kinds of colour vision; without their yellow,
which is lost on white. None stands for good or bad.
"""

from __future__ import annotations

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
