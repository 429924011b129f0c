"""Bringing pictures of any size to the network's: read, cut out, fitted, padded with white."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms, ImageOps

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

ORIGIN = "origin"
"""The key in a picture's `info` that its `Origin` is kept under."""

_ORIENTATION = 0x0112  # the number of this field in EXIF data
_TURNS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}


@dataclass(frozen=True)
class Origin:
    """What became of a photograph while it was read.

    Attributes:
        name: of its file, for messages.
        size: width and height once upright, in the file's pixels; decoding may have made it less.
        orientation: by its EXIF data, 1 to 8; 1 was upright.
        steps: what was done, in words.
        warnings: what the user must know.
    """

    name: str
    size: tuple[int, int]
    orientation: int
    steps: tuple[str, ...]
    warnings: tuple[str, ...]

    def turn(self, picture: Image.Image) -> Image.Image:
        """Turn another picture as the photograph was turned."""
        turn = _TURNS.get(self.orientation)
        return picture if turn is None else picture.transpose(turn)


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


def open_picture(path: Path, formats: tuple[str, ...] = FORMATS) -> Image.Image:
    """Read a picture's header, and nothing of its pixels.

    Args:
        path: of the file.
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


def upright(
    picture: Image.Image, name: str = "the photograph", size: tuple[int, int] | None = None
) -> Image.Image:
    """Return a picture of any mode as RGB or RGBA in sRGB, turned as its EXIF data ask for.

    Args:
        picture: as opened; of several frames the current one, which is the first, is taken.
        name: for the `Origin`.
        size: width and height in the file, where decoding makes it less.

    Returns:
        Of mode RGB, or RGBA where anything may be see-through; its `Origin` is in its `info`. What
        was returned here before is returned as it is.

    Raises:
        ValueError: its values cannot be shown, as those of a float TIFF that are not finite.
        OSError, SyntaxError: what Pillow raises for damaged files.
    """
    if isinstance(picture.info.get(ORIGIN), Origin):
        return picture
    steps: list[str] = []
    cautions: list[str] = []
    if picture.format != "MPO" and getattr(picture, "is_animated", False):  # MPO: previews, depths
        cautions.append("several frames: the first is used")
    picture.load()
    profile = picture.info.get("icc_profile")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of what is missing from the data
            orientation = picture.getexif().get(_ORIENTATION, 1)
    except Exception:  # Pillow's reader of metadata meets anything in a damaged file
        orientation = 1
        cautions.append("EXIF data cannot be read: it may lie on its side")
    if orientation not in _TURNS:
        orientation = 1
    else:
        steps.append(f"turned upright (EXIF orientation {orientation})")
    result = _in_srgb(_eight_bit(picture, steps), profile, steps)
    width, height = size or picture.size
    full = (height, width) if orientation >= 5 else (width, height)
    if picture.width < (size or picture.size)[0]:
        steps.append(f"decoded at {picture.width / (size or picture.size)[0]:.3g} of its size")
    origin = Origin(name, full, orientation, tuple(steps), tuple(cautions))
    result = origin.turn(result)
    result.info = {ORIGIN: origin}
    return result


def _eight_bit(picture: Image.Image, steps: list[str]) -> Image.Image:
    """Return pictures of wider values as L, others as they are."""
    if picture.mode.startswith("I"):
        steps.append("16-bit grey levels brought to 8 bits")
        return to_rgba(picture).convert("L")
    if picture.mode != "F":
        return picture
    values = np.asarray(picture)
    top = float(values.max(initial=0))
    if not np.isfinite(values).all() or top > 65535:
        raise ValueError("its values are not finite numbers of 65,535 at most")
    unit = next(unit for unit in (1, 255, 65535) if top <= unit)
    steps.append(f"values from 0 to {unit} brought to 8 bits")
    return Image.fromarray(np.round(values.clip(0) / unit * 255).astype(np.uint8))


def _in_srgb(picture: Image.Image, profile: bytes | None, steps: list[str]) -> Image.Image:
    """Return a new picture, RGB or RGBA, with its colours in sRGB as far as a profile can say."""
    if picture.mode == "La":
        picture = picture.convert("LA")
    mode = "RGBA" if picture.has_transparency_data else "RGB"
    result = picture.copy() if picture.mode == mode else picture.convert(mode)
    if not profile:
        return result
    colours = picture if picture.mode in ("L", "CMYK", "LAB") else result.convert("RGB")
    try:
        embedded = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        name = " ".join(ImageCms.getProfileDescription(embedded).split())[:60]
        if "srgb" in name.lower():
            return result
        srgb = ImageCms.createProfile("sRGB")
        converted = ImageCms.profileToProfile(colours, embedded, srgb, outputMode="RGB")
        assert converted is not None  # it is made in place only where that is asked for
    except (ImageCms.PyCMSError, OSError, ValueError):
        steps.append("its colour profile cannot be used and is ignored")
        return result
    steps.append(f"colours brought to sRGB from its profile ({name})")
    if mode == "RGBA":
        converted.putalpha(result.getchannel("A"))
    return converted
