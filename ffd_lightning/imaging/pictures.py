"""Bringing pictures of any size to the network's: read, cut out, fitted, padded with white."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps

from ffd_lightning.errors import RejectedShapeError, is_bug, is_of_machine

FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "GIF")
"""Of Pillow's, those that data sets' pictures are read in."""

MAX_PIXELS = 60_000_000
"""Of a photograph; larger ones are not decoded. Phones make up to 50 million."""

OBJECT_FILL = 0.82
"""How large objects are in rendered training images: the larger side of their box in pixels / the
image's height, which the renderer fits their bounding sphere into.

Measured as the median of 60 procedural shapes, ten each of chair, table, sofa, cabinet, lamp and
bench, by the default `RenderSettings` where coverage is above a half: 0.823. Half of them lie in
[0.74, 0.86]; the categories' medians are 0.82 or 0.83, but for the lamps' 0.71. The larger of the
box's height / the image's and its width / the image's says less: 0.64 for sofas, 0.83 for chairs.
"""


def object_fill(images: Iterable[NDArray[np.uint8]]) -> float:
    """Return how large objects are in images: the median of the larger side of their boxes.

    Args:
        images: (H, W, 4) uint8 each, the last channel the coverage.

    Returns:
        In units of the image's height; 1 where no image shows anything.

    >>> image = np.zeros((10, 20, 4), np.uint8)
    >>> image[2:5, 4:10, 3] = 255
    >>> object_fill([image])
    0.6
    """
    fills = []
    for image in images:
        ends = [np.flatnonzero((image[..., 3] > 127).any(axis=axis)) for axis in (0, 1)]
        if len(ends[0]):
            fills.append(max(int(end[-1] - end[0]) + 1 for end in ends) / len(image))
    return float(np.median(fills)) if fills else 1.0


def open_picture(path: Path | io.BytesIO, formats: tuple[str, ...] = FORMATS) -> Image.Image:
    """Read a picture's header, and nothing of its pixels.

    Args:
        path: of the file, or its content.
        formats: of Pillow's, those that it may be in.

    Raises:
        DecompressionBombError: it has more than `MAX_PIXELS`.
        OSError, SyntaxError, ValueError: what Pillow raises for files it cannot read.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of bombs, where our limit is lower, and of metadata
        picture = Image.open(path, formats=formats)
    if picture.width * picture.height > MAX_PIXELS:
        picture.close()
        raise Image.DecompressionBombError(
            f"{picture.width:,} x {picture.height:,} pixels, more than {MAX_PIXELS:,}"
        )
    return picture


def fit_picture(
    picture: Image.Image, height: int, width: int, fill: float | None = None
) -> NDArray[np.uint8]:
    """Fit a picture into (height, width) without distorting it, centred on white.

    Args:
        picture: any mode; what its alpha says is see-through becomes white.
        height: of the result, in pixels.
        width: of the result, in pixels.
        fill: the picture's larger side as a share of `height`, where it fits then; None makes it as
            large as it can be.

    Returns:
        RGB over white and coverage, (height, width, 4) uint8: what prepared sets hold.
    """
    rgba = to_rgba(picture)
    flat = over_white(rgba)
    scale = min(height / rgba.height, width / rgba.width)
    if fill is not None:
        scale = min(scale, fill * height / max(rgba.size))
    size = max(1, round(rgba.width * scale)), max(1, round(rgba.height * scale))
    corner = (width - size[0]) // 2, (height - size[1]) // 2
    result = Image.new("RGBA", (width, height), (255, 255, 255, 0))
    inner = flat.resize(size, Image.Resampling.LANCZOS)
    inner.putalpha(rgba.getchannel("A").resize(size, Image.Resampling.LANCZOS))
    result.paste(inner, corner)
    return np.asarray(result)


def to_rgba(picture: Image.Image) -> Image.Image:
    """Return a picture of any mode as RGBA; 16-bit grey is scaled, where Pillow would clip it."""
    if picture.mode.startswith("I"):
        grey = np.clip(np.asarray(picture, np.int64), 0, 65535) // 257
        picture = Image.fromarray(grey.astype(np.uint8))
    return picture if picture.mode == "RGBA" else picture.convert("RGBA")


def cut_out(root: Path, img: str, mask: str, box: Sequence[float]) -> Image.Image:
    """Cut the object that a mask shows out of a photograph.

    A photograph that is of another size than its mask, and not once it is turned as its EXIF data
    ask for, is turned so. In all other cases the data are ignored: a mask that fits was drawn on
    the pixels as they are stored, and many programs leave the request in after they made the turn.

    Args:
        root: the folder that the files are in.
        img: the photograph, of any mode.
        mask: of any mode; what is brighter than half its brightest pixel is the object. So masks
            of 0 and 1 will do, and those that a JPEG has blurred.
        box: left, top, right, bottom in pixels; what lies more than a pixel outside is not taken.

    Returns:
        RGBA, the mask as alpha, of the size of the object.

    Raises:
        RejectedShapeError: a file is missing, damaged or larger than `MAX_PIXELS`, the sizes
            differ, or the mask shows nothing in the box.
    """
    drawn = _read(root, mask)
    photo = _read(root, img, drawn.size)
    if photo.size != drawn.size:
        (a, b), (c, d) = drawn.size, photo.size
        raise RejectedShapeError(f"its mask has {a} x {b} pixels, its photograph {c} x {d}")
    shown = np.asarray(drawn)
    left, top = (max(0, int(edge - 1)) for edge in box[:2])
    right, bottom = (max(0, int(edge + 1)) for edge in box[2:])
    inside = shown[top:bottom, left:right] > int(shown.max()) / 2
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        raise RejectedShapeError("its mask is empty")
    inside = inside[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    x, y = left + int(columns[0]), top + int(rows[0])
    result = photo.crop((x, y, x + inside.shape[1], y + inside.shape[0]))
    result = (over_white(result) if result.mode == "RGBA" else result).convert("RGB")
    result.putalpha(Image.fromarray(np.where(inside, np.uint8(255), np.uint8(0))))
    return result


def _read(root: Path, name: str, size: tuple[int, int] | None = None) -> Image.Image:
    """Decode a mask as L or, where the `size` of its mask is given, a photograph as RGB or RGBA."""
    try:
        picture: Image.Image = open_picture(root / name)
        with picture:
            picture.load()
        if picture.mode.startswith("I"):
            picture = to_rgba(picture)
        if size is None:
            return picture.convert("L")
        if picture.size != size == picture.size[::-1]:
            picture = ImageOps.exif_transpose(picture)
        mode = "RGBA" if picture.has_transparency_data else "RGB"
        return picture if picture.mode == mode else picture.convert(mode)
    except FileNotFoundError:
        raise RejectedShapeError(f"it has no {name}") from None
    except Image.DecompressionBombError as error:
        raise RejectedShapeError(f"{name} is too large: {error}") from None
    except Exception as error:  # Pillow meets anything in a damaged file
        if is_bug(error) or is_of_machine(error):
            raise
        reason = f"{type(error).__name__}: {error}"
        raise RejectedShapeError(f"{name} cannot be read ({reason})") from error


def over_white(rgba: Image.Image) -> Image.Image:
    """Return a picture laid over white: RGBA, opaque."""
    flat = Image.new("RGBA", rgba.size, "white")
    flat.alpha_composite(rgba)
    return flat
