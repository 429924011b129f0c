"""Any photograph -> the image that the network was trained on: on white, framed as training's."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from PIL import Image

from ffd_lightning.imaging.background import border_ring
from ffd_lightning.imaging.cutting import Background, Cut, cut_object, object_box
from ffd_lightning.imaging.photos import Bytes, as_picture
from ffd_lightning.imaging.pictures import ORIGIN

_FILTER = Image.Resampling.LANCZOS


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
        fill: the larger side of the object's box in pixels / `height`, see `object_fill`.
        whole: no object is cut off in training images.
        mask: of any mode: what is bright is the object, or what is opaque where alpha varies.
        background: `rembg` lets that package find the object.

    Raises:
        DataError: the picture or the mask cannot be used, or no object is found.
        ConfigError: rembg is asked for but is not installed or has no weights.
    """
    photo = as_picture(picture)
    origin = photo.info[ORIGIN]
    cut = cut_object(photo, mask, background, fill * height)
    cut = replace(cut, steps=origin.steps + cut.steps, warnings=origin.warnings + cut.warnings)
    box = object_box(cut)
    given = mask is not None or background == "rembg"
    same_size = photo.size == (width, height)
    if same_size and not given and _is_training_image(photo, cut, box, whole):
        rgb = cut.rgb if photo.mode == "RGBA" else np.asarray(photo)
        step = "taken as it is: of the network's size, on white and framed already"
        return FramedPhoto(np.dstack([rgb, cut.coverage]), (*origin.steps, step), origin.warnings)
    return _fit(cut, box, height, width, fill)


def _is_training_image(
    photo: Image.Image, cut: Cut, box: tuple[int, int, int, int], whole: bool
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
    cut: Cut, box: tuple[int, int, int, int], height: int, width: int, fill: float
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
