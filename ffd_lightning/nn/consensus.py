"""Selection among strangers: the likely templates, deformed, vote on which of them is right."""

from __future__ import annotations

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.geometry.ffd import TemplateSample

POINTS = 256
"""Of each template, that are compared."""
_LIKELY = 24  # templates that vote: a few dozen hold nearly all of the probability
_UNIT = 1000.0  # of distances, as that of costs in training


def consensus_logits(
    logits: Float[Tensor, "q templates"],
    offsets: Float[Tensor, "q templates control_points 3"],
    templates: TemplateSample,
) -> Float[Tensor, "q templates"]:
    r"""Return logits lowered by how far a template is from what the others become.

    $$ \log \gamma_t - \sum_s \gamma_s \, \lambda(\tilde s_t, \tilde s_s) $$

    Probabilities gamma say which templates fit. Deformed towards the image, those that fit become
    much the same shape, and those that do not become others. So a template's expected Chamfer
    distance lambda (x 1000) to the truth is estimated by that to the other deformed templates (a
    minimum Bayes risk decision). Without it, a network that is told templates that it never saw
    selects worse than it deforms.

    Args:
        logits: of templates.
        offsets: of their control points.
        templates: some points of each.
    """
    log_probs = logits.log_softmax(1)
    top, index = log_probs.topk(min(_LIKELY, logits.shape[1]), dim=1)
    queries = torch.arange(len(logits), device=logits.device)[:, None]
    sample = TemplateSample(
        templates.deformation_matrix[index], templates.control_points[index], templates.degrees
    )
    clouds = sample.deformed(offsets[queries, index])
    distances = torch.stack([_chamfer(cloud, clouds) for cloud in clouds.unbind(1)], dim=1)
    risk = _UNIT * (distances @ top.exp()[..., None])[..., 0]
    unlikely = risk.amax(1, keepdim=True).expand_as(log_probs)
    return log_probs - unlikely.scatter(1, index, risk)


def _chamfer(
    cloud: Float[Tensor, "q n 3"], others: Float[Tensor, "q t m 3"]
) -> Float[Tensor, "q t"]:
    """Return the Chamfer distance, a mean over points, of one cloud to others."""
    squared = torch.cdist(cloud[:, None], others).square()
    return squared.amin(3).mean(2) + squared.amin(2).mean(2)
