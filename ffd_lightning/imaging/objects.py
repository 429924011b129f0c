"""Which parts of what is not background are the object: captions, arrows, other objects are not."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Mask: TypeAlias = NDArray[np.bool_]
_Floats: TypeAlias = NDArray[np.float64]

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
    boxes = np.array(
        [(x.start, y.start, x.stop, y.stop) for y, x in ndimage.find_objects(labels)], np.float64
    )
    main = int(np.argmax(_scores(area, boxes, covered.shape)))
    similar = area >= _ALIKE * area[main]
    kept = similar if similar.sum() >= _PIECES else np.arange(count) == main
    while True:
        box = np.append(boxes[kept, :2].min(axis=0), boxes[kept, 2:].max(axis=0))
        more = _within(boxes, box) & ~kept
        if not more.any():
            more = _in_line(boxes, box) & (area >= _SMALL * area[kept].sum()) & ~kept
        if not more.any():
            return np.append(False, kept)[labels], int((~kept).sum())
        kept = kept | more


def _scores(area: _Floats, boxes: _Floats, shape: tuple[int, ...]) -> _Floats:
    """Return areas, less if far from the middle; a frame or a band has hardly any."""
    size = np.array(shape[::-1])
    sides = (boxes[:, :2] <= 1).sum(axis=1) + (boxes[:, 2:] >= size - 1).sum(axis=1)
    off = np.linalg.norm(boxes[:, :2] + boxes[:, 2:] - size, axis=1)
    off /= np.linalg.norm(size) * _CENTRAL
    scores: _Floats = area * np.exp(-(off**2)) * np.where(sides > 2, 1e-3, 1)
    return scores


def _within(boxes: _Floats, box: _Floats) -> Mask:
    """Tell which boxes lie in another, or nearly so, by half of their area or more."""
    near = _NEAR * np.linalg.norm(box[2:] - box[:2])
    low, high = np.maximum(boxes[:, :2], box[:2] - near), np.minimum(boxes[:, 2:], box[2:] + near)
    common = np.maximum(high - low, 0).prod(axis=1)
    within: Mask = common >= 0.5 * (boxes[:, 2:] - boxes[:, :2]).prod(axis=1)
    return within


def _in_line(boxes: _Floats, box: _Floats) -> Mask:
    """Tell which boxes, no wider than another, stand exactly above or below it."""
    left, top, right, bottom = box
    off = np.abs(boxes[:, 0] + boxes[:, 2] - left - right) / 2
    gap = np.maximum(boxes[:, 1] - bottom, top - boxes[:, 3])
    high = np.maximum(boxes[:, 3], bottom) - np.minimum(boxes[:, 1], top)
    wide = right - left
    narrower = boxes[:, 2] - boxes[:, 0] <= wide
    aligned: Mask = narrower & (off < _ABOVE[0] * wide) & (gap >= 0) & (gap < _ABOVE[1] * high)
    return aligned
