"""Pictures and words laid out on a sheet, which becomes pixels here and vectors elsewhere."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Picture = NDArray[np.uint8]
"""(H, W, 3) or (H, W, 4), alpha ignored."""
Align = Literal["left", "center", "right"]

_GAP = 4  # pixels between pictures
_LEADING = 1.4  # of the font's size, from line to line
_FINE = 4  # letters are drawn at this many times their size: whole pixels would space them unevenly
_SMALLEST = 0.75  # of a font's size, for lines that are too wide
_ELLIPSIS = "\N{HORIZONTAL ELLIPSIS}"


@dataclass(frozen=True)
class Line:
    """A line of text.

    Attributes:
        text: without line breaks.
        x, y: pixels from the top left, of its start, middle or end by `align`, halfway up.
        size: of the font, pixels.
        align: what of the line is at `x`.
        color: RGB; None for the sheet's ink.
    """

    text: str
    x: float
    y: float
    size: float
    align: Align = "left"
    color: tuple[int, int, int] | None = None


@dataclass(frozen=True)
class Sheet:
    """Pictures and lines of text, at their places.

    Attributes:
        height, width: pixels.
        pictures: each with x and y of its top left.
        lines: drawn over the pictures.
        background: grey level between and below pictures.
    """

    height: int
    width: int
    pictures: tuple[tuple[Picture, int, int], ...] = ()
    lines: tuple[Line, ...] = ()
    background: int = 255

    @property
    def ink(self) -> tuple[int, int, int]:
        """The colour of letters, RGB."""
        return (0, 0, 0) if self.background > 127 else (255, 255, 255)

    def draw(self) -> NDArray[np.uint8]:
        """Return the sheet in pixels, (height, width, 3) uint8."""
        sheet = np.full((self.height, self.width, 3), self.background, np.uint8)
        for picture, x, y in self.pictures:
            sheet[y : y + len(picture), x : x + picture.shape[1]] = picture[..., :3]
        for line in self.lines:
            _write(sheet, line, self.ink)
        return sheet

    def _repr_png_(self) -> bytes:
        """Show the sheet in notebooks."""
        buffer = io.BytesIO()
        Image.fromarray(self.draw()).save(buffer, "PNG")
        return buffer.getvalue()


def side_by_side(sheets: Sequence[Sheet]) -> Sheet:
    """Return sheets as one, from left to right, in line at the top."""
    return _joined(sheets, across=True)


def stacked(sheets: Sequence[Sheet]) -> Sheet:
    """Return sheets as one, from top to bottom, in line on the left."""
    return _joined(sheets, across=False)


def _joined(sheets: Sequence[Sheet], across: bool) -> Sheet:
    parts, x, y = [], 0, 0
    for sheet in sheets:
        parts.append((sheet, x, y))
        x, y = (x + sheet.width, y) if across else (x, y + sheet.height)
    height, width = (max(getattr(s, side) for s in sheets) for side in ("height", "width"))
    size = (height, x) if across else (y, width)
    return _placed(parts, size, sheets[0].background)


def _placed(
    parts: Sequence[tuple[Picture | Sheet, int, int]],
    size: tuple[int, int],
    background: int,
    lines: Sequence[Line] = (),
) -> Sheet:
    """Return a sheet of this height and width with others on it, each at its x and y."""
    pictures: list[tuple[Picture, int, int]] = []
    written = list(lines)
    for part, x, y in parts:
        if isinstance(part, Sheet):
            pictures += [(picture, x + left, y + top) for picture, left, top in part.pictures]
            written += [replace(line, x=x + line.x, y=y + line.y) for line in part.lines]
        else:
            pictures.append((part, x, y))
    return Sheet(*size, tuple(pictures), tuple(written), background)


def lay_out(
    images: Sequence[Picture | Sheet],
    columns: int,
    labels: Sequence[str] | None = None,
    background: int = 255,
    headings: Sequence[str] | None = None,
    font_size: int = 10,
) -> Sheet:
    """Lay images out in rows, each with its label below it.

    Args:
        images: or other sheets; cells take the largest size.
        columns: images per row.
        labels: one text per image, of one or more lines, centred; a line that is wider than its
            cell is set smaller, and of one that is much wider the middle is left out.
        background: grey level between and below images.
        headings: one text per column, centred above it.
        font_size: of labels, pixels; headings are a fifth larger.

    Raises:
        ValueError: no images, no columns, or not a label for each image or column.
    """
    if not images or columns < 1:
        raise ValueError(f"need images and columns, got {len(images)} and {columns}")
    for what, texts, count in (("image", labels, len(images)), ("column", headings, columns)):
        if texts is not None and len(texts) != count:
            raise ValueError(f"got {len(texts)} labels for {count} {what}s")
    large = round(1.2 * font_size)
    strip, top = _strip(labels, font_size), _strip(headings, large)
    sizes = [i.shape[:2] if isinstance(i, np.ndarray) else (i.height, i.width) for i in images]
    high, wide = (max(side) for side in zip(*sizes, strict=True))
    across = columns if headings else min(columns, len(images))
    parts: list[tuple[Picture | Sheet, int, int]] = []
    lines: list[Line] = []
    for k, heading in enumerate(headings or ()):
        lines += _lines(heading, _GAP + k * (wide + _GAP), _GAP, wide, large)
    for k, image in enumerate(images):
        x = _GAP + k % columns * (wide + _GAP)
        y = _GAP + top + k // columns * (high + strip + _GAP)
        parts.append((image, x, y))
        if labels is not None:
            lines += _lines(labels[k], x, y + high, wide, font_size)
    rows = -(-len(images) // columns)
    size = top + rows * (high + strip + _GAP) + _GAP, across * (wide + _GAP) + _GAP
    return _placed(parts, size, background, lines)


def contact_sheet(
    images: Sequence[Picture],
    columns: int,
    labels: Sequence[str] | None = None,
    background: int = 255,
    headings: Sequence[str] | None = None,
    font_size: int = 10,
) -> NDArray[np.uint8]:
    """Draw images in rows, each with its label below it; see `lay_out`.

    Returns:
        (H, W, 3) uint8.
    """
    return lay_out(images, columns, labels, background, headings, font_size).draw()


def text_width(text: str, size: float) -> float:
    """Return how wide a line of text is, in pixels, its font being `size` pixels."""
    return float(_font(100).getlength(text)) * size / 100


def _strip(texts: Sequence[str] | None, size: int) -> int:
    """Return the height that the texts of a row need."""
    return round(_LEADING * size * max((text.count("\n") + 1 for text in texts or ()), default=0))


def _lines(text: str, x: int, y: int, width: int, size: int) -> list[Line]:
    """Return the lines of a text, centred in a strip of this width from (x, y) down."""
    result = []
    for k, line in enumerate(text.split("\n")):
        fitting = size * min(1.0, max(_SMALLEST, width / max(text_width(line, size), 1.0)))
        middle = y + _LEADING * size * (k + 0.5)
        result.append(
            Line(_shortened(line, width, fitting), x + width / 2, middle, fitting, "center")
        )
    return [line for line in result if line.text]


def _shortened(line: str, width: int, size: float) -> str:
    """Return a line that fits: of too long a one the middle is left out."""
    shown = line
    kept = len(line)
    while text_width(shown, size) > width + 0.5 and kept > 2:
        kept -= 1
        shown = line[: (kept + 1) // 2] + _ELLIPSIS + line[len(line) - kept // 2 :]
    return shown


@lru_cache(maxsize=32)
def _font(pixels: int) -> ImageFont.FreeTypeFont:
    """Return the font of Matplotlib's figures, which has the letters of most languages."""
    import matplotlib  # here, since workers that draw no text import this module

    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(file), pixels)


