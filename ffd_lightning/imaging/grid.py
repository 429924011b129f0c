"""Pictures in a grid with headings and labels, and the one writer of PNG."""

import io
import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

Picture = NDArray[np.uint8]
"""(H, W, 3) or (H, W, 4), alpha ignored."""
Color = tuple[int, int, int]
"""sRGB, 0 to 255."""

_GAP = 4  # pixels between pictures
_LEADING = 1.4  # of the font's size, from line to line
_FINE = 4  # letters are drawn at this many times their size: whole pixels would space them unevenly
_SMALLEST = 0.75  # of a font's size, for lines that are too wide
_ELLIPSIS = "\N{HORIZONTAL ELLIPSIS}"


def grid(
    pictures: Sequence[Picture | Image.Image],
    columns: int,
    labels: Sequence[str] | None = None,
    headings: Sequence[str] | None = None,
    font_size: int = 10,
) -> Image.Image:
    """Draw pictures in rows on white, each with its label below it.

    Args:
        pictures: cells take the largest size.
        columns: pictures per row.
        labels: one text per picture, of one or more lines, centred; a line that is wider than its
            cell is set smaller, and of one that is much wider the middle is left out.
        headings: one text per column, centred above it.
        font_size: of labels, pixels; headings are a fifth larger.
    """
    cells = [p if isinstance(p, Image.Image) else Image.fromarray(p[..., :3]) for p in pictures]
    wide, high = max(cell.width for cell in cells), max(cell.height for cell in cells)
    large = round(1.2 * font_size)
    strip, top = _strip(labels, font_size), _strip(headings, large)
    across = columns if headings else min(columns, len(cells))
    rows = -(-len(cells) // columns)
    size = across * (wide + _GAP) + _GAP, top + rows * (high + strip + _GAP) + _GAP
    sheet = Image.new("RGB", size, "white")
    for k, heading in enumerate(headings or ()):
        _write_lines(sheet, heading, _GAP + k * (wide + _GAP), _GAP, wide, large)
    for k, (cell, label) in enumerate(zip(cells, labels or [""] * len(cells), strict=True)):
        x = _GAP + k % columns * (wide + _GAP)
        y = _GAP + top + k // columns * (high + strip + _GAP)
        sheet.paste(cell, (x, y))
        _write_lines(sheet, label, x, y + high, wide, font_size)
    return sheet


def legend(entries: Mapping[str, Color], width: int, font_size: int) -> Image.Image:
    """Write words with a square of their colour before each, in as many lines as it takes."""
    places: list[tuple[str, Color, int, int]] = []
    x = y = margin = font_size // 2
    for text, color in entries.items():
        length = round(text_width(text, font_size)) + 3 * font_size
        if x > margin and x + length > width:
            x, y = margin, y + 2 * font_size
        places.append((text, color, x, y))
        x += length
    picture = Image.new("RGB", (width, y + 2 * font_size), "white")
    for text, color, x, y in places:
        picture.paste(color, (x, y, x + font_size, y + font_size))
        write(picture, text, x + 1.5 * font_size, y + font_size / 2, font_size)
    return picture


def joined(pictures: Sequence[Image.Image], across: bool = False) -> Image.Image:
    """Return pictures as one: from top to bottom, or from left to right."""
    widths, heights = zip(*(picture.size for picture in pictures), strict=True)
    size = (sum(widths), max(heights)) if across else (max(widths), sum(heights))
    result, place = Image.new("RGB", size, "white"), 0
    for picture in pictures:
        result.paste(picture, (place, 0) if across else (0, place))
        place += picture.width if across else picture.height
    return result


def write(
    picture: Image.Image, text: str, x: float, y: float, size: float, color: Color = (0, 0, 0)
) -> None:
    """Write a line of text into a picture, from x on and halfway up at y; all in pixels."""
    width, height = int(text_width(text, size)) + 4, 2 * int(size) + 2
    mask = Image.new("L", (_FINE * width, _FINE * height))
    font = _font(round(_FINE * size))
    ImageDraw.Draw(mask).text((2 * _FINE, _FINE * height / 2), text, 255, font, anchor="lm")
    place = math.floor(x + 0.5) - 2, math.floor(y - height / 2 + 0.5)
    picture.paste(color, place, mask.reduce(_FINE))


def text_width(text: str, size: float) -> float:
    """Return how wide a line of text is, in pixels, its font being `size` pixels."""
    return float(_font(100).getlength(text)) * size / 100


def png(picture: Picture | Image.Image, colors: int | None = None, **options: Any) -> bytes:
    """Return a picture, with its alpha, as PNG; a palette of few colors takes a third of the bytes.

    Other options are Pillow's.
    """
    image = picture if isinstance(picture, Image.Image) else Image.fromarray(picture)
    if colors is not None:
        method = Image.Quantize.FASTOCTREE if image.mode == "RGBA" else None
        image = image.quantize(colors, method)
    buffer = io.BytesIO()
    image.save(buffer, "PNG", optimize=True, **options)
    return buffer.getvalue()


def _strip(texts: Sequence[str] | None, size: int) -> int:
    """Return the height that the texts of a row need."""
    return round(_LEADING * size * max((text.count("\n") + 1 for text in texts or ()), default=0))


def _write_lines(sheet: Image.Image, text: str, x: int, y: int, width: int, size: int) -> None:
    """Write a text centred in a strip of this width from (x, y) down."""
    for k, line in enumerate(text.split("\n")):
        fitting = size * min(1.0, max(_SMALLEST, width / max(text_width(line, size), 1.0)))
        shown = _shortened(line, width, fitting)
        left = x + (width - text_width(shown, fitting)) / 2
        write(sheet, shown, left, y + _LEADING * size * (k + 0.5), fitting)


def _shortened(line: str, width: int, size: float) -> str:
    """Return a line that fits: of too long a one the middle is left out."""
    shown, kept = line, len(line)
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
