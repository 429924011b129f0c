"""Any photograph -> the image that the network was trained on: on white, framed as training's."""

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.components import typed
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.background import border_ring, main_parts, split_by_border
from ffd_lightning.imaging.objects import main_object
from ffd_lightning.imaging.photos import Bytes, Photo, over_white, read_photo, reason_of

Background = Literal["auto", "rembg"]
"""What tells a photograph's object from its background, where no mask is given: its alpha channel,
else the colour of its border (`auto`), or the network of the package rembg."""

Box = tuple[int, int, int, int]
"""Left, top, right and bottom, in pixels."""

_GRABCUT_ROUNDS = 8
_MODEL = "isnet-general-use"  # of rembg: made for thin structures; its own default varies
_FILTER = Image.Resampling.LANCZOS
_LEAST_SEE_THROUGH = 0.01  # share of the pixels of a picture that is cut out by its alpha
_LARGEST = 1536  # longer side of what is cut by a mask: several times what the network sees
_ENOUGH = 12  # pixels of a photograph for one that the network sees, along each side
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


@dataclass(frozen=True)
class _Cut:
    """A photograph with its background turned white."""

    rgb: Bytes  # (h, w, 3) over white
    coverage: Bytes  # (h, w), 255 where the object is
    scale: float  # the photograph's pixels per pixel of this
    step: str
    warnings: tuple[str, ...] = ()
    corner: tuple[int, int] = (0, 0)  # x and y of this in the photograph, in its pixels


def frame_photo(
    picture: Photo,
    *,
    height: int,
    width: int,
    fill: float,
    whole: bool = True,
    mask: Photo | None = None,
    box: Box | None = None,
    background: Background = "auto",
) -> FramedPhoto:
    """Cut the object out of a photograph, lay it on white and frame it as in training images.

    The object is what `mask` shows; else what GrabCut finds within `box`; else what the
    photograph's alpha channel shows; else what does not have the border's colour, which may change
    smoothly over the picture. A picture of the network's size that looks like a training image is
    taken as it is.

    Args:
        picture: the photograph.
        height: of the result, in pixels.
        width: of the result, in pixels.
        fill: the larger side of the object's box in pixels / `height`, see `object_fill`.
        whole: no object is cut off in training images.
        mask: of the upright photograph's size: what is bright is the object, or what is opaque
            where alpha varies.
        box: left, top, right and bottom of the object in pixels of the upright photograph, with a
            little room around it.
        background: `rembg` lets that package find the object.

    Raises:
        DataError: the picture or the mask cannot be used, or no object is found.
        ConfigError: rembg or OpenCV is needed but is not installed, or has no weights.
    """
    typed(Background, background, "background")
    photo = read_photo(picture)
    if mask is not None:
        cut = _cut_by_mask(photo, read_photo(mask, "the mask"))
    elif box is not None:
        cut = _cut_by_box(photo, box)
    elif background == "rembg":
        cut = _cut_by_rembg(photo)
    else:
        see_through = np.mean(np.asarray(photo)[..., 3] < 128) if photo.mode == "RGBA" else 0
        # Rounded corners cut nothing out, nor does a veil over all of the picture.
        by_alpha = _LEAST_SEE_THROUGH < see_through < 1
        cut = _cut_by_alpha(photo) if by_alpha else _cut_by_border(photo, fill * height)
        whole_size = cut.coverage.shape == (height, width)  # large ones are reduced to be cut out
        if whole_size and photo.size == (width, height) and _is_training_image(cut, photo, whole):
            rgb = cut.rgb if photo.mode == "RGBA" else np.asarray(photo)
            step = "taken as it is: of the network's size, on white and framed already"
            return FramedPhoto(np.dstack([rgb, cut.coverage]), (step,), ())
    return _fit(cut, height, width, fill)