def _write(sheet: NDArray[np.uint8], line: Line, ink: tuple[int, int, int]) -> None:
    """Draw a line of text into pixels, (H, W, 3)."""
    width, height = int(text_width(line.text, line.size)) + 4, 2 * int(line.size) + 2
    share = {"left": 0.0, "center": 0.5, "right": 1.0}[line.align]
    # Rounded so that a line moved by whole pixels looks the same.
    left = math.floor(line.x - share * (width - 4) + 0.5) - 2
    top = math.floor(line.y - height / 2 + 0.5)
    mask = Image.new("L", (_FINE * width, _FINE * height))
    font = _font(round(_FINE * line.size))
    ImageDraw.Draw(mask).text((2 * _FINE, _FINE * height / 2), line.text, 255, font, anchor="lm")
    cover = np.asarray(mask.reduce(_FINE))
    rows = slice(max(top, 0), min(top + height, sheet.shape[0]))
    columns = slice(max(left, 0), min(left + width, sheet.shape[1]))
    alpha = cover[rows.start - top : rows.stop - top, columns.start - left : columns.stop - left]
    under = sheet[rows, columns]
    mixed = under + alpha[..., None] / 255 * (np.array(line.color or ink, float) - under)
    sheet[rows, columns] = np.round(mixed)
