"""Transport of one point cloud onto another, cheap enough for every template of every step."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.errors import ConfigError
from ffd_lightning.losses.terms import StepInput


class SlicedWasserstein:
    r"""The sliced Wasserstein distance of each deformed template: what its points' density costs.

    .. math:: 1000 \cdot \frac{3}{K N} \sum_{k=1}^{K} \sum_{i=1}^{N}
              \left( \langle \theta_k, s \rangle_{(i)} - \langle \theta_k, \tilde s \rangle_{(i)}
              \right)^2

    over K random directions and the N points of each cloud, sorted along each direction. Every
    point is carried onto one of its own, as in the Earth Mover's distance, where the Chamfer
    distance lets many points share a neighbour. The factor 3 makes up for what a direction sees of
    a distance in space, so that moving a cloud by d costs 1000 d^2.

    Args:
        directions: K, drawn anew in each step.
        points: N; of more points in a cloud, evenly spread ones are taken.

    Source: Bonneel et al. 2015, "Sliced and Radon Wasserstein barycenters of measures", section 3.
    """

    def __init__(self, directions: int = 8, points: int = 256) -> None:
        self.directions, self.points = directions, points

    def __call__(self, inputs: StepInput) -> Float[Tensor, "queries templates"]:
        """Return the distances, (q, T).

        Raises:
            ConfigError: a cloud of the step has too few points.
        """
        pred, target = inputs.pred_points, inputs.target_points
        fewest = min(pred.shape[-2], target.shape[-2])
        if fewest < self.points:
            raise ConfigError(
                f"the term sliced_wasserstein takes {self.points} points of each cloud, there are "
                f"{fewest}: set its points, or schedule.num_points"
            )
        axes = torch.nn.functional.normalize(pred.new_empty(3, self.directions).normal_(), dim=0)
        # Sorted along the last, contiguous axis.
        along, goal = (
            (self._some(cloud) @ axes).mT.contiguous().sort(dim=-1).values
            for cloud in (pred, target[:, None])
        )
        return 3000 * (along - goal).square().mean((-1, -2))

    def _some(self, cloud: Tensor) -> Tensor:
        every = cloud.shape[-2] // self.points
        return cloud[..., ::every, :][..., : self.points, :]
