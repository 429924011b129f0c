"""Training images varied at random, a batch at a time, on the device that has it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import torch
from jaxtyping import Float, UInt8
from torch import Tensor
from torch.nn import functional

from ffd_lightning.components import check_ranges, component

Augmentation: TypeAlias = Callable[[Tensor], Tensor]
"""A function of images (q, 4, H, W) uint8, RGB over white and coverage, that returns such images.

What it draws comes from torch's own random numbers, which follow from the seed and the step.
"""

_ERASED = 0.22  # largest half side of what is erased, in half heights of the image
_PATCH = 0.2, 0.5  # half sizes of patches, in half heights of the image
_WIDER, _NARROWER = 4.0, 1.5  # how strongly a blurred outline replaces the object's own
_BACKGROUND = 0.2, 0.8  # levels; a gradient adds up to 0.15


@component("augmentation", "none")
class Unchanged:
    """Training images as they were prepared."""

    def __call__(self, images: Tensor) -> Tensor:
        """Return them."""
        return images


@component("augmentation", "photo")
@dataclass
class PhotoAugmentation:
    """Varies training images as photographs vary: colours, framing, imperfect cut-outs.

    The object is moved, blurred, eroded and partly erased together with its coverage a; its
    colours, times a, go through one affine map per image, a gradient of light and a tone curve.
    What a cut-out may leave of the background, of coverage m >= a and colour b, is laid behind
    it, and white behind both: rgb + (m - a) b + (1 - m). Of each, 0 turns it off; factors are
    drawn between 1 / (1 + x) and 1 + x.

    Attributes:
        brightness: factor of the object's brightness.
        contrast: factor of the object's contrast.
        gamma: how far its middle tones are lifted or lowered; at 1 to their squares.
        light: how far light falls off from one side of the image to the other.
        saturation: factor of its colours' distance from grey.
        hue: its hues turn by so much of a circle at most.
        tint: factor of each colour channel.
        grey: share of images without colour.
        scale: factor of its size: the distance of the camera.
        shift: of the object, in heights of the image, at most.
        roll: of the camera, in degrees, at most.
        background: share of images whose background is left in: a colour with a gradient.
        patch: share of images where a patch of the background is left.
        border: share of images that are cut out too wide, or too narrow.
        blur: share of images that are blurred, as small ones are.
        noise: largest deviation of the pixels' noise, white being 1.
        erasing: share of images where a rectangle hides something of the object.
    """

    brightness: float = 0.4
    contrast: float = 0.3
    gamma: float = 0.5
    light: float = 0.4
    saturation: float = 0.5
    hue: float = 0.05
    tint: float = 0.15
    grey: float = 0.1
    scale: float = 0.2
    shift: float = 0.06
    roll: float = 4.0
    background: float = 0.1
    patch: float = 0.1
    border: float = 0.3
    blur: float = 0.4
    noise: float = 0.04
    erasing: float = 0.15

    def __post_init__(self) -> None:
        ranges = dict.fromkeys(vars(self), "[0, 1]")
        ranges |= dict.fromkeys(("brightness", "saturation", "tint", "scale"), "[0, 3]")
        ranges |= {"hue": "[0, 0.5]", "shift": "[0, 0.5]", "roll": "[0, 45]"}
        check_ranges(vars(self), **ranges)

    def __call__(self, images: UInt8[Tensor, "q 4 h w"]) -> UInt8[Tensor, "q 4 h w"]:
        """Return other images of the same objects: RGB over white, and coverage."""
        draw = _Draws(len(images), images.device)
        x, y = _positions(images)
        # Ink, the distance from white, is 0 beyond the object, as coverage is: both move alike.
        layers = images.float().mul_(1 / 255)
        layers[:, :3].neg_().add_(1)
        layers, spread = self._framed(draw, layers)
        border = draw.between(-1, 1) * draw.chosen(self.border)
        seen = self._not_hidden(draw, x, y)
        narrower = (1 - border.neg().clamp(min=0) * _NARROWER * (1 - spread)).clamp_(min=0)
        layers *= seen * narrower
        wider = seen * spread * (border.clamp(min=0) * _WIDER)
        object_coverage = layers[:, 3:]
        coverage = torch.maximum(object_coverage, self._background(draw, wider, x, y))
        left = coverage - object_coverage
        rgb = self._coloured(draw, layers, x, y)
        level = draw.between(*_BACKGROUND)
        rgb.addcmul_(left, torch.lerp(level, draw.between(*_BACKGROUND, channels=3), 0.3))
        slope_x, slope_y = draw.direction(0.1)
        rgb += left * (slope_x * x + slope_y * y) + (1 - coverage)
        # Noise is the same for all images, but for its strength: drawing it takes long on a CPU.
        noise = torch.randn_like(rgb[:1])
        rgb.addcmul_(noise, coverage * (draw.between(-1, 1) * self.noise))
        result = torch.cat([rgb, object_coverage], dim=1)
        return result.clamp_(0, 1).mul_(255).round_().to(torch.uint8)

    def _framed(
        self, draw: _Draws, layers: Float[Tensor, "q 4 h w"]
    ) -> tuple[Float[Tensor, "q 4 h w"], Float[Tensor, "q 1 h w"]]:
        """Return the layers as another camera shows them, and their coverage spread out."""
        height, width = layers.shape[2:]
        angle = draw.between(-1, 1) * math.radians(self.roll)
        size = draw.factor(self.scale)
        cos, sin = angle.cos() / size, angle.sin() / size
        move_x, move_y = (draw.between(-1, 1) * 2 * self.shift for _ in range(2))
        aspect = width / height  # `grid_sample` measures x in half widths
        rows = [cos / aspect, sin / aspect, move_x / aspect, -sin, cos, move_y]
        camera = torch.cat(rows, dim=1).view(-1, 2, 3)
        # Half the size is what small photographs have; between four pixels it is their mean.
        small = _seen(layers, camera, height // 2, width // 2)
        blurred = functional.interpolate(small, (height, width), mode="bilinear")
        amount = draw.between(0, 1) * draw.chosen(self.blur)
        return torch.lerp(_seen(layers, camera, height, width), blurred, amount), blurred[:, 3:]

    def _not_hidden(self, draw: _Draws, x: Tensor, y: Tensor) -> Float[Tensor, "q 1 h w"]:
        """Return 0 where something hides the object, 1 elsewhere."""
        hidden_x, hidden_y = (
            (places - draw.between(-0.6, 0.6)).abs() < draw.between(0.3, 1) * _ERASED
            for places in (x, y)
        )
        return 1 - hidden_x * (hidden_y * draw.chosen(self.erasing))

    def _background(
        self, draw: _Draws, wider: Tensor, x: Tensor, y: Tensor
    ) -> Float[Tensor, "q 1 h w"]:
        """Return where the background is left in: at outlines, in a patch or everywhere."""
        bell_x, bell_y = (
            ((places - draw.between(-0.5, 0.5)) / draw.between(*_PATCH)).square().neg().exp()
            for places in (x, y)
        )
        patch = ((bell_x * (bell_y * draw.chosen(self.patch))) - 0.35).mul_(8)
        everything = draw.chosen(self.background)
        return torch.maximum(torch.maximum(wider, patch), everything).clamp_(max=1)

    def _coloured(
        self, draw: _Draws, layers: Float[Tensor, "q 4 h w"], x: Tensor, y: Tensor
    ) -> Float[Tensor, "q 3 h w"]:
        """Return the object in other colours and another light, times its coverage."""
        coverage = layers[:, 3:]
        matrix, added = self._colour_map(draw)
        # Colours times coverage are coverage less ink.
        of_coverage = matrix.sum(2, keepdim=True) + added
        rgb = torch.cat([-matrix, of_coverage], dim=2) @ layers.flatten(2)
        rgb = rgb.unflatten(2, layers.shape[2:])
        side_x, side_y = draw.direction(self.light)
        rgb *= 1 + (side_x * x + side_y * y)
        torch.minimum(rgb.clamp_(min=0), coverage, out=rgb)
        lift = (coverage - rgb).mul_(draw.between(-1, 1) * self.gamma)
        return rgb.addcmul_(rgb, lift)

    def _colour_map(self, draw: _Draws) -> tuple[Float[Tensor, "q 3 3"], Float[Tensor, "q 1 1"]]:
        """Return matrices for colours in [0, 1], and what they add to each channel."""
        eye = torch.eye(3, device=draw.device)
        grey = torch.full_like(eye, 1 / 3)
        turned = (eye.roll(1, 0) - eye.roll(-1, 0)) / math.sqrt(3)  # about the axis of greys
        angle = draw.between(-1, 1)[..., 0] * (2 * math.pi * self.hue)
        hues = angle.cos() * (eye - grey) + angle.sin() * turned
        vivid = draw.factor(self.saturation) * (1 - draw.chosen(self.grey))
        gain = draw.factor(self.brightness) * draw.factor(self.tint, channels=3)
        contrast = draw.factor(self.contrast)[..., 0]
        matrix = contrast * gain[..., 0] * (grey + vivid[..., 0] * hues)
        return matrix, (1 - contrast) / 2


class _Draws:
    """Random numbers for each of q images, (q, 1, 1, 1) or one for each channel, on the device."""

    def __init__(self, count: int, device: torch.device) -> None:
        self.count, self.device = count, device

    def between(self, low: float, high: float, channels: int = 1) -> Tensor:
        """Return numbers between two."""
        shape = (self.count, channels, 1, 1)
        return torch.rand(shape, device=self.device) * (high - low) + low

    def factor(self, strength: float, channels: int = 1) -> Tensor:
        """Return factors between 1 / (1 + strength) and its inverse, their logarithms uniform."""
        return (self.between(-1, 1, channels) * math.log1p(strength)).exp()

    def chosen(self, share: float) -> Tensor:
        """Return 1 for that share of images, 0 for others."""
        return (self.between(0, 1) < share).float()

    def direction(self, strength: float) -> tuple[Tensor, Tensor]:
        """Return x and y of arrows up to that long."""
        angle, length = self.between(-math.pi, math.pi), self.between(0, strength)
        return length * angle.cos(), length * angle.sin()


def _positions(images: Tensor) -> tuple[Float[Tensor, "1 1 1 w"], Float[Tensor, "1 1 h 1"]]:
    """Return where the centres of columns and rows are, in half heights from the image's centre."""
    height, width = images.shape[2:]
    x, y = (
        (2 * torch.arange(size, device=images.device) + 1 - size) / height
        for size in (width, height)
    )
    return x.view(1, 1, 1, -1), y.view(1, 1, -1, 1)


def _seen(
    layers: Float[Tensor, "q c h w"], camera: Float[Tensor, "q 2 3"], height: int, width: int
) -> Float[Tensor, "q c rows columns"]:
    """Sample layers, which are 0 beyond their borders, where an affine map of positions leads."""
    x, y = (
        (2 * torch.arange(size, device=layers.device) + 1) / size - 1 for size in (width, height)
    )
    aspect = layers.shape[3] / layers.shape[2]
    places = torch.stack([(x * aspect).expand(height, -1), y[:, None].expand(-1, width)], dim=-1)
    places = functional.pad(places, (0, 1), value=1).flatten(0, 1)
    grid = (places @ camera.mT).unflatten(1, (height, width))
    return functional.grid_sample(layers, grid, align_corners=False)
