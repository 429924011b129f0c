"""Any photograph -> the image that the network was trained on: on white, framed as training's."""

from __future__ import annotations

import functools
import math
import stat
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from ffd_lightning.errors import ConfigError, DataError, is_bug
from ffd_lightning.imaging.background import as_bytes, border_ring, main_parts, split_by_border
from ffd_lightning.imaging.pictures import (
    FORMATS,
    ORIGIN,
    Origin,
    open_picture,
    over_white,
    upright,
)

Background = Literal["auto", "rembg"]
"""What tells a photograph's object from its background, where no mask is given: its alpha channel,
else the colour of its border (`auto`), or the network of the package rembg."""

Bytes = NDArray[np.uint8]
Floats = NDArray[np.floating[Any]]

_FORMATS = (*FORMATS, "TIFF", "PPM")
_READ_SIDE = 1536  # pixels; the longer side of a photograph is decoded at this or more
_WORK_SIDE = 512  # about that of what the border's colour is looked for in
_FILTER = Image.Resampling.LANCZOS
_MODEL = "isnet-general-use"  # of rembg: made for thin structures; its own default varies


@dataclass(frozen=True, eq=False)
class FramedPhoto:
    """What the network sees of a photograph, and how it came about.

    Attributes:
        image: (height, width, 4) uint8: RGB over white, which the network sees, and coverage.
        steps: what was done, in words, in order; pixels are those of the upright photograph.
        warnings: what the user must know before the result is trusted.
    """

    image: Bytes
    steps: tuple[str, ...]
    warnings: tuple[str, ...]


