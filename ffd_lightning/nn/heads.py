"""Heads: from the encoder's feature map to template logits and control point offsets.

The paper's heads have a slice of their last layer for each template, and know no other templates
than those they were trained with. Conditioned heads are told their templates instead: a code of
each, from its point cloud and its own picture, so that any meshes can be templates after training.
"""

from abc import abstractmethod
from typing import ClassVar

import torch
from jaxtyping import Float
from torch import Tensor, nn

from ffd_lightning.components import Positive, component
from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.base import BATCH_NORM_EPS

_POINT_SCALE = 4.0  # clouds have a bounding-box diagonal of 1: brings coordinates to about -1 to 1
_LOW_RANK_SCALE = 0.01  # Adam's steps have the size of the learning rate: too large for products


class Heads(nn.Module):
    """What all heads have: a trunk of one 1 x 1 convolution and one dense layer.

    Layers start from Glorot's uniform distribution and zero biases; those that batch norm follows
    have no bias, since it would take it away again. Offsets start close to zero: training starts
    from the undeformed templates. A subclass makes its layers after these, `offsets` last, and then
    calls `initialize`.

    Args:
        in_channels: channels of the feature map.
        map_size: (h, w) of the feature map.
        bottleneck: channels after the 1 x 1 convolution.
        hidden: width of the dense layer.
        batch_norm_momentum: share of a new batch in the moving statistics.

    Attributes:
        conditioned: whether the heads are told their templates, and so have `codes`.
        offsets: the layer that gives offsets.
    """

    conditioned: ClassVar[bool] = False
    offsets: nn.Linear

    def __init__(
        self,
        in_channels: int,
        map_size: tuple[int, int],
        bottleneck: int = 64,
        hidden: int = 512,
        batch_norm_momentum: float = 0.1,
    ) -> None:
        super().__init__()
        self.bottleneck = nn.Sequential(
            nn.Conv2d(in_channels, bottleneck, 1, bias=False),
            nn.BatchNorm2d(bottleneck, BATCH_NORM_EPS, batch_norm_momentum),
            nn.ReLU6(),
        )
        self.shared = nn.Sequential(
            nn.Flatten(),
            nn.Linear(bottleneck * map_size[0] * map_size[1], hidden, bias=False),
            nn.BatchNorm1d(hidden, BATCH_NORM_EPS, batch_norm_momentum),
            nn.ReLU6(),
        )

    def initialize(self, offset_std: float) -> None:
        """Draw the first weights of all layers.

        Args:
            offset_std: standard deviation of the offset layer's, in template units.
        """
        for module in self.modules():
            if isinstance(module, nn.Conv2d | nn.Linear):
                nn.init.xavier_uniform_(module.weight)
                if module.bias is not None:
                    nn.init.zeros_(module.bias)
        nn.init.normal_(self.offsets.weight, std=offset_std)

    def hidden(self, features: Float[Tensor, "q c h w"]) -> Float[Tensor, "q hidden"]:
        """Return the dense layer's output, (q, hidden).

        Raises:
            ConfigError: a batch of one image in training.
        """
        if self.training and features.shape[0] == 1:
            raise ConfigError(
                "batch norm cannot train on a batch of one image: use schedule.batch_size=2 or "
                "more and drop an incomplete last batch"
            )
        return self.shared(self.bottleneck(features))

    @abstractmethod
    def forward(
        self, hidden: Float[Tensor, "q hidden"], codes: Float[Tensor, "templates code"] | None
    ) -> tuple[Float[Tensor, "q templates"], Float[Tensor, "q templates control_points 3"]]:
        """Return template logits, (q, T), and control point offsets, (q, T, M, 3).

        Args:
            hidden: of `hidden`.
            codes: of `codes`, where the heads are conditioned; else None.
        """
        raise NotImplementedError

    def codes(
        self,
        points: Float[Tensor, "templates num_points 3"],
        hidden: Float[Tensor, "templates hidden"],
    ) -> Float[Tensor, "templates code"]:
        """Return what conditioned heads are told of T templates.

        Args:
            points: surface samples, of a bounding-box diagonal of 1, (T, N, 3).
            hidden: of `hidden`, of a picture of each.
        """
        raise NotImplementedError


