"""Pictures and scenes for TensorBoard: bars of template selection, and clouds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from matplotlib import colormaps
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.nearest import nearest_neighbors
from ffd_lightning.imaging.rendering import render
from ffd_lightning.imaging.sheet import Line, Sheet, text_width
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import COLORS

_CELL = 54, 72  # pixels, of a template
_COLUMNS = 8  # TensorBoard shrinks pictures to some 300 pixels
_BARS = 84  # height
_LINE = 20
_LARGE_FONT, _FONT = 15, 13
_BAR_COLOR, _DOT_COLOR = COLORS[-1], COLORS[-2]

_FAR = 0.05  # of the box diagonal: the distance from which on points have the last colour
_FAR_SHADE = 0.85  # plasma's end is lost on white
_GAP = 0.1  # between clouds in one scene
_SCENE = {
    "camera": {"cls": "PerspectiveCamera", "fov": 30},
    "material": {"cls": "PointsMaterial", "size": 0.045},
}
CLOUD_LEGEND = (
    "deformed cloud left, truth right; from blue, where they touch, to orange, "
    f"{_FAR:.0%} of the box diagonal off"
)
"""What the colours and places of `write_clouds` say."""


def thumbnails(bank: TemplateBank) -> NDArray[np.uint8]:
    """Draw templates small: (T, h, w, 3) uint8."""
    height, width = _CELL
    drawn = [render(mesh, height=height, width=width, samples=3) for mesh in bank.meshes]
    return np.stack([image[..., :3] for image in drawn])


def selection_bars(
    counts: ArrayLike, weights: ArrayLike, pictures: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Draw how often each template is selected, most used first, and its mean weight.

    Below its bar a template has its picture and its number, which counts from 1. Eight are in a
    row.

    Args:
        counts: selections per template, (T,).
        weights: mean weight per template, (T,).
        pictures: of the templates, (T, h, w, 3).

    Returns:
        RGB image, (H, W, 3) uint8.
    """
    counts, weights = np.asarray(counts), np.asarray(weights, float)
    shares = counts / counts.sum()
    height, width = pictures.shape[1:3]
    top, row = 2 * _LINE, 2 * _LINE + _BARS + height
    size = (_COLUMNS * width, top - (-len(counts) // _COLUMNS) * row)
    sheet = Image.new("RGB", size, "white")
    draw = ImageDraw.Draw(sheet)
    lines = _headline(draw, counts)
    scale = _BARS / max(shares.max(), weights.max())
    for place, t in enumerate(np.argsort(-counts, kind="stable")):
        left, floor = place % _COLUMNS * width, top + place // _COLUMNS * row + row - height - _LINE
        _bar(draw, (left, floor, width), scale * shares[t], scale * weights[t])
        middle = left + width / 2
        if counts[t]:
            high = floor - scale * max(shares[t], weights[t]) - 12
            lines.append(Line(f"{shares[t]:.0%}", middle, high, _FONT, "center"))
        sheet.paste(Image.fromarray(pictures[t]), (left, floor))
        below = floor + height + _LINE / 2
        lines.append(Line(f"{t + 1}", middle, below, _FONT, "center"))
    return Sheet(size[1], size[0], ((np.asarray(sheet), 0, 0),), tuple(lines)).draw()


def _headline(draw: ImageDraw.ImageDraw, counts: NDArray[np.int64]) -> list[Line]:
    """Say what came of the selections; draw what bars and dots look like, and say what they are."""
    told = f"{(counts > 0).sum()} of {len(counts)} templates selected, "
    told += f"effectively {effective_templates(counts):.1f}"
    lines, x = [Line(told, 4, 10, _LARGE_FONT)], 4.0
    for text, color in ((f"% of {counts.sum()} images", _BAR_COLOR), ("mean weight", _DOT_COLOR)):
        draw.rectangle((x, _LINE + 8, x + 10, _LINE + 18), fill=color)
        lines.append(Line(text, x + 16, _LINE + 13, _FONT))
        x += 40 + text_width(text, _FONT)
    return lines


def _bar(draw: ImageDraw.ImageDraw, place: tuple[int, int, int], height: float, dot: float) -> None:
    """Draw a bar, and a dot at its own height, between a left and a floor of some width."""
    left, floor, width = place
    draw.line((left, floor - 1, left + width, floor - 1), fill="gray")
    if height:
        inside, high = width // 6, max(round(height), 1)
        draw.rectangle((left + inside, floor - high, left + width - inside, floor - 1), _BAR_COLOR)
    x, y = left + width / 2, floor - dot
    draw.ellipse((x - 4, y - 4, x + 4, y + 4), fill=_DOT_COLOR, outline="white")


def distance_colors(a: Tensor, b: Tensor) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Colour the points of two clouds by the distance to the nearest point of the other.

    Args:
        a: (n, 3), box diagonal 1.
        b: (m, 3).

    Returns:
        RGB of both, (n, 3) and (m, 3) uint8: from blue (no distance) to orange (0.05 and more).
    """
    nearest = nearest_neighbors(a, b)
    return _colors(nearest.a_to_b), _colors(nearest.b_to_a)


def _colors(squared: Tensor) -> NDArray[np.uint8]:
    shade = _FAR_SHADE * np.minimum(squared.sqrt().numpy() / _FAR, 1)
    return np.round(255 * colormaps["plasma"](shade)[:, :3]).astype(np.uint8)


def write_clouds(
    writer: SummaryWriter, tag: str, pairs: Sequence[tuple[Tensor, Tensor]], step: int
) -> None:
    """Write deformed clouds, each with the truth to its right, below one another to the page MESH.

    All in one scene, as browsers keep few scenes alive. The first deformed cloud stays where it is.
    Colours: `distance_colors`.
    """
    clouds = [cloud for pair in pairs for cloud in pair]
    corners = torch.stack([torch.stack([c.amin(0), c.amax(0)]) for c in clouds])
    cell = corners[:, 1].amax(0) - corners[:, 0].amin(0) + _GAP
    places = [cell * cell.new_tensor([k % 2, -(k // 2), 0]) for k in range(len(clouds))]
    points = torch.cat([cloud + place for cloud, place in zip(clouds, places, strict=True)])
    colors = np.concatenate([color for a, b in pairs for color in distance_colors(a, b)])
    writer.add_mesh(tag, points[None], torch.from_numpy(colors)[None], None, _SCENE, step)
