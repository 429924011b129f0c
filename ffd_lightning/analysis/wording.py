"""How measures and numbers are written for people."""

from __future__ import annotations

from ffd_lightning.evaluation.protocols import Measure


def measure_title(name: str) -> str:
    """Return how a measure is written for people.

    >>> measure_title("iou"), measure_title("fscore_1")
    ('IoU', 'fscore_1')
    """
    return Measure(name, "").title


def number(value: float) -> str:
    """Return a number for a table: one place after the point, more where it is small.

    >>> number(1234.56), number(0.00345)
    ('1234.6', '0.00345')
    """
    return f"{value:.1f}" if abs(value) >= 10 else f"{value + 0.0:.3g}"  # no -0
