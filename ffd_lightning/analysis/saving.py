"""Writing figures into files, all alike."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from ffd_lightning.analysis.plot_layout import STYLE
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.imaging.sheet import Sheet

DPI = 200
FORMATS = (".png", ".pdf", ".svg")
_METADATA: dict[str, Any] = {
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None},
    ".svg": {"Date": None, "Creator": None},
}  # so that the same figure gives the same bytes


def save_figure(figure: Figure | Sheet, path: Path) -> list[Path]:
    """Write a figure, whole or not at all: PNG at 200 dpi, PDF and SVG with letters as vectors.

    Args:
        figure: of Matplotlib, or a sheet of pictures and words.
        path: with one of `FORMATS` as its ending; without an ending a PNG and a PDF are written.

    Returns:
        The files.

    Raises:
        ConfigError: another ending.
        DataError: a file cannot be written.
    """
    ending = path.suffix.lower()
    if ending and ending not in FORMATS:
        raise ConfigError(f"{path}: figures are written as {', '.join(FORMATS)}")
    files = [path] if ending else [path.with_suffix(".png"), path.with_suffix(".pdf")]
    for file in files:
        content = _content(figure, file.suffix.lower())
        try:
            write_bytes_atomic(file, content)
        except OSError as error:
            raise DataError(f"cannot write {file}: {error.strerror or error}") from None
    return files


def _content(figure: Figure | Sheet, ending: str) -> bytes:
    """Return what a file with this ending holds."""
    buffer = io.BytesIO()
    if isinstance(figure, Sheet) and ending == ".png":  # pixel by pixel as it was drawn
        Image.fromarray(figure.draw()).save(buffer, "PNG", optimize=True, dpi=(DPI, DPI))
        return buffer.getvalue()
    with matplotlib.rc_context(STYLE):
        drawn = sheet_figure(figure) if isinstance(figure, Sheet) else figure
        drawn.savefig(buffer, format=ending[1:], dpi=DPI, metadata=_METADATA[ending])
    return buffer.getvalue()


def sheet_figure(sheet: Sheet) -> Figure:
    """Return a sheet as a figure of Matplotlib, at 200 pixels an inch; its words stay words."""
    size = np.array([sheet.width, sheet.height])
    grey = str(sheet.background / 255)
    figure = Figure(figsize=tuple(size / DPI), dpi=DPI, facecolor=grey)
    for picture, x, y in sheet.pictures:
        height, width = picture.shape[:2]
        box = (x, sheet.height - y - height, width, height)
        axes = figure.add_axes(tuple(np.array(box) / np.tile(size, 2)))
        axes.imshow(picture[..., :3], interpolation="none", aspect="auto")
        axes.set_axis_off()
    for line in sheet.lines:
        figure.text(
            line.x / sheet.width,
            1 - line.y / sheet.height,
            line.text,
            color=np.array(line.color or sheet.ink) / 255,
            fontsize=72 * line.size / DPI,
            ha=line.align,
            va="center",
            parse_math=False,
        )
    return figure
