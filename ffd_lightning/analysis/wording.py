"""How measures and numbers are written for people."""

from __future__ import annotations

from ffd_lightning.evaluation.protocols import Measure, ProtocolDescription

SHAPE_TITLES = {
    "": "model",
    "resampled": "points redrawn",
    "undeformed": "undeformed",
    "best_deformed": "best deformed",
    "fitted": "best fitted",
    "best_undeformed": "best undeformed",
    "feature_retrieval": "retrieved",
    "retrieval": "nearest",
    "medoid": "medoid",
    "floor": "floor",
}
"""Short titles of what is scored, `ffd_lightning.evaluation.references.SHAPES`."""


def measure_title(name: str) -> str:
    """Return how a measure is written for people.

    >>> measure_title("iou"), measure_title("fscore_1")
    ('IoU', 'fscore_1')
    """
    return Measure(name, "").title


def scaled_title(measure: Measure) -> str:
    """Return a measure with what its values are multiplied by where people read them.

    >>> scaled_title(Measure("chamfer", "")), scaled_title(Measure("fscore_1", "", True, 1.0))
    ('Chamfer x 1000', 'fscore_1')
    """
    factor = "" if measure.factor == 1 else f" x {measure.factor:g}"
    return f"{measure_title(measure.name)}{factor}"


def measure_note(measure: Measure, protocol: ProtocolDescription) -> str:
    """Return what a measure is, with its unit and points, for a caption.

    >>> measure_note(Measure("iou", "of voxels", True), ProtocolDescription("mine", "filled"))
    'IoU: of voxels; filled; protocol mine'
    """
    told = [measure.definition, *([protocol.note] if protocol.note else [])]
    return f"{measure_title(measure.name)}: {'; '.join(told)}; protocol {protocol.name}"


def number(value: float) -> str:
    """Return a number for a table: one place after the point, more where it is small.

    >>> number(1234.56), number(0.00345)
    ('1234.6', '0.00345')
    """
    return f"{value:.1f}" if abs(value) >= 10 else f"{value + 0.0:.3g}"  # no -0
