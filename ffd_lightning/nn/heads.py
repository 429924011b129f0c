"""What stands on top of the encoder: bottleneck, shared dense layer, template heads."""

from __future__ import annotations

from jaxtyping import Float
from torch import Tensor, nn

from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.encoders.base import BATCH_NORM_EPS


class TemplateHeads(nn.Module):
    """From a feature map to one logit and one set of offsets for each template.

    Convolution and dense layers start from Glorot's uniform distribution and zero biases; those
    that batch norm follows have no bias, since it would take it away again. Offsets start close to
    zero: training starts from the undeformed templates.

    Args:
        in_channels: channels of the feature map.
        map_size: (h, w) of the feature map.
        num_templates: T.
        num_control_points: M.
        bottleneck: channels after the 1 x 1 convolution.
        hidden: width of the shared dense layer.
        offset_std: standard deviation of the offset layer's first weights, in template units.
        batch_norm_momentum: share of a new batch in the moving statistics.

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
        self.logits = nn.Linear(hidden, num_templates)
        self.offsets = nn.Linear(hidden, num_templates * num_control_points * 3)
        self._offsets_shape = (num_templates, num_control_points, 3)
        self._initialize(offset_std)

    def _initialize(self, offset_std: float) -> None:
        for module in self.modules():
            if isinstance(module, nn.Conv2d | nn.Linear):
                nn.init.xavier_uniform_(module.weight)
                if module.bias is not None:
                    nn.init.zeros_(module.bias)
        nn.init.normal_(self.offsets.weight, std=offset_std)

    def forward(
        self, features: Float[Tensor, "q c h w"]
    ) -> tuple[Float[Tensor, "q templates"], Float[Tensor, "q templates control_points 3"]]:
        """Return template logits, (q, T), and control point offsets, (q, T, M, 3).

        Raises:
            ConfigError: a batch of one image in training mode, which has no batch statistics.
        """
        if self.training and features.shape[0] == 1:
            raise ConfigError(
                "batch norm cannot train on a batch of one image: use schedule.batch_size=2 or "
                "more and drop an incomplete last batch"
            )
        hidden = self.shared(self.bottleneck(features))
        return self.logits(hidden), self.offsets(hidden).unflatten(1, self._offsets_shape)
