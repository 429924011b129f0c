"""Which parts of what is not background are the object: captions, arrows, other objects are not."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Mask: TypeAlias = NDArray[np.bool_]

_CENTRAL = 0.45  # of half the picture's diagonal; so far off its middle, an area counts for 0.37
_NEAR = 0.03  # of the object's diagonal: what is within that of its box belongs to it
_ABOVE = 0.04, 0.4  # of the width, off the vertical line; of the height, between: one object still
_SMALL = 0.08  # of the object's area: letters are smaller
_ALIKE = 0.4  # of the object's area: from there on another part is of similar size
_PIECES = 4  # of similar size: they are one object, such as the legs of a white table


def main_object(covered: Mask) -> tuple[Mask, int]:
    """Tell the object from what else is not background.

    It is the largest connected part, the nearer to the middle the better, with what lies in its
    box or very near, and with what stands exactly above or below it (a lamp whose thin rod was not
    seen). Four or more parts of similar size are one object.

    Args:
        covered: where there is no background, (h, w), without specks.

    Returns:
        Where the object is, (h, w), and how many other parts were left out.
    """
    labels, count = ndimage.label(covered, np.ones((3, 3)))
    if count < 2:
        return covered, 0
    area = np.bincount(labels.ravel())[1:].astype(np.float64)
    places = ndimage.find_objects(labels)
    low = np.array([(x.start, y.start) for y, x in places], np.float64)
    high = np.array([(x.stop, y.stop) for y, x in places], np.float64)
    size = np.array(covered.shape[::-1])
    sides = (low <= 1).sum(axis=1) + (high >= size - 1).sum(axis=1)
    off = np.linalg.norm(low + high - size, axis=1) / (np.linalg.norm(size) * _CENTRAL)
    # A frame or a band along the border is hardly ever the object.
    main = np.argmax(area * np.exp(-(off**2)) * np.where(sides > 2, 1e-3, 1))
    similar = area >= _ALIKE * area[main]
    kept = similar if similar.sum() >= _PIECES else np.arange(count) == main
    while True:
        start, end = low[kept].min(axis=0), high[kept].max(axis=0)
        near = _NEAR * np.linalg.norm(end - start)
        common = np.minimum(high, end + near) - np.maximum(low, start - near)
        within = np.maximum(common, 0).prod(axis=1) >= 0.5 * (high - low).prod(axis=1)
        more = within & ~kept
        if not more.any():
            wide = end[0] - start[0]
            aligned = np.abs((low + high)[:, 0] - start[0] - end[0]) / 2 < _ABOVE[0] * wide
            gap = np.maximum(low[:, 1] - end[1], start[1] - high[:, 1])
            tall = np.maximum(high[:, 1], end[1]) - np.minimum(low[:, 1], start[1])
            stacked = aligned & (gap >= 0) & (gap < _ABOVE[1] * tall)
            stacked &= (high - low)[:, 0] <= wide
            more = stacked & (area >= _SMALL * area[kept].sum()) & ~kept
        if not more.any():
            return np.append(False, kept)[labels], int((~kept).sum())
        kept = kept | more
