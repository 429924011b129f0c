"""Selection among strangers: what the likely templates become says which of them is right."""

from __future__ import annotations

import numpy as np
import torch
from jaxtyping import Float, UInt8
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.geometry.ffd import TemplateSample

POINTS = 256
"""Of each template, that are compared."""
_LIKELY = 24  # templates that vote: a few dozen hold nearly all of the probability
_UNIT = 1000.0  # of distances, as that of costs in training
_OUTLINE = 0.3  # weight of what a template's outline differs by
_COVERED = 128  # of 255: a pixel is the object's
_FEWEST = 16  # pixels that say something of an outline


def consensus_logits(
    logits: Float[Tensor, "q templates"],
    offsets: Float[Tensor, "q templates control_points 3"],
    templates: TemplateSample,
    mask: UInt8[Tensor, "q height width"] | None = None,
    projection: NDArray[np.float64] | None = None,
) -> Float[Tensor, "q templates"]:
    r"""Return logits of what a template becomes, beside what the network says of it as it is.

    $$ \log \gamma_t - \sum_s \gamma_s \, \lambda(\tilde s_t, \tilde s_s)
              - 0.3 \, \lambda(\pi(\tilde s_t), m) $$

    Probabilities gamma say which templates fit. Deformed towards the image, those that fit become
    much the same shape, and those that do not become others. So a template's expected Chamfer
    distance lambda (x 1000) to the truth is estimated by that to the other deformed templates (a
    minimum Bayes risk decision). Where one camera took all images, its projection pi of the
    deformed points is compared with the object's pixels m, both scaled to a longer side of 1.
    Without this, a network that is told templates that it never saw selects worse than it deforms.

    Args:
        logits: of templates.
        offsets: of their control points.
        templates: some points of each.
        mask: of the object in the images; None for no outlines.
        projection: of the camera that took them all, (3, 4), see `imaging.camera`; None where they
            are taken from several sides.
    """
    log_probs = logits.log_softmax(1)
    top, index = log_probs.topk(min(_LIKELY, logits.shape[1]), dim=1)
    queries = torch.arange(logits.shape[0], device=logits.device)[:, None]
    matrix, control_points, degrees = templates
    sample = TemplateSample(matrix[index], control_points[index], degrees)
    clouds = sample.deformed(offsets[queries, index])
    distances = torch.stack([_chamfer(cloud, clouds) for cloud in clouds.unbind(1)], dim=1)
    risk = (distances @ top.exp()[..., None])[..., 0]
    if mask is not None and projection is not None:
        risk = risk + _OUTLINE * _outline_distances(clouds, mask, projection)
    unlikely = risk.amax(1, keepdim=True).expand_as(log_probs)
    return log_probs - _UNIT * unlikely.scatter(1, index, risk)


def _outline_distances(
    clouds: Float[Tensor, "q t n 3"],
    mask: UInt8[Tensor, "q height width"],
    projection: NDArray[np.float64],
) -> Float[Tensor, "q t"]:
    """Return how far projected points are from the object's pixels; 0 where there are too few."""
    matrix = clouds.new_tensor(projection)
    seen = clouds @ matrix[:, :3].T + matrix[:, 3]
    flat = _scaled(seen[..., :2] / seen[..., 2:].clamp_min(1e-3))
    found = []
    for points, covered in zip(flat, mask >= _COVERED, strict=True):
        rows, columns = covered.nonzero(as_tuple=True)
        if len(rows) < _FEWEST:
            found.append(points.new_zeros(len(points)))
            continue
        some = torch.linspace(0, len(rows) - 1, POINTS, device=rows.device).long()
        pixels = torch.stack([columns[some], -rows[some]], dim=1).to(points.dtype)
        found.append(_chamfer(_scaled(pixels)[None], points[None])[0])
    return torch.stack(found)


def _scaled(points: Float[Tensor, "*batch n 2"]) -> Float[Tensor, "*batch n 2"]:
    """Move and scale points to a bounding box around 0 whose longer side is 1."""
    low, high = points.amin(-2, keepdim=True), points.amax(-2, keepdim=True)
    return (points - (low + high) / 2) / (high - low).amax(-1, keepdim=True).clamp_min(1e-6)


def _chamfer(
    cloud: Float[Tensor, "q n d"], others: Float[Tensor, "q t m d"]
) -> Float[Tensor, "q t"]:
    """Return the Chamfer distance, a mean over points, of one cloud to others."""
    squared = torch.cdist(cloud[:, None], others).square()
    return squared.amin(3).mean(2) + squared.amin(2).mean(2)
