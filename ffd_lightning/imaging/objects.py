"""Which parts of what is not background are the object: captions, arrows, other objects are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Covered: TypeAlias = NDArray[np.bool_]
_Floats: TypeAlias = NDArray[np.floating[Any]]

_ANGLES = np.arange(32) * np.pi / 16
_DIRECTIONS = np.stack([np.sin(_ANGLES), np.cos(_ANGLES)])  # (2, 32): of rows and columns
_CENTRAL = 0.45  # of half the picture's diagonal; so far off its middle, an area counts for 0.37
_NEAR = 0.03  # of the object's diagonal: what is within that of its hull belongs to it
_ABOVE = 0.04, 0.4  # of the width, off the vertical line; of the height, between: one object still
_THIN = 0.03  # of the object's diagonal: lines and arrows are thinner
_SMALL = 0.08  # of the object's area: letters are smaller
_ALIKE = 0.4  # of the object's area: from there on another object is of similar size
_PIECES = 4  # of similar size: they are one object, such as the legs of a white table


@dataclass(frozen=True)
class MainObject:
    """The object among all that is not background.

    Attributes:
        kept: where it is, (h, w).
        left_out: what else there was, in words.
        pieces: how many parts were taken for one object, where that may be wrong; else 1.
    """

    kept: Covered
    left_out: tuple[str, ...] = ()
    pieces: int = 1


@dataclass(eq=False)
class _Part:
    """Connected pixels, or several such.

    Attributes:
        labels: of each.
        area: of all, in pixels.
        largest: area of the largest.
        edge: rows and columns of pixels at their edges, (n, 2).
        extent: how far they go in each of `_DIRECTIONS`, (32,): their hull.
        thickness: of the thickest, in pixels.
    """

    labels: list[int]
    area: int
    largest: int
    edge: _Floats
    extent: _Floats
    thickness: float

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Left, top, right and bottom."""
        (top, left), (bottom, right) = self.edge.min(axis=0), self.edge.max(axis=0)
        return float(left), float(top), float(right), float(bottom)

    @property
    def diagonal(self) -> float:
        return float(np.hypot(*np.ptp(self.edge, axis=0)))

    def join(self, other: _Part) -> None:
        self.labels += other.labels
        self.area += other.area
        self.largest = max(self.largest, other.largest)
        self.edge = np.concatenate([self.edge, other.edge])
        self.extent = np.maximum(self.extent, other.extent)
        self.thickness = max(self.thickness, other.thickness)


def main_object(covered: Covered) -> MainObject:
    """Tell the object from what else is not background.

    It is the largest connected part, the nearer to the middle the better, with all that lies in
    its convex hull or nearly so, and with what stands exactly above or below it (a lamp whose thin
    rod was not seen). Four or more parts of similar size are one object.

    Args:
        covered: where there is no background, (h, w), without specks.
    """
    labels, count = ndimage.label(covered, np.ones((3, 3)))
    if count < 2:
        return MainObject(covered)
    parts = _parts(labels, count)
    main = max(parts, key=lambda part: _score(part, covered.shape))
    rest, pieces = [part for part in parts if part is not main], 1
    while (
        joined := [part for part in rest if _within(part, main)]
        or [part for part in rest if _in_line(part, main)][:1]
    ):
        pieces += not _within(joined[0], main)
        for part in joined:
            main.join(part)
        rest = [part for part in rest if part not in joined]
    groups = _groups(rest, main)
    kinds = [_kind(group, main) for group in groups]
    similar = kinds.count(_SIMILAR)
    if similar >= _PIECES - 1:
        return MainObject(covered, pieces=similar + 1)
    sides: dict[str, dict[str, None]] = {}
    for kind, group in zip(kinds, groups, strict=True):
        sides.setdefault(kind, {})[_side(group, main)] = None
    told = tuple(f"{kind} ({', '.join(where)})" for kind, where in sides.items())
    return MainObject(np.isin(labels, main.labels), told, pieces)


