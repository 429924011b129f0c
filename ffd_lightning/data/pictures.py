"""Bringing pictures of any size to the network's: fitted, padded with white, resized."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PIL import Image


def fit_picture(picture: Image.Image, height: int, width: int) -> NDArray[np.uint8]:
    """Fit a picture into (height, width) without distorting it, centred on white.

    Args:
        picture: any mode; what its alpha says is see-through becomes white.
        height: of the result, in pixels.
        width: of the result, in pixels.

    Returns:
        RGB over white and coverage, (height, width, 4) uint8: what prepared sets hold.
    """
    rgba = picture.convert("RGBA")
    flat = Image.new("RGBA", rgba.size, "white")
    flat.alpha_composite(rgba)
    scale = min(height / rgba.height, width / rgba.width)
    size = max(1, round(rgba.width * scale)), max(1, round(rgba.height * scale))
    corner = (width - size[0]) // 2, (height - size[1]) // 2
    result = Image.new("RGBA", (width, height), (255, 255, 255, 0))
    inner = flat.resize(size, Image.Resampling.LANCZOS)
    inner.putalpha(rgba.getchannel("A").resize(size, Image.Resampling.LANCZOS))
    result.paste(inner, corner)
    return np.asarray(result)
