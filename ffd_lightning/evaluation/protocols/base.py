"""What a protocol is, and how results say which one they are of."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ffd_lightning.components import OWN, Component
from ffd_lightning.errors import ConfigError
from ffd_lightning.evaluation.candidates import CANDIDATES, Candidate, PreparedShape

COLUMNS = (  # of samples and summaries, beside those of metrics
    *("id", "category", "family", "view", "template", "weight", "twin", "azimuth_error"),
    *("folded", "stretch_median", "stretch_95", "bending"),
    *("entropy", "effective_templates", "templates_used", "num_samples", "num_twins"),
    *("protocol", "definitions", "unit", "step", "settings", "key"),
)
_TITLES = {"chamfer": "Chamfer", "emd": "EMD", "iou": "IoU", "part_iou": "part IoU"}


@dataclass(frozen=True)
class Metric:
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

        >>> Metric("iou", "of voxels").title, Metric("fscore_1", "of points").title
        ('IoU', 'fscore_1')
        """
        return _TITLES.get(self.name, self.name)

    @property
    def scaled_title(self) -> str:
        """That, with what values are multiplied by where people read them.

        >>> Metric("chamfer", "").scaled_title, Metric("fscore_1", "", True, 1.0).scaled_title
        ('Chamfer x 1000', 'fscore_1')
        """
        return self.title if self.factor == 1 else f"{self.title} x {self.factor:g}"

    @property
    def arrow(self) -> str:
        """Points to where it is better."""
        return "↑" if self.higher_is_better else "↓"


class Protocol(ABC):
    """A way of measuring candidates against the ground truth.

    Subclasses are components: `@component("protocol", NAME)`. Their methods are called in several
    threads at once.

    Attributes:
        metrics: what is measured.
        note: points and unit of all metrics.
        needs_parts: only shapes with part labels can be tested on.
        carries_points: compares points of templates that are deformed with them. Others compare the
            deformed meshes.
    """

    metrics: tuple[Metric, ...] = ()
    note: str = ""
    needs_parts: bool = False
    carries_points: bool = False
    component: Component

    @abstractmethod
    def truth(self, shape: PreparedShape, rng: np.random.Generator) -> Any:
        """Return what of the ground truth is computed once for all candidates."""

    @abstractmethod
    def score(self, candidate: Candidate, truth: Any, rng: np.random.Generator) -> dict[str, float]:
        """Return a number for each metric, by name.

        Args:
            candidate: what is put before the ground truth.
            truth: what `truth` returned.
            rng: the only source of randomness; in the same state for all candidates.
        """

    def check_metrics(self, protocol: str) -> None:
        """Make sure that each metric has columns of its own; a ConfigError names the `protocol`."""
        names = [metric.name for metric in self.metrics]
        taken = {*COLUMNS, *(f"{other}_{name}" for other in CANDIDATES for name in names)}
        wrong = [name for name in names if name in taken or names.count(name) > 1]
        if wrong or not names:
            problem = f"{wrong[0]!r} is taken: choose another name" if wrong else "it needs one"
            raise ConfigError(f"protocol={protocol}, metrics: {problem}")

    @property
    def name(self) -> str:
        """The name that it is registered under."""
        return self.component.name

    @property
    def key(self) -> str:
        """What changes when it measures something else: its settings, and another package."""
        settings = {"name": self.name, **self.component.settings}
        if self.component.provider != OWN:
            settings["provider"] = self.component.provider
        return f"{type(self).__qualname__}({', '.join(f'{k}={v!r}' for k, v in settings.items())})"


@dataclass(frozen=True)
class ProtocolDescription:
    """What results say of the protocol that they were measured under, which may be anyone's.

    Attributes:
        name: of the protocol, or of results under it, which says what settings they are of.
        note: points and unit of all its metrics.
        metrics: what it measures; none of a protocol that nobody has described yet.
        settings: of results, what else their numbers follow from, "" where it is not known.
    """

    name: str
    note: str = ""
    metrics: tuple[Metric, ...] = ()
    settings: str = ""

    @classmethod
    def of(cls, protocol: Protocol) -> ProtocolDescription:
        """Describe a protocol."""
        return cls(protocol.name, protocol.note, protocol.metrics)

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> ProtocolDescription:
        """Return the description that `to_json` was called on.

        Raises:
            KeyError, TypeError, ValueError: it is of something else, or damaged.
        """
        metrics = content["metrics"]
        if not metrics:
            raise ValueError("no metrics")
        return cls(str(content["name"]), str(content["note"]), tuple(Metric(**m) for m in metrics))

    def to_json(self) -> dict[str, Any]:
        """Return what a JSON file can hold.

        >>> description = ProtocolDescription("mine", "", (Metric("iou", "of voxels", True),))
        >>> ProtocolDescription.from_json(description.to_json()) == description
        True
        """
        return {name: value for name, value in asdict(self).items() if name != "settings"}

    @property
    def main_metric(self) -> Metric:
        """The metric that samples are ordered by: the first distance.

        >>> metrics = (Metric("iou", "", True), Metric("emd", ""))
        >>> ProtocolDescription("mine", "", metrics).main_metric.name
        'emd'
        """
        return next((m for m in self.metrics if not m.higher_is_better), self.metrics[0])

    def metric(self, name: str) -> Metric:
        """Return a metric by its name.

        Raises:
            ConfigError: the protocol has none of this name.
        """
        found = {metric.name: metric for metric in self.metrics}
        if name not in found:
            there = ", ".join(found)
            raise ConfigError(f"protocol {self.name} has no metric {name!r}: choose one of {there}")
        return found[name]