def _parts(labels: NDArray[np.int32], count: int) -> list[_Part]:
    """Return the connected parts of a picture."""
    # Padded: beyond the picture nothing is covered.
    depth = ndimage.distance_transform_edt(np.pad(labels > 0, 1))[1:-1, 1:-1]
    area = np.bincount(labels.ravel(), minlength=count + 1)
    thickness = 2 * ndimage.maximum(depth, labels, np.arange(count + 1))
    rows, columns = np.nonzero((depth > 0) & (depth < 2))
    of = labels[rows, columns]
    order = np.argsort(of, kind="stable")
    edges = np.stack([rows, columns], 1)[order].astype(np.float32)
    starts = np.searchsorted(of[order], np.arange(1, count + 2))
    parts = []
    for k in range(1, count + 1):
        edge, size = edges[starts[k - 1] : starts[k]], int(area[k])
        extent = (edge @ _DIRECTIONS).max(axis=0)
        parts.append(_Part([k], size, size, edge, extent, float(thickness[k])))
    return parts


def _score(part: _Part, shape: tuple[int, ...]) -> float:
    """Return an area, less if it is far from the middle; a frame or a band has hardly any."""
    left, top, right, bottom = part.box
    height, width = shape
    sides = (left <= 1) + (top <= 1) + (right >= width - 2) + (bottom >= height - 2)
    off = np.hypot(left + right - width, top + bottom - height) / 2
    off /= np.hypot(height, width) / 2 * _CENTRAL
    return float(part.area * np.exp(-(off**2)) * (1e-3 if sides > 2 else 1))


def _within(part: _Part, main: _Part) -> bool:
    """Tell whether most of a part lies in the object's hull, or nearly so if it is no line."""
    line = part.thickness < _THIN * main.diagonal
    inside = part.edge @ _DIRECTIONS <= main.extent + (0 if line else _NEAR * main.diagonal)
    return float(inside.all(axis=1).mean()) >= 0.5


def _in_line(part: _Part, main: _Part) -> bool:
    """Tell whether a narrower part, no line or letter, stands exactly above or below."""
    if part.thickness < _THIN * main.diagonal or part.area < _SMALL * main.area:
        return False
    (a, b, c, d), (left, top, right, bottom) = part.box, main.box
    off, gap = abs(a + c - left - right) / 2, max(b - bottom, top - d)
    wide, high = right - left, max(d, bottom) - min(b, top)
    return c - a <= wide and off < _ABOVE[0] * wide and 0 < gap < _ABOVE[1] * high


def _groups(parts: list[_Part], main: _Part) -> list[_Part]:
    """Return parts with those next to them as one: letters as words."""
    groups: list[_Part] = []
    for part in sorted(parts, key=lambda part: part.box[0]):
        near = [g for g in groups if _gap(g, part) < 2 * _NEAR * main.diagonal]
        for group in near:
            part.join(group)
        groups = [g for g in groups if g not in near] + [part]
    return groups


def _gap(one: _Part, other: _Part) -> float:
    """Return how far two boxes are apart."""
    (a, b, c, d), (e, f, g, h) = one.box, other.box
    return float(np.hypot(max(e - c, a - g, 0), max(f - d, b - h, 0)))


_SIMILAR = "another object of similar size"


def _kind(group: _Part, main: _Part) -> str:
    """Say what something beside the object may be."""
    if group.largest < _SMALL * main.area:
        return "lines or arrows" if len(group.labels) < 3 and _long(group) else "small parts"
    if group.thickness < max(_THIN * main.diagonal, group.diagonal / 20):
        return "lines or arrows"
    return _SIMILAR if group.largest >= _ALIKE * main.area else "another object"


def _long(group: _Part) -> bool:
    return group.diagonal > 5 * group.thickness


def _side(group: _Part, main: _Part) -> str:
    """Return on which side of the object something is."""
    (a, b, c, d), (left, top, right, bottom) = group.box, main.box
    outside = {"left": left - c, "right": a - right, "above": top - d, "below": b - bottom}
    return max(outside, key=lambda side: outside[side])
