"""Reading photographs: upright, RGB or RGBA."""

import contextlib
import io
import warnings
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps, UnidentifiedImageError

from ffd_lightning.errors import DataError

Bytes: TypeAlias = NDArray[np.uint8]
Photo: TypeAlias = str | Path | bytes | Image.Image | Bytes
"""A file, a file's content, PIL's picture, or (H, W) or (H, W, 3 or 4) uint8."""

MAX_PIXELS = 60_000_000
"""Of a photograph; larger ones are not decoded. Phones make up to 50 million."""

FORMATS = ("PNG", "JPEG", "WEBP", "AVIF", "BMP", "GIF", "TIFF", "PPM")


def read_photo(source: Photo, name: str = "the photograph") -> Image.Image:
    """Read a photograph; files are PNG, JPEG, WebP, AVIF, BMP, GIF, TIFF, PPM.

    Args:
        source: a photograph, or any picture.
        name: what messages call it, if it is no file.

    Returns:
        Upright, RGB or RGBA; of several frames the first. Colour profiles are ignored.

    Raises:
        DataError: there is no such file, or it cannot be read, has no pixels or is no picture; the
            message names it and says why.
    """
    name = str(source) if isinstance(source, str | Path) else name
    content = source if isinstance(source, bytes) else b""
    try:
        if isinstance(source, str | Path):
            if not Path(source).is_file():
                raise OSError("it is not a file")  # reading a pipe would wait for ever
            content = Path(source).read_bytes()
        if isinstance(source, str | Path | bytes):
            return _upright(_opened(content))
        if not isinstance(source, Image.Image):
            source = _of_array(np.asarray(source))
        return _upright(source)  # a file may be decoded only now
    except UnidentifiedImageError:
        kind = "HEIC, which is not read" if content[4:8] == b"ftyp" else "no picture, or damaged"
        raise DataError(f"{name} is {kind}: save it as JPEG or PNG") from None
    except Exception as error:  # Pillow meets anything in a damaged file
        raise DataError(f"{name} cannot be read ({reason_of(error)})") from error


def _opened(content: bytes) -> Image.Image:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of large pictures, where our limit is lower
        picture = Image.open(io.BytesIO(content), formats=FORMATS)
    if picture.width * picture.height > MAX_PIXELS:
        size = f"{picture.width:,} x {picture.height:,} pixels"
        raise ValueError(f"{size}, more than {MAX_PIXELS:,}: make it smaller first")
    return picture


def _of_array(array: NDArray[Any]) -> Image.Image:
    of_bytes = array.dtype in (np.bool_, np.uint8)
    if not of_bytes or not (array.ndim == 2 or (array.ndim == 3 and array.shape[2] in (3, 4))):
        known = "an array is (H, W) or (H, W, 3 or 4) uint8"
        raise ValueError(f"{known}, this is {array.shape} {array.dtype}")
    return Image.fromarray(array)


def _upright(picture: Image.Image) -> Image.Image:
    """Return a picture as RGB or RGBA, turned as its EXIF data ask for."""
    picture.load()
    if 0 in picture.size:
        raise ValueError("it has no pixels")
    if picture.mode == "F" or picture.mode.startswith("I"):
        raise ValueError("it has more than 8 bits a pixel: save it with 8")  # Pillow clips them
    with contextlib.suppress(Exception), warnings.catch_warnings():  # of damaged EXIF data
        warnings.simplefilter("ignore")
        picture = ImageOps.exif_transpose(picture)
    result = picture.convert("RGBA" if picture.has_transparency_data else "RGB")
    result.info = {}  # what is done must not be done again
    return result


def to_rgba(picture: Image.Image) -> Image.Image:
    """Return a picture of any mode as RGBA; 16-bit grey is scaled, where Pillow would clip it."""
    if picture.mode.startswith("I"):
        grey = np.clip(np.asarray(picture, np.int64), 0, 65535) // 257
        picture = Image.fromarray(grey.astype(np.uint8))
    return picture.convert("RGBA")


def over_white(picture: Image.Image) -> Image.Image:
    """Return a picture laid over white: RGB."""
    if picture.mode != "RGBA":
        return picture
    flat = Image.new("RGBA", picture.size, "white")
    flat.alpha_composite(picture)
    return flat.convert("RGB")


def reason_of(error: BaseException) -> str:
    """Return what went wrong, on one line."""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}".rstrip(": ")
