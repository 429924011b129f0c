"""Any photograph -> the image that the network was trained on: on white, framed as training's."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from PIL import Image

from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.background import (
    as_bytes,
    border_ring,
    main_parts,
    split_by_border,
)
from ffd_lightning.imaging.objects import main_object
from ffd_lightning.imaging.photos import Bytes, as_photo, reason_of
from ffd_lightning.imaging.pictures import over_white

Background = Literal["auto", "rembg"]
"""What tells a photograph's object from its background, where no mask is given: its alpha channel,
else the colour of its border (`auto`), or the network of the package rembg."""

_MODEL = "isnet-general-use"  # of rembg: made for thin structures; its own default varies
_FILTER = Image.Resampling.LANCZOS
_LARGEST = 1536  # longer side of what is cut by a mask: several times what the network sees
_WORK_SIDE = 512  # about that of what the border's colour is looked for in


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


def frame_photo(
    picture: Image.Image | Bytes,
    *,
    height: int,
    width: int,
    fill: float,
    whole: bool = True,
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
        fill: the larger side of the object's box in pixels / `height`, see `pictures.object_fill`.
        whole: no object is cut off in training images.
        mask: of the upright photograph's size: what is bright is the object, or what is opaque
            where alpha varies.
        background: `rembg` lets that package find the object.

    Raises:
        DataError: the picture or the mask cannot be used, or no object is found.
        ConfigError: rembg is asked for but is not installed or has no weights.
    """
    photo = as_photo(picture)
    cut = _cut_object(photo, mask, background, fill * height)
    box = _object_box(cut)
    given = mask is not None or background == "rembg"
    same_size = photo.size == (width, height)
    if same_size and not given and _is_training_image(photo, cut, box, whole):
        rgb = cut.rgb if photo.mode == "RGBA" else np.asarray(photo)
        step = "taken as it is: of the network's size, on white and framed already"
        return FramedPhoto(np.dstack([rgb, cut.coverage]), (step,), ())
    return _fit(cut, box, height, width, fill)


@dataclass(frozen=True)
class _Cut:
    """A photograph with its background turned white.

    Attributes:
        rgb: (h, w, 3) over white.
        coverage: (h, w), 255 where the object is.
        scale: the photograph's pixels per pixel of this.
        steps, warnings: see `FramedPhoto`.
        corner: x and y of this in the photograph, in its pixels.
    """

    rgb: Bytes
    coverage: Bytes
    scale: float
    steps: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    corner: tuple[int, int] = (0, 0)


def _cut_object(
    photo: Image.Image, mask: Image.Image | None, background: Background, wanted: float
) -> _Cut:
    """Cut the object out of a photograph.

    Args:
        photo: upright.
        mask: what shows the object; None lets `background` tell.
        background: what tells the object where there is no mask.
        wanted: the object's larger side in what will be made of it, in pixels: small ones are cut
            at a higher resolution.
    """
    if mask is not None:
        return _cut_by_mask(photo, mask)
    if background == "rembg":
        return _cut_by_rembg(photo)
    if photo.mode == "RGBA" and np.asarray(photo.getchannel("A")).min() < 128:
        return _cut_by_alpha(photo)
    return _closer(_cut_by_border(photo), photo, wanted)


