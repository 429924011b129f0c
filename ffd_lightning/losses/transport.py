"""Transport of one point cloud onto another, cheap enough for every template of every step."""

from __future__ import annotations

from jaxtyping import Float
from torch import Tensor
from torch.nn import functional

from ffd_lightning.components import check_ranges, component
from ffd_lightning.losses.terms import StepInput


@component("term", "sliced_wasserstein")
class SlicedWasserstein:
    r"""Sliced Wasserstein distance of each deformed template: what uneven density costs.

    $$ 1000 \cdot \frac{3}{K N} \sum_{k=1}^{K} \sum_{i=1}^{N}
              \left( \langle \theta_k, s \rangle_{(i)} - \langle \theta_k, \tilde s \rangle_{(i)}
              \right)^2 $$

    over K random directions and the N points of each cloud, sorted along each direction. Every
    point is carried onto one of its own, as in the Earth Mover's distance, where the Chamfer
    distance lets many points share a neighbour. The factor 3 makes up for what a direction sees of
    a distance in space, so that moving a cloud by d costs 1000 d^2.

    Args:
        directions: K, on which the clouds are sorted, drawn anew in each step.
        points: N, of each cloud, at most; of more points in a cloud, evenly spread ones are taken.

    Source: Bonneel et al. 2015, "Sliced and Radon Wasserstein barycenters of measures", section 3.
    """

    def __init__(self, directions: int = 8, points: int = 256) -> None:
        check_ranges(locals(), directions="(0, inf)", points="(0, inf)")
        self.directions, self.points = directions, points

    def __call__(self, inputs: StepInput) -> Float[Tensor, "queries templates"]:
        """Return the distances, (q, T)."""
        clouds = inputs.pred_points, inputs.target_points[:, None]
        points = min(self.points, *(cloud.shape[-2] for cloud in clouds))
        axes = functional.normalize(clouds[0].new_empty(3, self.directions).normal_(), dim=0)
        # Sorted along the last, contiguous axis.
        along, goal = (
            (_spread(cloud, points) @ axes).mT.contiguous().sort(dim=-1).values for cloud in clouds
        )
        return 3000 * (along - goal).square().mean((-1, -2))


def _spread(cloud: Float[Tensor, "*batch all 3"], count: int) -> Float[Tensor, "*batch count 3"]:
    """Return so many points of a cloud, evenly spread over their order."""
    return cloud[..., :: cloud.shape[-2] // count, :][..., :count, :]
