"""A template strategy, and a split."""

import numpy as np

import ffd_lightning as ffd


@ffd.component("template_strategy", "by_height")
class ByHeight:
    """Shapes evenly spread from the lowest to the tallest.

    Args:
        points: of each shape that are looked at.
    """

    def __init__(self, points: int = 64) -> None:
        self.points = points

    def __call__(self, prepared: ffd.PreparedSet, count: int) -> list[str]:
        """Return so many ids of the set."""
        rows = range(len(prepared))
        heights = [np.ptp(prepared.cloud(row, self.points)[:, 1]) for row in rows]
        order = np.argsort(heights, kind="stable")
        return [prepared.ids[order[k]] for k in np.linspace(0, len(order) - 1, count).astype(int)]


@ffd.component("split", "every_fifth")
class EveryFifth:
    """Of the sorted ids, every fifth is tested on.

    Args:
        first: the first of them, from 0 to 4.
    """

    def __init__(self, first: int = 0) -> None:
        self.first = first

    def __call__(self, shapes: ffd.SplitInput) -> dict[str, str]:
        """Return `train`, `val` or `test` by id."""
        numbered = enumerate(sorted(shapes.ids))
        return {i: "test" if k % 5 == self.first else "train" for k, i in numbered}
