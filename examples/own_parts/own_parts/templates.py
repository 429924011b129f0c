"""A template strategy, and a split."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import ffd_lightning as ffd


@dataclass
class ByHeight:
    """Shapes evenly spread from the lowest to the tallest.

    Attributes:
        points: of each shape that are looked at.
    """

    points: int = 64


@ffd.register("template_strategy", "by_height", ByHeight)
def by_height(settings: ByHeight) -> Callable[[ffd.PreparedSet, int], Sequence[str]]:
    """Return the strategy."""

    def choose(prepared: ffd.PreparedSet, count: int) -> list[str]:
        heights = [
            np.ptp(prepared.cloud(row, settings.points)[:, 1]) for row in range(len(prepared))
        ]
        order = np.argsort(heights, kind="stable")
        return [prepared.ids[order[k]] for k in np.linspace(0, len(order) - 1, count).astype(int)]

    return choose


@dataclass
class EveryFifth:
    """Of the sorted ids, every fifth is tested on.

    Attributes:
        first: the first of them, from 0 to 4.
    """

    first: int = 0


@ffd.register("split", "every_fifth", EveryFifth)
def every_fifth(settings: EveryFifth) -> Callable[[ffd.SplitInput], dict[str, str]]:
    """Return the rule."""

    def subsets(shapes: ffd.SplitInput) -> dict[str, str]:
        numbered = enumerate(sorted(shapes.ids))
        return {i: "test" if k % 5 == settings.first else "train" for k, i in numbered}

    return subsets
