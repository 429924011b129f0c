"""Reading photographs: upright, in sRGB, no larger than is of use."""

from __future__ import annotations

import stat
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from ffd_lightning.errors import DataError, is_bug
from ffd_lightning.imaging.pictures import FORMATS, ORIGIN, open_picture, upright

Bytes: TypeAlias = NDArray[np.uint8]

READ_SIDE = 1536
"""Pixels; the longer side of a photograph is decoded at this or more."""

_FORMATS = (*FORMATS, "TIFF", "PPM")
_WORK_SIDE = 512  # about that of what the border's colour is looked for in


def read_photo(path: Path) -> Image.Image:
    """Read a photograph: PNG, JPEG, WebP, BMP, GIF, TIFF or PPM.

    Large JPEGs are decoded at a half, a quarter or an eighth of their size, with their longer side
    at 1,536 pixels or more: several times what the network sees.

    Returns:
        Upright, RGB or RGBA, in sRGB. Its `info` holds its `Origin`, where `frame_photo` finds the
        photograph's name and full size, and what was done to it.

    Raises:
        DataError: there is no such file, or it cannot be read; the message names it and says why.
    """
    path = Path(path)
    try:
        if not stat.S_ISREG(path.stat().st_mode):  # reading a pipe would wait for ever
            raise DataError(f"{path} is not a file")
        with open_picture(path, _FORMATS) as picture:
            size = picture.size
            less = max(1, max(size) // READ_SIDE)
            picture.draft(None, (max(1, size[0] // less), max(1, size[1] // less)))
            return upright(picture, str(path), size)
    except DataError:
        raise
    except UnidentifiedImageError:
        raise DataError(f"{path} {_unknown_kind(path)}") from None
    except Image.DecompressionBombError as error:
        raise DataError(f"{path} is too large ({error}): make it smaller first") from None
    except Exception as error:  # Pillow meets anything in a damaged file
        if is_bug(error):
            raise
        raise DataError(f"{path} cannot be read ({reason_of(error)})") from error


def as_picture(picture: Image.Image | Bytes) -> Image.Image:
    """Return any picture as `read_photo` would.

    Args:
        picture: PIL's, or (H, W, 3 or 4) uint8: RGB, and coverage as alpha.

    Raises:
        DataError: it is none, has no pixels, or cannot be decoded.
    """
    if not isinstance(picture, Image.Image):
        values = np.asarray(picture)
        if values.dtype != np.uint8 or values.ndim != 3 or values.shape[2] not in (3, 4):
            raise DataError(
                f"a photograph is (H, W, 3 or 4) of uint8, got {values.shape} of {values.dtype}"
            )
        if 0 in values.shape:
            raise DataError(f"the photograph has no pixels: {values.shape}")
        picture = Image.fromarray(values)
    try:
        return upright(picture)
    except Exception as error:  # it may be decoded only now: see `read_photo`
        if is_bug(error):
            raise
        raise DataError(f"the photograph cannot be read ({reason_of(error)})") from error


def reduced(photo: Image.Image) -> Image.Image:
    """Return a photograph with a longer side of about `_WORK_SIDE`, if it is much larger."""
    times = max(1, round(max(photo.size) / _WORK_SIDE))
    small = photo.reduce(times) if times > 1 else photo
    small.info[ORIGIN] = photo.info[ORIGIN]
    return small


def scale_of(small: Image.Image) -> float:
    """Return how many pixels of the file a pixel stands for."""
    return float(small.info[ORIGIN].size[0] / small.width)


def reason_of(error: Exception) -> str:
    """Return what went wrong, on one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}".rstrip(": ")


def _unknown_kind(path: Path) -> str:
    """Return what to say of a file that Pillow does not know."""
    with path.open("rb") as file:
        start = file.read(12)
    if not start:
        return "is empty"
    if start[4:8] == b"ftyp":
        return "is HEIC or AVIF, which are not read: save it as JPEG or PNG"
    return "is no picture, or damaged from its start on: save it as JPEG or PNG"
