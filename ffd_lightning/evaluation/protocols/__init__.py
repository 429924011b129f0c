"""What is measured, and how: each protocol turns a candidate and the truth into named numbers."""

from ffd_lightning.evaluation.protocols.base import Metric, Protocol, ProtocolDescription
from ffd_lightning.evaluation.protocols.paper import PaperProtocol
from ffd_lightning.evaluation.protocols.parts import PartProtocol
from ffd_lightning.evaluation.protocols.surface import SurfaceProtocol

__all__ = [
    "Metric",
    "PaperProtocol",
    "PartProtocol",
    "Protocol",
    "ProtocolDescription",
    "SurfaceProtocol",
]
