"""Pictures and scenes for TensorBoard: bars of template selection, and clouds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from matplotlib import colormaps
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.nearest import nearest_neighbors
from ffd_lightning.imaging.rendering import render
from ffd_lightning.metrics.selection import effective_templates
from ffd_lightning.palette import COLORS

_SHEET_WIDTH = 1600  # pixels that many templates share
_WIDTHS = 48, 112  # of a template
_LEAST_WIDTH = 480  # of a sheet, for its title
_BARS = 150  # height
_LINE, _FONT = 18, 13
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
    """Draw templates small: (T, h, w, 3) uint8, the smaller the more there are."""
    width = int(np.clip(_SHEET_WIDTH // len(bank), *_WIDTHS))
    height = 3 * width // 4
    drawn = [render(mesh, height=height, width=width, samples=3) for mesh in bank.meshes]
    return np.stack([image[..., :3] for image in drawn])


def selection_bars(
    counts: ArrayLike, weights: ArrayLike, pictures: NDArray[np.uint8]
) -> NDArray[np.uint8]:
    """Draw how often each template is selected, most used first, and its mean weight.

    Below its bar a template has its picture and its number, which counts from 1.

    Args:
        counts: selections per template, (T,).
        weights: mean weight per template, (T,).
        pictures: of the templates, (T, h, w, 3).

    Returns:
        RGB image, (H, W, 3) uint8.
    """
    counts, weights = np.asarray(counts), np.asarray(weights, float)
    order = np.argsort(-counts, kind="stable")
    shares = counts / counts.sum()
    height, width = pictures.shape[1:3]
    cell = max(width, _LEAST_WIDTH // len(order))
    floor = 3 * _LINE + _BARS
    sheet = Image.new("RGB", (cell * len(order), floor + height + _LINE), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(_FONT)
    used = f"{(counts > 0).sum()} of {len(counts)} templates selected"
    effective = f"effectively {effective_templates(counts):.1f}"
    draw.text((4, 2), f"{used}, {effective} ({counts.sum()} images)", "black", font)
    draw.text((4, 2 + _LINE), "bar: share of images", _BAR_COLOR, font)
    after = draw.textlength("bar: share of images   ", font)
    draw.text((4 + after, 2 + _LINE), "dot: mean weight", _DOT_COLOR, font)
    scale = (_BARS - 8) / max(shares.max(), weights.max())
    for place, t in enumerate(order):
        left, middle = place * cell, place * cell + cell // 2
        top = floor - round(scale * shares[t])
        if counts[t]:
            bar = (left + cell // 6, top, left + cell - cell // 6, floor - 1)
            draw.rectangle(bar, fill=_BAR_COLOR)
            draw.text((middle, top - 2), f"{shares[t]:.0%}", "black", font, anchor="mb")
        dot = floor - round(scale * weights[t])
        draw.ellipse((middle - 4, dot - 4, middle + 4, dot + 4), fill=_DOT_COLOR, outline="white")
        sheet.paste(Image.fromarray(pictures[t]), (left + (cell - width) // 2, floor))
        draw.text((middle, floor + height), f"{t + 1}", "black", font, anchor="mt")
    draw.line((0, floor, sheet.width, floor), fill="gray")
    return np.asarray(sheet)


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
