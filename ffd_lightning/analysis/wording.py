"""How measures and numbers are written for people."""

from __future__ import annotations

from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription

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
"""Short titles of what is scored, `ffd_lightning.evaluation.candidates.CANDIDATES`."""


def scaled_title(measure: Metric) -> str:
    """Return a measure with what its values are multiplied by where people read them.

    >>> scaled_title(Metric("chamfer", "")), scaled_title(Metric("fscore_1", "", True, 1.0))
    ('Chamfer x 1000', 'fscore_1')
    """
    return measure.title if measure.factor == 1 else f"{measure.title} x {measure.factor:g}"


def measure_note(measure: Metric, protocol: ProtocolDescription) -> str:
    """Return what a measure is, with its unit and points, for a caption.

    >>> measure_note(Metric("iou", "of voxels", True), ProtocolDescription("mine", "filled"))
    'IoU: of voxels; filled; protocol mine'
    """
    note = f"{protocol.note}; " if protocol.note else ""
    return f"{measure.title}: {measure.definition}; {note}protocol {protocol.name}"
