"""Cutting the object out of a photograph: by mask, alpha, the border's colour or a network."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from PIL import Image

from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.background import as_bytes, main_parts, split_by_border
from ffd_lightning.imaging.objects import MainObject, main_object
from ffd_lightning.imaging.photos import READ_SIDE, Bytes, reason_of, reduced, scale_of
from ffd_lightning.imaging.pictures import ORIGIN, Origin, over_white, upright

Background = Literal["auto", "rembg"]
"""What tells a photograph's object from its background, where no mask is given: its alpha channel,
else the colour of its border (`auto`), or the network of the package rembg."""

_MODEL = "isnet-general-use"  # of rembg: made for thin structures; its own default varies


@dataclass(frozen=True)
class Cut:
    """A photograph with its background turned white.

    Attributes:
        rgb: (h, w, 3) over white.
        coverage: (h, w), 255 where the object is.
        name: of the photograph, for messages.
        scale: its own pixels per pixel of this.
        corner: x and y of this in the photograph, in its own pixels.
        steps, warnings: see `framing.FramedPhoto`.
    """

    rgb: Bytes
    coverage: Bytes
    name: str
    scale: float
    steps: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    corner: tuple[float, float] = (0.0, 0.0)


def cut_object(
    photo: Image.Image, mask: Image.Image | None, background: Background, wanted: float
) -> Cut:
    """Cut the object out of a photograph; see `framing.frame_photo`.

    Args:
        photo: from `read_photo`.
        mask: what shows the object; None lets `background` tell.
        background: what tells the object where there is no mask.
        wanted: the object's larger side in what will be made of it, in pixels: small ones are cut
            at a higher resolution.

    Raises:
        DataError: the mask cannot be used, or no object is found.
        ConfigError: rembg is asked for but is not installed or has no weights.
    """
    if mask is not None:
        return _cut_by_mask(photo, mask)
    if background == "rembg":
        return _cut_by_rembg(photo)
    if photo.mode == "RGBA" and np.asarray(photo.getchannel("A")).min() < 128:
        return _cut_by_alpha(photo)
    return _closer(_cut_by_border(photo), photo, wanted)


def object_box(cut: Cut) -> tuple[int, int, int, int]:
    """Return left, top, right, bottom of the object: of more than specks of half coverage.

    Raises:
        DataError: there is none.
    """
    parts, _ = main_parts(cut.coverage > 127)
    rows, columns = (np.flatnonzero(parts.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        raise DataError(f"{cut.name}: no object found ({cut.steps[-1]}): give mask=...")
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _cut_by_mask(photo: Image.Image, mask: Image.Image) -> Cut:
    """Take for the object what a mask shows."""
    origin = photo.info[ORIGIN]
    flat = over_white(photo).convert("RGB") if photo.mode == "RGBA" else photo
    # Many times the network's size would only take memory.
    flat = flat.reduce(max(1, max(flat.size) // READ_SIDE))
    levels = _mask_levels(mask, origin)
    if flat.size != levels.size:
        levels = levels.resize(flat.size, Image.Resampling.BOX)
    coverage, rgb = np.asarray(levels), np.asarray(flat)
    warnings = ["the mask covers all of it: nothing is cut out"] if coverage.min() > 127 else []
    return Cut(
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


def _cut_by_alpha(photo: Image.Image) -> Cut:
    """Take for the object what is not see-through."""
    origin = photo.info[ORIGIN]
    rgba = np.asarray(photo)
    rgb, coverage = rgba[..., :3], rgba[..., 3]
    step = "background: alpha channel"
    # Rendered images are over white already: under alpha a, no channel is darker than 255 - a.
    if (rgb < 254 - coverage[..., None].astype(np.int16)).any():
        rgb = np.asarray(over_white(photo))[..., :3]
        step += ", laid over white"
    return Cut(rgb, coverage, origin.name, scale_of(photo), (step,))


def _cut_by_rembg(photo: Image.Image) -> Cut:
    """Take for the object what the package rembg finds."""
    photo = reduced(photo)
    rgb = (over_white(photo) if photo.mode == "RGBA" else photo).convert("RGB")
    module, session = _rembg()
    try:
        mask = module.remove(rgb, session=session, only_mask=True)
    except Exception as error:  # whatever a foreign network stumbles over
        raise ConfigError(f"background=rembg failed ({reason_of(error)}): give mask=...") from error
    coverage = np.asarray(mask.convert("L"))
    step = f"background: rembg ({_MODEL})"
    name = photo.info[ORIGIN].name
    return Cut(_whitened(np.asarray(rgb), coverage), coverage, name, scale_of(photo), (step,))


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


def _cut_by_border(photo: Image.Image) -> Cut:
    """Take for the object the main part of what differs from the border's colour."""
    small = reduced(photo)
    flat = over_white(small) if small.mode == "RGBA" else small
    found = split_by_border(np.asarray(flat, np.float32)[..., :3])
    step = f"background: border colour {found.colour}, {found.tolerance / 2.55:.1f}% tolerance"
    if found.specks:
        step += f", {found.specks} specks left out"
    warnings = []
    if not found.uniform:
        warnings.append(
            f"the background is not uniform ({100 * found.outside:.0f}% of the border has other "
            f"colours, it varies by {found.spread / 2.55:.1f}%): check the result, or give mask=..."
        )
    main = main_object(found.coverage > 0)
    warnings += _told(main)
    return Cut(
        as_bytes(np.where(main.kept[..., None], found.rgb, 255)),
        as_bytes(255 * found.coverage * main.kept),
        photo.info[ORIGIN].name,
        scale_of(small),
        (step,),
        tuple(warnings),
    )


def _told(main: MainObject) -> list[str]:
    """Return what to say of what was left out, or taken for one."""
    warnings = []
    if main.left_out:
        told = ", ".join(main.left_out)
        warnings.append(
            f"left out beside the object: {told}; if that belongs to it, or is what you mean, "
            "give mask=..., bright where the object is"
        )
    if main.pieces > 1:
        parts = f"{main.pieces} separate parts were taken for one object"
        warnings.append(f"{parts}: to take one of them, give mask=..., bright where it is")
    return warnings


def _closer(cut: Cut, photo: Image.Image, wanted: float) -> Cut:
    """Cut again at higher resolution, if the object is small in a photograph that was reduced.

    Args:
        cut: of the whole photograph.
        photo: as it was read.
        wanted: the object's larger side in the result, in pixels.
    """
    left, top, right, bottom = object_box(cut)
    times, side = cut.scale / scale_of(photo), max(right - left, bottom - top)
    if side >= wanted or times <= 1:
        return cut
    around = left - side / 2, top - side / 2, right + side / 2, bottom + side / 2
    x0, y0, x1, y1 = (round(edge * times) for edge in around)
    x0, y0, x1, y1 = max(0, x0), max(0, y0), min(photo.width, x1), min(photo.height, y1)
    again = _cut_by_border(photo.crop((x0, y0, x1, y1)))
    if not (again.coverage > 127).any():
        return cut
    less = (x1 - x0) / again.rgb.shape[1]
    corner = x0 * scale_of(photo), y0 * scale_of(photo)
    return replace(
        again, scale=less * scale_of(photo), corner=corner, steps=cut.steps, warnings=cut.warnings
    )


def _whitened(rgb: Bytes, coverage: Bytes) -> Bytes:
    """Return a picture with white in place of what is not covered."""
    share = coverage[..., None].astype(np.float32) / 255
    return as_bytes(rgb * share + 255 * (1 - share))