def _object_box(cut: _Cut) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the object: of more than specks of half coverage."""
    parts, _ = main_parts(cut.coverage > 127)
    rows, columns = (np.flatnonzero(parts.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        raise DataError(f"no object found ({cut.steps[-1]}): give mask=...")
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _cut_by_mask(photo: Image.Image, mask: Image.Image) -> _Cut:
    """Take for the object what a mask shows."""
    levels, flat = _mask_levels(mask, photo.size), _flat(photo)
    # Many times the network's size would only take memory.
    flat = flat.reduce(max(1, max(flat.size) // _LARGEST))
    if flat.size != levels.size:
        levels = levels.resize(flat.size, Image.Resampling.BOX)
    coverage, rgb = np.asarray(levels), np.asarray(flat)
    warnings = ("the mask covers all of it: nothing is cut out",) if coverage.min() > 127 else ()
    step = "background: mask"
    scale = photo.width / flat.width
    return _Cut(_whitened(rgb, coverage), coverage, scale, (step,), warnings)


def _mask_levels(mask: Image.Image, size: tuple[int, int]) -> Image.Image:
    """Return a mask of a photograph of that size as L, its brightest level 255."""
    mask = as_photo(mask)
    alpha = mask.getchannel("A") if mask.mode == "RGBA" else None
    mask = alpha if alpha and len(set(alpha.getextrema())) > 1 else mask.convert("L")
    top = int(np.asarray(mask).max(initial=0))
    if top == 0:
        raise DataError("the mask is empty: it must show the object bright")
    if mask.size != size:
        (a, b), (c, d) = mask.size, size
        raise DataError(f"the mask has {a} x {b} pixels, the upright photograph {c} x {d}")
    return mask.point([min(255, round(level * 255 / top)) for level in range(256)])


def _cut_by_alpha(photo: Image.Image) -> _Cut:
    """Take for the object what is not see-through."""
    rgba = np.asarray(photo)
    rgb, coverage = rgba[..., :3], rgba[..., 3]
    step = "background: alpha channel"
    # Rendered images are over white already: under alpha a, no channel is darker than 255 - a.
    if (rgb < 254 - coverage[..., None].astype(np.int16)).any():
        rgb = np.asarray(over_white(photo))[..., :3]
        step += ", laid over white"
    return _Cut(rgb, coverage, 1.0, (step,))


def _cut_by_rembg(photo: Image.Image) -> _Cut:
    """Take for the object what the package rembg finds."""
    rgb = _flat(_reduced(photo))
    module, session = _rembg()
    try:
        mask = module.remove(rgb, session=session, only_mask=True)
    except Exception as error:  # whatever a foreign network stumbles over
        raise ConfigError(f"background=rembg failed ({reason_of(error)}): give mask=...") from error
    coverage = np.asarray(mask.convert("L"))
    step = f"background: rembg ({_MODEL})"
    return _Cut(_whitened(np.asarray(rgb), coverage), coverage, photo.width / rgb.width, (step,))


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
            f"background=rembg cannot get the weights of {_MODEL} ({reason_of(error)}): connect to "
            "the internet once, put the file where rembg looks for it, or give mask=..."
        ) from error


def _cut_by_border(photo: Image.Image) -> _Cut:
    """Take for the object the main part of what differs from the border's colour."""
    small = _reduced(photo)
    found = split_by_border(np.asarray(_flat(small), np.float32))
    step = f"background: border colour {found.colour}, {found.tolerance / 2.55:.1f}% tolerance"
    if found.specks:
        step += f", {found.specks} specks left out"
    warnings = []
    if not found.uniform:
        warnings.append(
            f"the background is not uniform ({100 * found.outside:.0f}% of the border has other "
            f"colours, it varies by {found.spread / 2.55:.1f}%): check the result, or give mask=..."
        )
    kept, left_out = main_object(found.coverage > 0)
    if left_out:
        warnings.append(
            f"{left_out} other {'thing' if left_out == 1 else 'things'} beside the object left "
            "out: if that belongs to it, or is what you mean, give mask=..., bright where the "
            "object is"
        )
    return _Cut(
        as_bytes(np.where(kept[..., None], found.rgb, 255)),
        as_bytes(255 * found.coverage * kept),
        photo.width / small.width,
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
    side = max(right - left, bottom - top)
    if side >= wanted or cut.scale <= 1:
        return cut
    around = left - side / 2, top - side / 2, right + side / 2, bottom + side / 2
    x0, y0, x1, y1 = (round(edge * cut.scale) for edge in around)
    x0, y0, x1, y1 = max(0, x0), max(0, y0), min(photo.width, x1), min(photo.height, y1)
    again = _cut_by_border(photo.crop((x0, y0, x1, y1)))
    if not (again.coverage > 127).any():
        return cut
    return replace(again, corner=(x0, y0), steps=cut.steps, warnings=cut.warnings)


def _reduced(photo: Image.Image) -> Image.Image:
    """Return a photograph with a longer side of about `_WORK_SIDE`, if it is much larger."""
    times = max(1, round(max(photo.size) / _WORK_SIDE))
    return photo.reduce(times) if times > 1 else photo


def _flat(photo: Image.Image) -> Image.Image:
    """Return a photograph over white, RGB."""
    return over_white(photo).convert("RGB") if photo.mode == "RGBA" else photo


def _whitened(rgb: Bytes, coverage: Bytes) -> Bytes:
    """Return a picture with white in place of what is not covered."""
    share = coverage[..., None].astype(np.float32) / 255
    return as_bytes(rgb * share + 255 * (1 - share))


def _is_training_image(
    photo: Image.Image, cut: _Cut, box: tuple[int, int, int, int], whole: bool
) -> bool:
    """Tell whether a photograph of the network's size is as the network was trained on already.

    It is on white, and the object is whole. The centre of its box is at most a quarter of its
    larger side off the image's in rendered images; 0.4 leaves room. Its size says nothing: a gun
    seen end on fills a tenth of the image.
    """
    width, height = photo.size
    ring = border_ring((height, width))
    white = (cut.rgb if photo.mode == "RGBA" else np.asarray(photo))[ring].min(axis=-1) >= 250
    if whole:
        on_white = (white | (cut.coverage[ring] > 0)).all() and not _sides_touched(cut.coverage)
    else:
        on_white = white.mean() > 0.5
    left, top, right, bottom = box
    off = max(abs(left + right - width), abs(top + bottom - height)) / 2
    return bool(on_white) and off < 0.4 * max(right - left, bottom - top)


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
    if len(sides) == 4:
        warnings.append("the object reaches all four sides: background is left in, give mask=...")
    elif sides:
        warnings.append(f"the object touches the photograph's border ({', '.join(sides)})")
    a, b, c, d = (round(value * cut.scale) for value in (wide, high, left, top))
    c, d = c + cut.corner[0], d + cut.corner[1]
    if scale > 1.2:
        warnings.append(f"the object has only {a} x {b} pixels: it is blurred")
    steps = (f"cropped to {a} x {b} at ({c}, {d})", f"resized by {scale / cut.scale:.3g}")
    return FramedPhoto(result, cut.steps + steps, tuple(warnings))


def _sides_touched(coverage: Bytes) -> list[str]:
    """Return at which sides of a picture the object ends."""
    edges = {"left": coverage[:, 0], "top": coverage[0], "right": coverage[:, -1]}
    edges["bottom"] = coverage[-1]
    return [side for side, edge in edges.items() if np.count_nonzero(edge > 127) > 0.01 * len(edge)]
