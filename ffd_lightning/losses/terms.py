"""Terms of the objective: what is added up, each under a weight of its own."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import torch
from jaxtyping import Float
from torch import Tensor
from torch.nn.functional import normalize

from ffd_lightning.components import check_ranges, component
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import TemplateSample, bending_energy
from ffd_lightning.geometry.jacobian import lattice_determinants


@runtime_checkable
class Prediction(Protocol):
    """What terms and selections read of a network's output: an `FfdPrediction` has it."""

    @property
    def template_weights(self) -> Tensor:
        """Template weights, (q, T)."""
        ...

    @property
    def template_logits(self) -> Tensor:
        """Template logits, (q, T)."""
        ...

    @property
    def offsets(self) -> Tensor:
        """Control point offsets, (q, T, M, 3)."""
        ...


@dataclass(frozen=True)
class StepInput:
    """All that a term or a selection may need of a training step; what is costly is computed once.

    A step is one batch, unless its gradients are accumulated over several, or its queries are split
    over devices: what the terms give for each share of the queries is added up.

    Attributes:
        prediction: of the network, for q queries and T templates: `template_logits` and
            `template_weights`, (q, T), and `offsets` of the control points, (q, T, M, 3).
        target_points: ground truth point clouds, (q, N', 3).
        templates: B of the templates' points, (T, N, M), their control points P, (T, M, 3), and the
            degrees of their lattices.
        step: index of the step, from 0.
        batch_weights: template weights of the whole batch, (Q, T), where its queries are split
            over devices; else those of the prediction.
        num_queries: of the step, over all accumulated batches and devices. A mean over queries is
            the sum over q divided by this.
    """

    prediction: Prediction
    target_points: Float[Tensor, "queries num_target 3"]
    templates: TemplateSample
    step: int
    batch_weights: Float[Tensor, "all_queries templates"]
    num_queries: int

    @cached_property
    def pred_points(self) -> Float[Tensor, "queries templates num_points 3"]:
        """Deformed points of every template for every query, (q, T, N, 3)."""
        return self.templates.deformed(self.prediction.offsets)

    @cached_property
    def chamfer(self) -> Float[Tensor, "queries templates"]:
        """Squared Chamfer distance of each deformed template, summed over points, (q, T)."""
        return chamfer_distance(self.pred_points, self.target_points[:, None])

    @property
    def mean_count(self) -> float:
        """Points of a cloud, the mean over both: what makes a mean over points of `chamfer`."""
        return (self.pred_points.shape[-2] + self.target_points.shape[-2]) / 2


Term = Callable[[StepInput], Tensor]
"""A term: either a cost of every template for every query, (q, T), which the selection weighs and
sums, or one number, (), for all queries. Terms that are an `nn.Module` may have parameters, which
are trained, and buffers: a checkpoint keeps both."""


@component("term", "chamfer")
class Chamfer:
    r"""Chamfer distance of each deformed template, a sum over points.

    It is $\lambda_c(s^{(q)}, \tilde s^{(qt)})$.

    Source: the paper's equations 1 and 7.
    """

    def __call__(self, inputs: StepInput) -> Float[Tensor, "queries templates"]:
        """Return it, (q, T)."""
        return inputs.chamfer


@component("term", "mean_chamfer")
class MeanChamfer:
    """1,000 x the Chamfer distance as a mean over points: the same for any number of points.

    What other costs and temperatures are weighed against.
    """

    def __call__(self, inputs: StepInput) -> Float[Tensor, "queries templates"]:
        """Return it, (q, T)."""
        return inputs.chamfer * (1000 / inputs.mean_count)


@component("term", "lattice_bending")
class LatticeBending:
    """What bends a template: the bending energy of its offsets, see `bending_energy`."""

    def __call__(self, inputs: StepInput) -> Float[Tensor, "queries templates"]:
        """Return it, (q, T)."""
        return bending_energy(inputs.prediction.offsets, inputs.templates.degrees)


@component("term", "lattice_folding")
class LatticeFolding:
    r"""What a template's deformation turns inside out, at the places of the control points.

    $$ \frac 1 M \sum_m \log\left(1 + \max(0, -\det J(P_m))^2\right) $$

    J is the Jacobian of the deformation, see `lattice_determinants`. Whatever is not folded over
    costs nothing, however it is bent or stretched. A determinant is a product of three
    displacements, each relative to the lattice's size, which is small for thin templates: without
    the logarithm one bad step of a training outweighs all others.
    """

    def __call__(self, inputs: StepInput) -> Float[Tensor, "queries templates"]:
        """Return it, (q, T)."""
        _, control_points, degrees = inputs.templates
        turned = -lattice_determinants(inputs.prediction.offsets, control_points, degrees)
        return turned.relu().square().log1p().mean(-1)


@component("term", "negative_entropy")
class NegativeEntropy:
    r"""Negative entropy of the batch's mean template weights, in nats.

    $$ \lambda_e = \sum_t \bar\gamma^{(t)} \log \bar\gamma^{(t)} $$

    Lowest, -log T, when the batch as a whole uses all templates evenly; single queries may still
    be confident. Of a step of several accumulated batches each gives its share: the mean of their
    entropies takes the place of the entropy of all, which is equal where their mean weights are.

    Source: the paper's section 4.1, equation 11.
    """

    def __call__(self, inputs: StepInput) -> Float[Tensor, ""]:
        """Return it, ()."""
        mean = inputs.batch_weights.mean(0)
        share = len(inputs.batch_weights) / inputs.num_queries
        # At a weight of 0 the logarithm's slope is infinite, and nan times the softmax's, 0.
        logs = mean.clamp_min(torch.finfo(mean.dtype).tiny)
        return share * torch.xlogy(mean, logs).sum()


@component("term", "offset_penalty")
class OffsetPenalty:
    r"""Squared norm of the offsets under the template weights.

    $$ \lambda_r = \sum_{q,t} \gamma^{(qt)} |\Delta P^{(qt)}|^2 $$

    Source: the paper's section 4.1, equation 14.
    """

    def __call__(self, inputs: StepInput) -> Float[Tensor, ""]:
        """Return it, ()."""
        squares = inputs.prediction.offsets.square().sum((-1, -2))
        return (inputs.prediction.template_weights * squares).sum()


@component("term", "uniform_penalty")
class UniformPenalty:
    r"""Squared norm of the offsets of all templates alike, whatever their weights.

    $$ \sum_{q,t} |\Delta P^{(qt)}|^2 $$

    Source: the authors' released code; the paper weighs them, see `offset_penalty`.
    """

    def __call__(self, inputs: StepInput) -> Float[Tensor, ""]:
        """Return it, ()."""
        return inputs.prediction.offsets.square().sum()


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
        axes = normalize(clouds[0].new_empty(3, self.directions).normal_(), dim=0)
        spread = [x[..., :: x.shape[-2] // points, :][..., :points, :] for x in clouds]
        # Sorted along the last, contiguous axis.
        along, goal = ((x @ axes).mT.contiguous().sort(dim=-1).values for x in spread)
        return 3000 * (along - goal).square().mean((-1, -2))