def object_fill(images: Iterable[NDArray[np.uint8]]) -> float:
    """Return how large objects are in images: the median of the larger side of their boxes.

    Args:
        images: (H, W, 4) uint8 each, the last channel the coverage.

    Returns:
        In units of the image's height; 1 where no image shows anything. The renderer, which fits
        the bounding sphere into the image, gives 0.82 (0.74 to 0.86 for half of the shapes).

    >>> image = np.zeros((10, 20, 4), np.uint8)
    >>> image[2:5, 4:10, 3] = 255
    >>> object_fill([image])
    0.6
    """
    boxes = [(box, len(i)) for i in images if (box := covered_box(i[..., 3] > 127))]
    fills = [max(right - left, low - top) / high for (left, top, right, low), high in boxes]
    return float(np.median(fills)) if fills else 1.0


def fit_picture(picture: Image.Image, height: int, width: int) -> Bytes:
    """Fit an RGBA picture into (height, width) without distorting it, centred on white.

    Returns:
        RGB over white and coverage, (height, width, 4) uint8: what prepared sets hold.
    """
    scale = min(height / picture.height, width / picture.width)
    size = max(1, round(picture.width * scale)), max(1, round(picture.height * scale))
    inner = over_white(picture).resize(size, _FILTER)
    inner.putalpha(picture.getchannel("A").resize(size, _FILTER))
    result = Image.new("RGBA", (width, height), (255, 255, 255, 0))
    result.paste(inner, ((width - size[0]) // 2, (height - size[1]) // 2))
    return np.asarray(result)


# --- cutting out ----------------------------------------------------------------------------------


def _cut_by_mask(photo: Image.Image, mask: Image.Image) -> _Cut:
    """Take for the object what a mask shows, whose brightest level counts as all of it."""
    alpha = mask.getchannel("A") if mask.mode == "RGBA" else None
    levels = alpha if alpha and len(set(alpha.getextrema())) > 1 else mask.convert("L")
    top = np.asarray(levels).max()
    if top == 0:
        raise DataError("the mask is empty: it must show the object bright")
    if mask.size != photo.size:
        (a, b), (c, d) = mask.size, photo.size
        raise DataError(f"the mask has {a} x {b} pixels, the upright photograph {c} x {d}")
    # Many times the network's size would only take memory.
    flat = over_white(photo).reduce(max(1, max(photo.size) // _LARGEST))
    levels = levels.point([min(255, round(level * 255 / top)) for level in range(256)])
    levels = levels.resize(flat.size, Image.Resampling.BOX)
    return _whitened(photo, flat, levels, "mask")


def _cut_by_rembg(photo: Image.Image) -> _Cut:
    """Take for the object what the package rembg finds."""
    flat = over_white(_reduced(photo))
    try:
        import rembg

        mask = rembg.remove(flat, session=_rembg_session(), only_mask=True)
    except (Exception, SystemExit) as error:  # it exits where it finds no onnxruntime
        raise ConfigError(
            f"background=rembg failed ({reason_of(error)}): pip install 'rembg[cpu]', connect to "
            "the internet once for its weights, or give mask=..."
        ) from error
    return _whitened(photo, flat, mask.convert("L"), f"rembg ({_MODEL})")


def _cut_by_box(photo: Image.Image, box: Box) -> _Cut:
    """Take for the object what has other colours than what is outside of a box.

    Source: C. Rother et al., "GrabCut", SIGGRAPH 2004, by OpenCV.
    """
    try:
        left, top, right, bottom = map(float, box)
    except (TypeError, ValueError):
        left = top = right = bottom = math.nan
    if not (0 <= left < right <= photo.width and 0 <= top < bottom <= photo.height):
        raise DataError(
            f"box={str(box).strip('()[]')} must be left,top,right,bottom within the upright "
            f"photograph, {photo.width} x {photo.height} pixels"
        )
    if (right - left) * (bottom - top) > 0.98 * photo.width * photo.height:
        raise DataError("the box covers the whole photograph: it must leave out some background")
    try:
        import cv2
    except ImportError as error:
        raise ConfigError("box= needs OpenCV: pip install 'ffd_lightning[photos]'") from error
    flat = over_white(_reduced(photo))
    scale = photo.width / flat.width
    x, y = math.floor(left / scale), math.floor(top / scale)
    rect = x, y, max(1, math.ceil(right / scale) - x), max(1, math.ceil(bottom / scale) - y)
    labels = np.zeros((flat.height, flat.width), np.uint8)
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.setRNGSeed(0)
    bgr = np.ascontiguousarray(np.asarray(flat)[..., ::-1])
    if np.ptp(bgr, axis=(0, 1)).any():  # OpenCV does not come to an end where all is of one colour
        cv2.grabCut(bgr, labels, rect, *models, _GRABCUT_ROUNDS, cv2.GC_INIT_WITH_RECT)
    found = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD))
    if not found.any():
        raise DataError(
            "nothing within the box has other colours than what surrounds it: make it wider, or "
            "give mask=..."
        )
    mask = Image.fromarray(np.where(found, 255, 0).astype(np.uint8))
    return _whitened(photo, flat, mask, "GrabCut within the box")


@functools.cache
def _rembg_session() -> Any:
    """Return rembg's network, whose weights it downloads at first use."""
    import rembg

    return rembg.new_session(_MODEL)


def _whitened(photo: Image.Image, flat: Image.Image, mask: Image.Image, what: str) -> _Cut:
    """Return a photograph, `flat` and perhaps reduced, with white where a mask shows nothing."""
    coverage = np.asarray(mask)
    share = coverage[..., None].astype(np.float32) / 255
    rgb = _as_bytes(np.asarray(flat) * share + 255 * (1 - share))
    return _Cut(rgb, coverage, photo.width / flat.width, f"background: {what}")


def _as_bytes(values: NDArray[Any]) -> Bytes:
    """Round levels to those of a picture."""
    return np.round(values).clip(0, 255).astype(np.uint8)


def _cut_by_alpha(photo: Image.Image) -> _Cut:
    """Take for the object what is not see-through."""
    rgba = np.asarray(photo)
    rgb, coverage = rgba[..., :3], rgba[..., 3]
    step = "background: alpha channel"
    # Rendered images are over white already: under alpha a, no channel is darker than 255 - a.
    if (rgb < 254 - coverage[..., None].astype(np.int16)).any():
        rgb = np.asarray(over_white(photo))
        step += ", laid over white"
    return _Cut(rgb, coverage, 1.0, step)


def _cut_by_border(photo: Image.Image, wanted: float) -> _Cut:
    """Take for the object the main part of what differs from the border's colour.

    One of less than `wanted` pixels, in a larger photograph, is cut again at a higher resolution.
    """
    cut = _split(photo)
    left, top, right, bottom = _object_box(cut)
    side = max(right - left, bottom - top)
    if side >= wanted or cut.scale <= 1:
        return cut
    around = left - side / 2, top - side / 2, right + side / 2, bottom + side / 2
    x0, y0, x1, y1 = (max(0, round(edge * cut.scale)) for edge in around)
    again = _split(photo.crop((x0, y0, min(photo.width, x1), min(photo.height, y1))))
    if covered_box(again.coverage > 127) is None:
        return cut
    return replace(again, corner=(x0, y0), step=cut.step, warnings=cut.warnings)


def _split(photo: Image.Image) -> _Cut:
    small = _reduced(photo)
    rgb, coverage, step, warning = split_by_border(np.asarray(over_white(small), np.float32))
    warnings = [warning] if warning else []
    kept, left_out = main_object(coverage > 0)
    if left_out:
        warnings.append(
            f"{left_out} other {'thing' if left_out == 1 else 'things'} beside the object left "
            "out: if that belongs to it, or is what you mean, give mask=..., bright where the "
            "object is"
        )
    rgb, covered = np.where(kept[..., None], rgb, 255), 255 * coverage * kept
    scale = photo.width / small.width
    return _Cut(_as_bytes(rgb), _as_bytes(covered), scale, step, tuple(warnings))


def _reduced(photo: Image.Image) -> Image.Image:
    """Return a photograph with a longer side of about `_WORK_SIDE`, if it is much larger."""
    return photo.reduce(max(1, round(max(photo.size) / _WORK_SIDE)))


# --- framing --------------------------------------------------------------------------------------


def covered_box(covered: NDArray[np.bool_]) -> tuple[int, int, int, int] | None:
    """Return left, top, right, bottom of what is covered, (h, w), None of nothing."""
    return Image.fromarray(covered).getbbox()


def _object_box(cut: _Cut) -> tuple[int, int, int, int]:
    """Return the box of the object: of more than specks of half coverage."""
    parts, _ = main_parts(cut.coverage > 127)
    box = covered_box(parts)
    if box is None:
        raise DataError(f"no object found ({cut.step}): give mask=...")
    return box


def _is_training_image(cut: _Cut, photo: Image.Image, whole: bool) -> bool:
    """Tell whether a photograph of the network's size is as the network was trained on already.

    It is on white, and the object is whole. The centre of its box is at most a quarter of its
    larger side off the image's in rendered images; 0.4 leaves room. Its size says nothing: a gun
    seen end on fills a tenth of the image.
    """
    left, top, right, bottom = _object_box(cut)
    ring = border_ring(cut.coverage.shape)
    white = (cut.rgb if photo.mode == "RGBA" else np.asarray(photo))[ring].min(axis=-1) >= 250
    if whole:
        on_white = (white | (cut.coverage[ring] > 0)).all() and not _sides_touched(cut.coverage)
    else:
        on_white = white.mean() > 0.5
    off = max(abs(left + right - photo.width), abs(top + bottom - photo.height)) / 2
    return bool(on_white) and off < 0.4 * max(right - left, bottom - top)


def _fit(cut: _Cut, height: int, width: int, fill: float) -> FramedPhoto:
    """Resize the surroundings of the object's box to the frame, with white beyond the picture."""
    left, top, right, bottom = _object_box(cut)
    wide, high = right - left, bottom - top
    scale = min(fill * height / max(wide, high), width / wide, height / high)
    if (shrink := int(1 / scale / _ENOUGH)) > 1:  # so many more would only take memory
        rgb, coverage = (
            np.asarray(Image.fromarray(x).reduce(shrink)) for x in (cut.rgb, cut.coverage)
        )
        cut = replace(cut, rgb=rgb, coverage=coverage, scale=cut.scale * shrink)
        return _fit(cut, height, width, fill)
    x, y = (left + right - width / scale) / 2, (top + bottom - height / scale) / 2
    x0, y0 = math.floor(x) - 1, math.floor(y) - 1
    x1, y1 = math.ceil(x + width / scale) + 1, math.ceil(y + height / scale) + 1
    frame = (x - x0, y - y0, x - x0 + width / scale, y - y0 + height / scale)
    # Distance from white and coverage are 0 beyond the picture, as what Pillow adds is; of its
    # modes of four channels, CMYK is the one that it resizes as they are.
    layers = np.dstack([255 - cut.rgb, cut.coverage])
    part = Image.frombytes("CMYK", layers.shape[1::-1], layers.tobytes()).crop((x0, y0, x1, y1))
    image = np.array(part.resize((width, height), _FILTER, frame, reducing_gap=3))
    image[..., :3] = 255 - image[..., :3]
    sides = _sides_touched(cut.coverage)
    warnings = list(cut.warnings)
    if len(sides) == 4:
        warnings.append("the object reaches all four sides: is background left in? give mask=...")
    elif sides:
        warnings.append(f"the object touches the photograph's border ({', '.join(sides)})")
    a, b, c, d = (round(value * cut.scale) for value in (wide, high, left, top))
    if scale > 1.2:
        warnings.append(f"the object has only {a} x {b} pixels: it is blurred")
    place = f"({c + cut.corner[0]}, {d + cut.corner[1]})"
    steps = cut.step, f"cropped to {a} x {b} at {place}", f"resized by {scale / cut.scale:.3g}"
    return FramedPhoto(image, steps, tuple(warnings))


def _sides_touched(coverage: Bytes) -> list[str]:
    """Return at which sides of a picture the object ends."""
    edges = {"left": coverage[:, 0], "top": coverage[0], "right": coverage[:, -1]}
    edges["bottom"] = coverage[-1]
    return [side for side, edge in edges.items() if np.count_nonzero(edge > 127) > 0.01 * len(edge)]