@dataclass(frozen=True)
class _Cut:
    """A photograph with its background turned white.

    Attributes:
        rgb: (h, w, 3) over white.
        coverage: (h, w), 255 where the object is.
        name: of the photograph, for messages.
        scale: its own pixels per pixel of this.
        corner: x and y of this in the photograph, in its own pixels.
        steps, warnings: see `FramedPhoto`.
    """

    rgb: Bytes
    coverage: Bytes
    name: str
    scale: float
    steps: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    corner: tuple[float, float] = (0.0, 0.0)


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
            less = max(1, max(size) // _READ_SIDE)
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
        raise DataError(f"{path} cannot be read ({_reason(error)})") from error


def frame_photo(
    picture: Image.Image | Bytes,
    *,
    height: int,
    width: int,
    fill: float,
    mask: Image.Image | None = None,
    background: Background = "auto",
) -> FramedPhoto:
    """Cut the object out of a photograph, lay it on white and frame it as in training images.

    The object is what `mask` shows; else what the photograph's alpha channel shows; else what does
    not have the border's colour, which may change smoothly over the picture. A picture of the
    network's size that looks like a training image is taken as it is.

    Args:
        picture: from `read_photo`, any other, or (H, W, 3 or 4) uint8.
        height: of the result, in pixels.
        width: of the result, in pixels.
        fill: the larger side of the object's box in pixels / `height`, see `OBJECT_FILL`.
        mask: of any mode: what is bright is the object, or what is opaque where alpha varies.
        background: `rembg` lets that package find the object.

    Raises:
        DataError: the picture or the mask cannot be used, or no object is found.
        ConfigError: rembg is asked for but is not installed or has no weights.
    """
    photo = _as_picture(picture)
    origin = photo.info[ORIGIN]
    if mask is not None:
        cut = _cut_by_mask(photo, mask)
    elif background == "rembg":
        cut = _cut_by_rembg(photo)
    elif photo.mode == "RGBA" and np.asarray(photo.getchannel("A")).min() < 128:
        cut = _cut_by_alpha(photo)
    else:
        cut = _cut_by_border(photo)
        cut = _closer(cut, photo, fill * height)
    cut = replace(cut, steps=origin.steps + cut.steps, warnings=origin.warnings + cut.warnings)
    box = _object_box(cut)
    given = mask is not None or background == "rembg"
    if not given and _is_training_image(photo, cut, box, height, width, fill):
        rgb = cut.rgb if photo.mode == "RGBA" else np.asarray(photo)
        step = "taken as it is: of the network's size, on white and framed already"
        return FramedPhoto(np.dstack([rgb, cut.coverage]), (*origin.steps, step), origin.warnings)
    return _fit(cut, box, height, width, fill)


# --- what the object is ---------------------------------------------------------------------------


def _cut_by_mask(photo: Image.Image, mask: Image.Image) -> _Cut:
    """Take for the object what a mask shows."""
    origin = photo.info[ORIGIN]
    flat = over_white(photo).convert("RGB") if photo.mode == "RGBA" else photo
    # Many times the network's size would only take memory.
    flat = flat.reduce(max(1, max(flat.size) // _READ_SIDE))
    levels = _mask_levels(mask, origin)
    if flat.size != levels.size:
        levels = levels.resize(flat.size, Image.Resampling.BOX)
    coverage, rgb = np.asarray(levels), np.asarray(flat)
    warnings = ["the mask covers all of it: nothing is cut out"] if coverage.min() > 127 else []
    return _Cut(
        _whitened(rgb, coverage),
        coverage,
        origin.name,
        origin.size[0] / flat.width,
        ("background: mask",),
        tuple(warnings),
    )


def _mask_levels(mask: Image.Image, origin: Origin) -> Image.Image:
    """Return a mask as L, its brightest level 255, turned and as large as the photograph."""
    own = mask.info.get(ORIGIN)
    size = own.size if isinstance(own, Origin) else mask.size
    if mask.mode != "F" and not mask.mode.startswith("I"):
        mask = upright(mask)
        alpha = mask.getchannel("A") if mask.mode == "RGBA" else None
        mask = alpha if alpha and len(set(alpha.getextrema())) > 1 else mask.convert("L")
    if mask.mode != "L":
        values = np.asarray(mask, np.float64)
        top = values.max(initial=0)
        if not np.isfinite(values).all():
            raise DataError(f"the mask of {origin.name} has values that are not finite")
        mask = Image.fromarray(np.round(values.clip(0) / max(top, 1e-9) * 255).astype(np.uint8))
    top = int(np.asarray(mask).max(initial=0))
    if top == 0:
        raise DataError(f"the mask of {origin.name} is empty: it must show the object bright")
    mask = mask.point([min(255, round(level * 255 / top)) for level in range(256)])
    if size != origin.size == size[::-1] and origin.orientation >= 5:
        mask, size = origin.turn(mask), size[::-1]
    if size != origin.size:
        (a, b), (c, d) = size, origin.size
        raise DataError(f"the mask has {a} x {b} pixels, {origin.name} {c} x {d}")
    return mask


def _cut_by_alpha(photo: Image.Image) -> _Cut:
    """Take for the object what is not see-through."""
    origin = photo.info[ORIGIN]
    rgba = np.asarray(photo)
    rgb, coverage = rgba[..., :3], rgba[..., 3]
    step = "background: alpha channel"
    # Rendered images are over white already: under alpha a, no channel is darker than 255 - a.
    if (rgb < 254 - coverage[..., None].astype(np.int16)).any():
        rgb = np.asarray(over_white(photo))[..., :3]
        step += ", laid over white"
    return _Cut(rgb, coverage, origin.name, _scale(photo), (step,))


def _cut_by_rembg(photo: Image.Image) -> _Cut:
    """Take for the object what the package rembg finds."""
    photo = _reduced(photo)
    rgb = (over_white(photo) if photo.mode == "RGBA" else photo).convert("RGB")
    module, session = _rembg()
    try:
        mask = module.remove(rgb, session=session, only_mask=True)
    except Exception as error:  # whatever a foreign network stumbles over
        raise ConfigError(f"background=rembg failed ({_reason(error)}): give mask=...") from error
    coverage = np.asarray(mask.convert("L"))
    step = f"background: rembg ({_MODEL})"
    name = photo.info[ORIGIN].name
    return _Cut(_whitened(np.asarray(rgb), coverage), coverage, name, _scale(photo), (step,))


@functools.cache
def _rembg() -> tuple[Any, Any]:
    """Return the module and a session with its network, downloaded at first use."""
    try:
        import rembg
    except (ImportError, SystemExit) as error:  # it exits where it finds no onnxruntime
        raise ConfigError(
            "background=rembg needs that package: pip install 'rembg[cpu]', or give mask=..."
        ) from error
    try:
        return rembg, rembg.new_session(_MODEL)
    except Exception as error:
        raise ConfigError(
            f"background=rembg cannot get the weights of {_MODEL} ({_reason(error)}): connect to "
            "the internet once, put the file where rembg looks for it, or give mask=..."
        ) from error


def _cut_by_border(photo: Image.Image) -> _Cut:
    """Take for the object what differs from the border's colour."""
    small = _reduced(photo)
    flat = over_white(small) if small.mode == "RGBA" else small
    found = split_by_border(np.asarray(flat, np.float32)[..., :3])
    step = f"background: border colour {found.colour}, {found.tolerance / 2.55:.1f}% tolerance"
    if found.specks:
        step += f", {found.specks} specks left out"
    warnings = [f"no mask was given: the border's colour {found.colour} decided what is background"]
    if not found.uniform:
        warnings.append(
            f"the background is not uniform ({100 * found.outside:.0f}% of the border has other "
            f"colours, it varies by {found.spread / 2.55:.1f}%): check the result, or give mask=..."
        )
    return _Cut(
        as_bytes(found.rgb),
        as_bytes(255 * found.coverage),
        photo.info[ORIGIN].name,
        _scale(small),
        (step,),
        tuple(warnings),
    )


def _closer(cut: _Cut, photo: Image.Image, wanted: float) -> _Cut:
    """Cut again at higher resolution, if the object is small in a photograph that was reduced.

    Args:
        cut: of the whole photograph.
        photo: as it was read.
        wanted: the object's larger side in the result, in pixels.
    """
    left, top, right, bottom = _object_box(cut)
    times, side = cut.scale / _scale(photo), max(right - left, bottom - top)
    if side >= wanted or times <= 1:
        return cut
    around = left - side / 2, top - side / 2, right + side / 2, bottom + side / 2
    x0, y0, x1, y1 = (round(edge * times) for edge in around)
    x0, y0, x1, y1 = max(0, x0), max(0, y0), min(photo.width, x1), min(photo.height, y1)
    again = _cut_by_border(photo.crop((x0, y0, x1, y1)))
    if not (again.coverage > 127).any():
        return cut
    less = (x1 - x0) / again.rgb.shape[1]
    corner = x0 * _scale(photo), y0 * _scale(photo)
    return replace(
        again, scale=less * _scale(photo), corner=corner, steps=cut.steps, warnings=cut.warnings
    )


# --- framing ------------------------------------------------------------------------------------


def _object_box(cut: _Cut) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the object: of more than specks of half coverage."""
    parts, _ = main_parts(cut.coverage > 127)
    rows, columns = (np.flatnonzero(parts.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        raise DataError(f"{cut.name}: no object found ({cut.steps[-1]}): give mask=...")
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _is_training_image(
    photo: Image.Image,
    cut: _Cut,
    box: tuple[int, int, int, int],
    height: int,
    width: int,
    fill: float,
) -> bool:
    """Tell whether a photograph is as the network was trained on already.

    Rendered objects fill between 0.6 and 1.2 times the usual, and the centres of their boxes lie
    within 0.15 of the height from the image's; half and 0.25 leave room.
    """
    if photo.size != (width, height):
        return False
    border = (cut.rgb if photo.mode == "RGBA" else np.asarray(photo))[border_ring((height, width))]
    left, top, right, bottom = box
    off = max(abs(left + right - width), abs(top + bottom - height)) / 2
    large = max(right - left, bottom - top) > 0.5 * fill * height
    return bool(border.min() >= 250) and large and off < 0.25 * height


def _fit(
    cut: _Cut, box: tuple[int, int, int, int], height: int, width: int, fill: float
) -> FramedPhoto:
    """Resize the surroundings of the object's box to the frame, with white beyond the picture."""
    left, top, right, bottom = box
    wide, high = right - left, bottom - top
    scale = min(fill * height / max(wide, high), width / wide, height / high)
    x, y = (left + right - width / scale) / 2, (top + bottom - height / scale) / 2
    x0, y0 = math.floor(x) - 1, math.floor(y) - 1
    size = math.ceil(x + width / scale) + 1 - x0, math.ceil(y + height / scale) + 1 - y0
    frame = (x - x0, y - y0, x - x0 + width / scale, y - y0 + height / scale)
    result = np.empty((height, width, 4), np.uint8)
    for values, white, channels in ((cut.rgb, (255,) * 3, np.s_[:3]), (cut.coverage, 0, 3)):
        canvas = Image.new("RGB" if values.ndim == 3 else "L", size, white)
        canvas.paste(Image.fromarray(values), (-x0, -y0))
        part = canvas.resize((width, height), _FILTER, frame, reducing_gap=3)
        result[..., channels] = np.asarray(part)
    sides = _sides_touched(cut.coverage)
    warnings = list(cut.warnings)
    if sides:
        warnings.append(f"the object touches the photograph's border ({', '.join(sides)})")
    a, b, c, d = (round(value * cut.scale) for value in (wide, high, left, top))
    c, d = c + round(cut.corner[0]), d + round(cut.corner[1])
    if scale > 1.2:
        warnings.append(f"the object has only {a} x {b} pixels: it is blurred")
    steps = (f"cropped to {a} x {b} at ({c}, {d})", f"resized by {scale / cut.scale:.3g}")
    return FramedPhoto(result, cut.steps + steps, tuple(warnings))


def _sides_touched(coverage: Bytes) -> list[str]:
    """Return at which sides of a picture the object ends."""
    edges = {"left": coverage[:, 0], "top": coverage[0], "right": coverage[:, -1]}
    edges["bottom"] = coverage[-1]
    return [side for side, edge in edges.items() if np.count_nonzero(edge > 127) > 0.01 * len(edge)]


def _as_picture(picture: Image.Image | Bytes) -> Image.Image:
    """Return any picture as `read_photo` would."""
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
        raise DataError(f"the photograph cannot be read ({_reason(error)})") from error


def _reduced(photo: Image.Image) -> Image.Image:
    """Return a photograph with a longer side of about `_WORK_SIDE`, if it is much larger."""
    times = max(1, round(max(photo.size) / _WORK_SIDE))
    small = photo.reduce(times) if times > 1 else photo
    small.info[ORIGIN] = photo.info[ORIGIN]
    return small


def _scale(small: Image.Image) -> float:
    """Return how many pixels of the file a pixel stands for."""
    return float(small.info[ORIGIN].size[0] / small.width)


def _whitened(rgb: Bytes, coverage: Bytes) -> Bytes:
    """Return a picture with white in place of what is not covered."""
    share = coverage[..., None].astype(np.float32) / 255
    return as_bytes(rgb * share + 255 * (1 - share))


def _reason(error: Exception) -> str:
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
