"""The network: from images to template weights and control point offsets."""

import math
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from numpy.typing import NDArray
from torch import Tensor, nn

from ffd_lightning.components import Component, check_ranges
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry import ffd
from ffd_lightning.geometry.ffd import Degrees, TemplateSample, mirrored_offsets
from ffd_lightning.nn.consensus import consensus_logits
from ffd_lightning.nn.encoders.base import ImageEncoder
from ffd_lightning.nn.heads import Heads
from ffd_lightning.nn.viewpoint import ViewpointHead, Views, likely_views

_CLOUD_POINTS = 1024  # that a code is made from


class FfdPrediction(NamedTuple):
    """What the network says about q images, for each of T templates of M control points.

    Attributes:
        template_probs: (q, T) softmax of the logits.
        template_weights: (q, T) probabilities mixed with their floor; they sum to 1.
        offsets: (q, T, M, 3) displacements of the control points, in template units.
        template_logits: (q, T), for losses in log space.
        viewpoint: (q, 37), from where the images were taken, see `nn.viewpoint`; None of networks
            that saw all objects from one side.
    """

    template_probs: Float[Tensor, "q templates"]
    template_weights: Float[Tensor, "q templates"]
    offsets: Float[Tensor, "q templates control_points 3"]
    template_logits: Float[Tensor, "q templates"]
    viewpoint: Float[Tensor, "q bins"] | None = None

    @property
    def template_index(self) -> Int[Tensor, " q"]:
        """The selected template t* of each image, (q,): of the largest weight (equation 9)."""
        return self.template_weights.argmax(dim=1)


def standardize(
    images: Float[Tensor, "q 3 height width"] | UInt8[Tensor, "q 3 height width"],
) -> Float[Tensor, "q 3 height width"]:
    r"""Give every image zero mean and unit deviation over all of its n values.

    $$ (x - \bar x) / \max(\sigma(x), 1 / \sqrt n) $$

    The lower bound keeps constant images finite. The scale of the input does not matter otherwise:
    0 to 255 and 0 to 1 give the same.

    Returns float32 (float64 for float64).

    Source: TensorFlow's `tf.image.per_image_standardization`, as the paper's authors used it.

    >>> standardize(torch.tensor([0, 10]).repeat(1, 3, 4, 1).byte()).round(decimals=5).unique()
    tensor([-1.,  1.])
    """
    values = images.to(torch.promote_types(images.dtype, torch.float32))
    size = math.prod(values.shape[1:])
    # Two reductions: `torch.std_mean` is many times slower on a CPU. The norm of the rows' norms:
    # added up in one go, so many squares are off by a thousandth in float32.
    centred = values - values.mean(dim=(1, 2, 3), keepdim=True)
    rows = torch.linalg.vector_norm(centred, dim=3, keepdim=True)
    std = torch.linalg.vector_norm(rows, dim=(1, 2), keepdim=True) / math.sqrt(size)
    return centred / std.clamp_min(1 / math.sqrt(size))


class DrawnTemplates(NamedTuple):
    """What conditioned heads are told of a training step's T templates.

    Attributes:
        points: (T, N, 3).
        images: a picture of each, (T, 3, H, W) uint8.
    """

    points: Float[Tensor, "templates num_points 3"]
    images: UInt8[Tensor, "templates 3 height width"]