@component("heads", "per_template")
class TemplateHeads(Heads):
    """One slice of the last layers for each template (the paper's).

    Other arguments are those of `Heads` and of its `initialize`.

    Args:
        num_templates: T.
        num_control_points: M.

    Source: the paper's table of layers, below its MobileNet row.
    """

    def __init__(
        self,
        in_channels: int,
        map_size: tuple[int, int],
        num_templates: int,
        num_control_points: int,
        bottleneck: int = 64,
        hidden: int = 512,
        offset_std: float = 1e-4,
        batch_norm_momentum: float = 0.1,
    ) -> None:
        super().__init__(in_channels, map_size, bottleneck, hidden, batch_norm_momentum)
        self.logits = nn.Linear(hidden, num_templates)
        self.offsets = nn.Linear(hidden, num_templates * num_control_points * 3)
        self._offsets_shape = (num_templates, num_control_points, 3)
        self.initialize(offset_std)

    def forward(
        self, hidden: Float[Tensor, "q hidden"], codes: Tensor | None = None
    ) -> tuple[Float[Tensor, "q templates"], Float[Tensor, "q templates control_points 3"]]:
        """See `Heads`."""
        return self.logits(hidden), self.offsets(hidden).unflatten(1, self._offsets_shape)


@component("heads", "conditioned")
class ConditionedHeads(Heads):
    r"""Heads that are told their templates, so that any meshes can be templates after training.

    A template's code is of two halves: of its cloud, by a small PointNet, and of its own picture,
    which passes the same encoder and trunk as the photograph. With the trunk's output h of an image
    and the code c of a template,

    $$ \text{logit} = \frac{(W_q h) \cdot (W_k c)}{\sqrt d}, \quad
              \Delta P = \text{MLP}(W_h h + W_c c) + \tfrac{1}{100} W_o (V_h h \odot V_c c) . $$

    The last term is what the paper's last layer, a matrix for each template, becomes when the
    matrices are a function of codes and share a low rank.

    Training draws templates anew each step, from all shapes that are trained on, up to half of them
    from the run's own templates.

    Other arguments are those of `Heads` and of its `initialize`.

    Args:
        num_control_points: M.
        draw: templates that a training step draws; of several categories it takes a few, and 8 of
            each.
        code: size of each half of a code.
        width: of the layers between codes and offsets.
        key: d, size of what is compared to select a template.
        rank: of the last term of the offsets.

    Sources: C. R. Qi et al., "PointNet", CVPR 2017; retrieval and deformation learnt together, each
    side with an embedding of its own: M. A. Uy et al., CVPR 2021.
    """

    conditioned = True

    def __init__(
        self,
        in_channels: int,
        map_size: tuple[int, int],
        num_control_points: int,
        bottleneck: int = 64,
        hidden: int = 512,
        offset_std: float = 1e-4,
        batch_norm_momentum: float = 0.1,
        *,
        draw: Positive = 24,
        code: Positive = 128,
        width: Positive = 256,
        key: Positive = 64,
        rank: Positive = 512,
    ) -> None:
        super().__init__(in_channels, map_size, bottleneck, hidden, batch_norm_momentum)
        self.draw = draw
        self.points = nn.Sequential(
            *(nn.Linear(3, 64), nn.ReLU(), nn.Linear(64, 128), nn.ReLU(), nn.Linear(128, 256))
        )
        self.cloud_code = nn.Sequential(
            *(nn.Linear(512, 256), nn.ReLU(), nn.Linear(256, code), nn.LayerNorm(code))
        )
        self.picture_code = nn.Linear(hidden, code)
        self.query, self.key = nn.Linear(hidden, key), nn.Linear(2 * code, key)
        self.of_image, self.of_code = nn.Linear(hidden, width), nn.Linear(2 * code, width)
        self.mix = nn.Sequential(nn.ReLU(), nn.Linear(width, width), nn.ReLU())
        self.low_rank_image, self.low_rank_code = nn.Linear(hidden, rank), nn.Linear(2 * code, rank)
        self.low_rank = nn.Linear(rank, num_control_points * 3, bias=False)
        self.offsets = nn.Linear(width, num_control_points * 3)
        self.initialize(offset_std)

    def codes(
        self,
        points: Float[Tensor, "templates num_points 3"],
        hidden: Float[Tensor, "templates hidden"],
    ) -> Float[Tensor, "templates code"]:
        """See `Heads`."""
        each = self.points(points * _POINT_SCALE)
        cloud = self.cloud_code(torch.cat([each.amax(1), each.mean(1)], dim=1))
        return torch.cat([cloud, self.picture_code(hidden)], dim=1)

    def forward(
        self, hidden: Float[Tensor, "q hidden"], codes: Float[Tensor, "templates code"] | None
    ) -> tuple[Float[Tensor, "q templates"], Float[Tensor, "q templates control_points 3"]]:
        """See `Heads`."""
        assert codes is not None
        keys = self.key(codes)
        logits = self.query(hidden) @ keys.T / keys.shape[1] ** 0.5
        mixed = self.mix(self.of_image(hidden)[:, None] + self.of_code(codes))
        product = self.low_rank_image(hidden)[:, None] * self.low_rank_code(codes)
        offsets = self.offsets(mixed) + _LOW_RANK_SCALE * self.low_rank(product)
        return logits, offsets.unflatten(2, (-1, 3))
