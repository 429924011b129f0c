"""Writing figures into files, all alike."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from ffd_lightning.analysis.plots import DPI, FORMATS, to_bytes
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.imaging.grid import png


def save_figure(figure: Figure | Image.Image, path: Path) -> list[Path]:
    """Write a plot as PNG at 200 dpi, PDF or SVG, or a picture as PNG, whole or not at all.

    Without one of those endings a plot is written as PNG and PDF. Returns the files.

    Raises:
        ConfigError: another ending.
        DataError: a file cannot be written.
    """
    ending = path.suffix.lower()
    formats = list(FORMATS) if isinstance(figure, Figure) else [".png"]
    if ending and ending not in formats:
        raise ConfigError(f"{path}: it is written as {', '.join(formats)}")
    files = [path] if ending else [path.with_suffix(each) for each in formats[:2]]
    for file in files:
        if isinstance(figure, Figure):
            content = to_bytes(figure, file.suffix.lower())
        else:
            content = png(figure, dpi=(DPI, DPI))
        try:
            write_bytes_atomic(file, content)
        except OSError as error:
            raise DataError(f"cannot write {file}: {error.strerror or error}") from None
    return files