class TemplateFfdNetwork(nn.Module):
    r"""Selects a template for an image and deforms every template towards it.

    Convention:
        Templates count in the order of the template bank, control points in that of the lattice.

    Args:
        encoder: turns standardised images into a feature map.
        image_size: (height, width) in pixels.
        num_templates: T; conditioned heads take any number.
        num_control_points: M, the product of degree + 1 over the axes.
        bottleneck: channels of the 1 x 1 convolution after the encoder.
        hidden: width of the dense layer that the templates share.
        min_weight: the floor of the weights, shared out among all templates, in [0, 1].
        offset_std: deviation of the offset layer's first weights.
        batch_norm_momentum: share of a new batch in moving statistics, of the heads alone.
        shrink: images are averaged over squares of so many pixels along each side, before the
            encoder sees them.
        mirror_degrees: of the lattices, where offsets are to be averaged with their mirror image
            at the plane x = 0, which keeps symmetric templates symmetric; None leaves them free.
        heads: the component; the paper's by default.
        viewpoint: whether the network tells from where an image was taken.

    Raises:
        ValueError: a number out of its range.
        ConfigError: images too small for the encoder.

    Source: the paper's Table 1; equation 8 for the floor $\epsilon_\gamma$.
    """

    def __init__(
        self,
        encoder: ImageEncoder,
        image_size: tuple[int, int],
        num_templates: int,
        num_control_points: int,
        bottleneck: int = 64,
        hidden: int = 512,
        min_weight: float = 0.1,
        offset_std: float = 1e-4,
        batch_norm_momentum: float = 0.1,
        shrink: int = 1,
        mirror_degrees: Degrees | None = None,
        heads: Component | None = None,
        viewpoint: bool = False,
    ) -> None:
        super().__init__()
        counts = ("num_templates", "num_control_points", "bottleneck", "hidden", "shrink")
        shares = {"min_weight": "[0, 1]", "batch_norm_momentum": "[0, 1]"}
        check_ranges(locals(), **dict.fromkeys(counts, "(0, inf)"), offset_std="[0, inf)", **shares)
        if mirror_degrees and ffd.num_control_points(mirror_degrees) != num_control_points:
            points = ffd.num_control_points(mirror_degrees)
            raise ValueError(f"mirror_degrees are of {points} control points, not the network's")
        self.mirror_degrees = mirror_degrees
        self.image_size, self.shrink = tuple(image_size), shrink
        self.num_templates, self.num_control_points = num_templates, num_control_points
        self.bottleneck, self.hidden, self.min_weight = bottleneck, hidden, min_weight
        self.encoder = encoder
        self.made_of = heads or Component("heads", "per_template", {})
        self.heads: Heads = self.made_of.build(
            in_channels=encoder.out_channels,
            map_size=encoder.output_size(shrunk_size(image_size, shrink)),
            num_templates=num_templates,
            num_control_points=num_control_points,
            bottleneck=bottleneck,
            hidden=hidden,
            offset_std=offset_std,
            batch_norm_momentum=batch_norm_momentum,
        )
        self.viewpoint = ViewpointHead(hidden) if viewpoint else None
        for name in ("template_codes", "_template_matrix", "_template_control_points"):
            self.register_buffer(name, None, persistent=False)
        self._template_degrees: Degrees = (1, 1, 1)
        self.strangers = False
        self.projection: NDArray[np.float64] | None = None

    def description(self) -> dict[str, Any]:
        """Return the plain arguments that give a network of the same layers.

        Encoder and heads are components: `encoder.component` and `made_of` say what they are.
        """
        names = ("num_templates", "num_control_points", "bottleneck", "hidden", "min_weight")
        named = {name: getattr(self, name) for name in (*names, "shrink", "mirror_degrees")}
        told = {} if self.viewpoint is None else {"viewpoint": True}
        return {"image_size": list(self.image_size), **named, **told}

    def forward(
        self,
        images: Float[Tensor, "q 3 height width"] | UInt8[Tensor, "q 3 height width"],
        drawn: DrawnTemplates | None = None,
        mask: UInt8[Tensor, "q height width"] | None = None,
    ) -> FfdPrediction:
        """Predict from images as rendered: (q, 3, H, W), floating point or uint8, any scale.

        Args:
            images: of the objects.
            drawn: the templates of a training step, for conditioned heads; by default those of the
                last `use_templates`.
            mask: of the object in the images, for outlines.
        """
        if drawn is None:
            return self.predict(self.features(images), mask)
        # In one batch: batch norm sees photographs and pictures of templates alike.
        hidden = self.heads.hidden(self.features(torch.cat([images, drawn.images])))
        own, pictures = hidden.split([len(images), len(drawn.images)])
        return self._prediction(own, self.heads.codes(drawn.points, pictures))

    @torch.no_grad()
    def codes(
        self,
        points: Float[Tensor, "templates num_points 3"],
        pictures: Iterable[UInt8[np.ndarray, "views height width channels"]],
    ) -> Float[Tensor, "templates code"]:
        """Return what conditioned heads are told of templates, for `use_templates`.

        Args:
            points: clouds, (T, N, 3), of which the first 1024 points are used.
            pictures: of each, (views, H, W, 3 or 4) uint8; the codes of views are averaged.
        """
        device, codes = self.heads.offsets.weight.device, []
        with evaluating(self):
            for cloud, views in zip(points, pictures, strict=True):
                images = torch.tensor(views[..., :3], device=device).permute(0, 3, 1, 2)
                hidden = self.heads.hidden(self.features(images))
                clouds = cloud[:_CLOUD_POINTS].to(device).expand(len(hidden), -1, -1)
                codes.append(self.heads.codes(clouds, hidden).mean(0))
        return torch.stack(codes)

    def use_templates(
        self,
        codes: Float[Tensor, "templates code"],
        templates: TemplateSample,
        strangers: bool = False,
    ) -> None:
        """Tell conditioned heads the templates of all predictions to come.

        They are told by their `codes`, and by `consensus.POINTS` points of each; strangers says
        that the network was trained with none of them.
        """
        device = self.heads.offsets.weight.device
        self.template_codes, self.strangers = codes.to(device), strangers
        matrix, control_points, self._template_degrees = templates
        self._template_matrix = matrix.to(device)
        self._template_control_points = control_points.to(device)

    def features(
        self, images: Float[Tensor, "q 3 height width"] | UInt8[Tensor, "q 3 height width"]
    ) -> Float[Tensor, "q channels rows columns"]:
        """Return the encoder's feature maps of images: shrunk, standardised, encoded.

        Raises:
            DataError: images of another size than the network was built for.
        """
        if images.shape[2:] != self.image_size:
            got, need = ("x".join(map(str, size)) for size in (images.shape[2:], self.image_size))
            raise DataError(f"images are {got} pixels, the network takes {need}: resize them")
        if self.shrink > 1:
            # In float32, whatever the images are: onnxruntime pools nothing wider.
            exact = torch.promote_types(images.dtype, torch.float32)
            images = nn.functional.avg_pool2d(images.float(), self.shrink).to(exact)
        # Channels last: batch norm and depthwise convolutions are faster so; it carries through.
        inputs = standardize(images).to(
            dtype=self.heads.offsets.weight.dtype, memory_format=torch.channels_last
        )
        return self.encoder(inputs)

    def predict(
        self,
        features: Float[Tensor, "q channels rows columns"],
        mask: UInt8[Tensor, "q height width"] | None = None,
    ) -> FfdPrediction:
        """Predict from `features`; see `forward`.

        Raises:
            ConfigError: conditioned heads without templates.
        """
        if self.heads.conditioned and self.template_codes is None:
            raise ConfigError("conditioned heads need templates: call use_templates first")
        hidden = self.heads.hidden(features)
        if not self.heads.conditioned:
            return self._prediction(hidden, None)
        templates = self._template_matrix, self._template_control_points, self._template_degrees
        return self._prediction(hidden, self.template_codes, TemplateSample(*templates), mask)

    def _prediction(
        self,
        hidden: Tensor,
        codes: Tensor | None,
        templates: TemplateSample | None = None,
        mask: Tensor | None = None,
    ) -> FfdPrediction:
        # Under mixed precision the outputs are of a lower one, too coarse for losses and geometry.
        logits, offsets = (
            output.to(torch.promote_types(output.dtype, torch.float32))
            for output in self.heads(hidden, codes)
        )
        if logits.dim() != 2 or offsets.shape != (*logits.shape, self.num_control_points, 3):
            raise ConfigError(
                f"heads={self.made_of.name} must give logits (q, T), offsets (q, T, M, 3), where M "
                f"is {self.num_control_points}, not {tuple(logits.shape)}, {tuple(offsets.shape)}"
            )
        if self.mirror_degrees is not None:
            offsets = (offsets + mirrored_offsets(offsets, self.mirror_degrees)) / 2
        found = None if self.viewpoint is None else self.viewpoint(hidden).float()
        if templates is not None:
            views = None if mask is None else self._views(found, logits)
            logits = consensus_logits(logits, offsets, templates, mask, views, self.strangers)
        probs = logits.softmax(dim=1)
        weights = (1 - self.min_weight) * probs + self.min_weight / probs.shape[1]
        return FfdPrediction(probs, weights, offsets, logits, found)

    def _views(self, found: Tensor | None, like: Tensor) -> Views | None:
        """Return from where images may have been taken: by one known camera, or as `found` says."""
        if self.projection is None:
            return None if found is None else likely_views(found)
        known = like.new_tensor(self.projection).expand(len(like), 1, 3, 4)
        return Views(like.new_ones(len(like), 1), known)


@contextmanager
def evaluating(module: nn.Module) -> Iterator[None]:
    """Have a module, whose parts may be in either mode, in evaluation mode for a while."""
    modes = [(part, part.training) for part in module.modules()]
    module.eval()
    try:
        yield
    finally:
        for part, training in modes:
            part.training = training


def shrunk_size(image_size: tuple[int, int], shrink: int) -> tuple[int, int]:
    """Return (height, width) of what the encoder sees of images of (height, width) pixels.

    >>> shrunk_size((192, 256), 2)
    (96, 128)
    """
    return image_size[0] // shrink, image_size[1] // shrink


def compile_encoder(network: TemplateFfdNetwork) -> None:
    """Have `torch.compile` fuse the encoder's layers at first use; without a compiler it warns.

    Meant for GPUs, where fused layers save launches of kernels; on the CPU it gained nothing
    (benchmarks/README.md). Weights, checkpoints and results (to rounding) are the same.
    """
    import torch._dynamo  # takes longer to load than all the rest of torch

    torch._dynamo.config.suppress_errors = True
    network.encoder.compile()
