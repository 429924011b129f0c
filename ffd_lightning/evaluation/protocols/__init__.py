"""What is measured, and how: each protocol turns a shape and the truth into named numbers."""

from __future__ import annotations

from ffd_lightning.evaluation.protocols.base import (
    EvaluationProtocol,
    Measure,
    ProtocolDescription,
    carries_points,
)
from ffd_lightning.evaluation.protocols.modern import ModernProtocol
from ffd_lightning.evaluation.protocols.paper import PaperProtocol
from ffd_lightning.evaluation.protocols.parts import PartProtocol
from ffd_lightning.evaluation.protocols.scaled import ScaledProtocol
from ffd_lightning.metrics.scalings import SCALINGS

__all__ = [
    "PROTOCOLS",
    "EvaluationProtocol",
    "Measure",
    "ModernProtocol",
    "PaperProtocol",
    "PartProtocol",
    "ProtocolDescription",
    "ScaledProtocol",
    "carries_points",
]

_BUILT_IN: tuple[EvaluationProtocol, ...] = (
    PaperProtocol(),
    ModernProtocol(),
    *(ScaledProtocol(name) for name in SCALINGS),
    PartProtocol(),
)
PROTOCOLS = {protocol.name: protocol for protocol in _BUILT_IN}
"""The built-in protocols, by name."""
