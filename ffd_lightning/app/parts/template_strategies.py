"""How templates are chosen."""

from __future__ import annotations

from dataclasses import dataclass

from omegaconf import MISSING

from ffd_lightning.app.parts.lazy import class_part, function_part
from ffd_lightning.registry import setting

_STRATEGIES = "ffd_lightning.data.templates.strategies"


@dataclass
class AutoStrategy:
    """The paper's own templates for ShapeNet's shapes, else `medoids`."""


function_part("template_strategy", "auto", AutoStrategy, f"{_STRATEGIES}:auto_choice")


@dataclass
class PaperStrategy:
    """The authors' own templates, of ShapeNet v1; `medoids` for those that are absent."""


function_part(
    "template_strategy",
    "paper",
    PaperStrategy,
    f"{_STRATEGIES}:paper_choice",
)


@dataclass
class MedoidStrategy:
    """Shapes that all others are near to, never one that is like nothing else in the set."""


function_part(
    "template_strategy",
    "medoids",
    MedoidStrategy,
    f"{_STRATEGIES}:medoid_templates",
)


@dataclass
class DiverseStrategy:
    """The most central shape, then whichever is farthest from all chosen: outliers come early."""


function_part(
    "template_strategy",
    "diverse",
    DiverseStrategy,
    f"{_STRATEGIES}:diverse_templates",
)


@dataclass
class RandomTemplates:
    """Templates drawn at random.

    Attributes:
        seed: decides which.
    """

    seed: int = setting(0, within="[0, inf)")


class_part(
    "template_strategy",
    "random",
    RandomTemplates,
    f"{_STRATEGIES}:RandomStrategy",
)


@dataclass
class ListedTemplates:
    """The first ids of a file.

    Attributes:
        file: one id a line; {category} in it stands for the category.
    """

    file: str = MISSING


class_part(
    "template_strategy",
    "listed",
    ListedTemplates,
    f"{_STRATEGIES}:ListedStrategy",
)


@dataclass
class RankedTemplates:
    """The favourites of an earlier run.

    Attributes:
        file: its template_ranking.csv; {category} in it stands for the category.
    """

    file: str = MISSING


class_part(
    "template_strategy",
    "ranking",
    RankedTemplates,
    f"{_STRATEGIES}:RankingStrategy",
)
