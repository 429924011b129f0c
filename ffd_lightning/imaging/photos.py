"""Reading photographs: upright, RGB or RGBA."""

from __future__ import annotations

import io
import stat
import warnings
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, UnidentifiedImageError

from ffd_lightning.errors import DataError, is_bug
from ffd_lightning.imaging.pictures import FORMATS, open_picture

Bytes: TypeAlias = NDArray[np.uint8]

_FORMATS = (*FORMATS, "TIFF", "PPM")


def read_photo(source: str | Path | bytes, name: str = "") -> Image.Image:
    """Read a photograph: PNG, JPEG, WebP, BMP, GIF, TIFF or PPM.

    Args:
        source: the file, or its content.
        name: for messages; by default the file's.

    Returns:
        Upright, RGB or RGBA; of several frames the first. Colour profiles are ignored.

    Raises:
        DataError: there is no such file, or it cannot be read; the message names it and says why.
    """
    content = source if isinstance(source, bytes) else b""
    name = name or ("the photograph" if isinstance(source, bytes) else str(source))
    try:
        if not isinstance(source, bytes):
            if not stat.S_ISREG(Path(source).stat().st_mode):
                raise DataError(f"{name} is not a file")  # reading a pipe would wait for ever
            content = Path(source).read_bytes()
        with open_picture(io.BytesIO(content), _FORMATS) as picture:
            return _upright(picture)
    except DataError:
        raise
    except UnidentifiedImageError:
        raise DataError(f"{name} {_unknown_kind(content)}") from None
    except Image.DecompressionBombError as error:
        raise DataError(f"{name} is too large ({error}): make it smaller first") from None
    except Exception as error:  # Pillow meets anything in a damaged file
        if is_bug(error):
            raise
        raise DataError(f"{name} cannot be read ({reason_of(error)})") from error


def as_photo(picture: Image.Image | Bytes) -> Image.Image:
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
        return Image.fromarray(values)
    try:
        return _upright(picture)
    except Exception as error:  # it may be decoded only now: see `read_photo`
        if is_bug(error):
            raise
        raise DataError(f"the photograph cannot be read ({reason_of(error)})") from error


def _upright(picture: Image.Image) -> Image.Image:
    """Return a picture as RGB or RGBA, turned as its EXIF data ask for."""
    picture.load()
    if picture.mode == "F" or picture.mode.startswith("I"):
        raise ValueError("it has more than 8 bits a pixel: save it with 8")  # Pillow clips them
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what is missing from the data
            picture = ImageOps.exif_transpose(picture)
    except Exception as error:  # Pillow's reader of metadata meets anything in a damaged file
        if isinstance(error, MemoryError):
            raise
    picture = picture.convert("LA") if picture.mode == "La" else picture
    result = picture.convert("RGBA" if picture.has_transparency_data else "RGB")
    result.info = {}  # what is done must not be done again
    return result


def reason_of(error: Exception) -> str:
    """Return what went wrong, on one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}".rstrip(": ")


def _unknown_kind(content: bytes) -> str:
    """Return what to say of a file that Pillow does not know."""
    if not content:
        return "is empty"
    if content[4:8] == b"ftyp":
        return "is HEIC or AVIF, which are not read: save it as JPEG or PNG"
    return "is no picture, or damaged from its start on: save it as JPEG or PNG"
