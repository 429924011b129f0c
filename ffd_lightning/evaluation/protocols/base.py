"""What a protocol is, and how results say which one they are of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np

from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.shapes import PreparedShape, Shape

_TITLES = {"chamfer": "Chamfer", "emd": "EMD", "iou": "IoU", "part_iou": "part IoU"}


@dataclass(frozen=True)
class Measure:
    """One number of a protocol.

    Attributes:
        name: of its columns.
        definition: what it is, for captions; points and unit are the protocol's `note`.
        higher_is_better: which way is good.
        factor: what it is multiplied by where people read it.
    """

    name: str
    definition: str
    higher_is_better: bool = False
    factor: float = 1000.0

    @property
    def title(self) -> str:
        """How it is written for people.

        >>> Measure("iou", "of voxels").title, Measure("fscore_1", "of points").title
        ('IoU', 'fscore_1')
        """
        return _TITLES.get(self.name, self.name)

    @property
    def arrow(self) -> str:
        """Points to where it is better."""
        return "↑" if self.higher_is_better else "↓"


@runtime_checkable
class EvaluationProtocol(Protocol):
    """A frozen way of measuring."""

    @property
    def name(self) -> str:
        """What it is called, in commands and folders."""
        ...

    @property
    def measures(self) -> tuple[Measure, ...]:
        """What it measures."""
        ...

    @property
    def note(self) -> str:
        """Points and unit of all its measures."""
        ...

    @property
    def needs_parts(self) -> bool:
        """Whether only shapes with part labels can be tested on; by default not."""
        return False

    def truth(self, shape: PreparedShape, rng: np.random.Generator) -> Any:
        """Return what of the ground truth is computed once for all shapes put before it."""
        ...

    def score(self, shape: Shape, truth: Any, rng: np.random.Generator) -> dict[str, float]:
        """Return each measure of a shape."""
        ...


def carries_points(protocol: EvaluationProtocol) -> bool:
    """Tell whether a protocol compares points of templates, deformed with them.

    If so, it has an attribute `carries_points` that is true. Others compare the deformed meshes.
    """
    return bool(getattr(protocol, "carries_points", False))


@dataclass(frozen=True)
class ProtocolDescription:
    """What results say of the protocol that they were measured under, which may be anyone's.

    Attributes:
        name: of the protocol, or of results under it, which says what settings they are of.
        note: points and unit of all its measures.
        measures: what it measures; none of a protocol that nobody has described yet.
        settings: of results, what else their numbers follow from, "" where it is not known.
    """

    name: str
    note: str = ""
    measures: tuple[Measure, ...] = ()
    settings: str = ""

    @classmethod
    def of(cls, protocol: EvaluationProtocol) -> ProtocolDescription:
        """Describe a protocol."""
        return cls(protocol.name, protocol.note, protocol.measures)

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> ProtocolDescription:
        """Return the description that `to_json` was called on.

        Raises:
            KeyError, TypeError, ValueError: it is of something else, or damaged.
        """
        measures = tuple(
            Measure(
                str(measure["name"]),
                str(measure["definition"]),
                bool(measure["higher_is_better"]),
                float(measure["factor"]),
            )
            for measure in content["measures"]
        )
        if not measures:
            raise ValueError("no measures")
        return cls(str(content["name"]), str(content["note"]), measures)

    def to_json(self) -> dict[str, Any]:
        """Return what a JSON file can hold.

        >>> measure = Measure("iou", "of voxels", True)
        >>> description = ProtocolDescription("mine", "no unit", (measure,))
        >>> ProtocolDescription.from_json(description.to_json()) == description
        True
        """
        measures = [asdict(measure) for measure in self.measures]
        return {"name": self.name, "note": self.note, "measures": measures}

    @property
    def factors(self) -> str:
        """What values are multiplied by where people read them, as the end of a caption.

        >>> measures = (Measure("iou", "", True, 100.0), Measure("chamfer", ""))
        >>> ProtocolDescription("mine", "", measures[1:]).factors
        ' All x 1000.'
        >>> ProtocolDescription("mine", "", measures).factors
        ' IoU x 100, Chamfer x 1000.'
        """
        factors = {m.factor for m in self.measures}
        if len(factors) == 1:
            return "" if factors == {1.0} else f" All x {factors.pop():g}."
        told = ", ".join(f"{m.title} x {m.factor:g}" for m in self.measures if m.factor != 1.0)
        return f" {told}."

    @property
    def main_measure(self) -> Measure:
        """The measure that samples are ordered by: the first distance."""
        return next((m for m in self.measures if not m.higher_is_better), self.measures[0])

    def measure(self, name: str) -> Measure:
        """Return a measure by its name.

        Raises:
            ConfigError: the protocol has none of this name.
        """
        for measure in self.measures:
            if measure.name == name:
                return measure
        raise ConfigError(
            f"protocol {self.name} has no measure {name!r}: choose one of "
            f"{', '.join(m.name for m in self.measures)}"
        )
