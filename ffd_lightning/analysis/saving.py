"""Writing figures into files, all alike."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import matplotlib
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
    """Write a figure, whole or not at all: PNG at 200 dpi, plots also as PDF and SVG.

    Args:
        figure: of Matplotlib, or a sheet of pictures and words.
        path: with one of `FORMATS` as its ending, `.png` for a sheet; without an ending a plot is
            written as PNG and PDF, a sheet as PNG.

    Returns:
        The files.

    Raises:
        ConfigError: another ending.
        DataError: a file cannot be written.
    """
    ending = path.suffix.lower()
    formats = FORMATS[:1] if isinstance(figure, Sheet) else FORMATS
    if ending and ending not in formats:
        raise ConfigError(f"{path}: it is written as {', '.join(formats)}")
    files = [path] if ending else [path.with_suffix(x) for x in formats if x != ".svg"]
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
    if isinstance(figure, Sheet):  # pixel by pixel as it was drawn
        Image.fromarray(figure.draw()).save(buffer, "PNG", optimize=True, dpi=(DPI, DPI))
        return buffer.getvalue()
    with matplotlib.rc_context(STYLE):
        figure.savefig(buffer, format=ending[1:], dpi=DPI, metadata=_METADATA[ending])
    return buffer.getvalue()
