"""Selection of templates that are told: what the likely ones become says which is right."""

import torch
from jaxtyping import Float, UInt8
from torch import Tensor

from ffd_lightning.geometry.ffd import TemplateSample, deform
from ffd_lightning.nn.viewpoint import Views

POINTS = 256
"""Of each template and of an image's object, that are compared: half of them are too noisy."""
_LIKELY = 24  # templates that vote: a few dozen hold nearly all of the probability
_UNIT = 1000.0  # of distances, as that of costs in training
_VOTES = 0.3  # exponent of strangers' probabilities that vote: a network is too sure of them
_COVERED = 128  # of 255: a pixel is the object's
_FEWEST = 16  # pixels that say something of an outline


def consensus_logits(
    logits: Float[Tensor, "q templates"],
    offsets: Float[Tensor, "q templates control_points 3"],
    templates: TemplateSample,
    mask: UInt8[Tensor, "q height width"] | None = None,
    views: Views | None = None,
    strangers: bool = False,
) -> Float[Tensor, "q templates"]:
    r"""Return logits of what a template becomes, beside what the network says of it as it is.

    $$ \log \gamma_t - \sum_s v_s \, \lambda(\tilde s_t, \tilde s_s)
              - \sum_a p_a \, \lambda(\pi_a(\tilde s_t), m) $$

    Probabilities gamma say which templates fit. Deformed towards the image, those that fit become
    much the same shape, and those that do not become others. So a template's expected Chamfer
    distance lambda (x 1000) to the truth is estimated by that to the other deformed templates (a
    minimum Bayes risk decision). Votes v are the probabilities; of strangers they are flattened,
    v ~ gamma^0.3, as a network is too sure of templates that it never saw. The cameras that may
    have taken the image, with probabilities p, project the deformed points by pi; these are
    compared with the object's pixels m, both scaled to a longer side of 1. Without this, a network
    that is told templates selects worse than it deforms.

    Args:
        logits: of templates.
        offsets: of their control points.
        templates: some points of each.
        mask: of the object in the images; None for no outlines.
        views: cameras that may have taken the images; None for no outlines.
        strangers: the network was trained with none of the templates.
    """
    log_probs = logits.log_softmax(1)
    top, index = log_probs.topk(min(_LIKELY, logits.shape[1]), dim=1)
    queries = torch.arange(logits.shape[0], device=logits.device)[:, None]
    matrix, control_points, _ = templates
    clouds = deform(matrix[index], control_points[index], offsets[queries, index])
    # Image by image: a whole batch fits in no cache. An exported graph takes any batch.
    parts = (clouds,) if torch.compiler.is_exporting() else clouds.split(1)
    distances = torch.cat(
        [torch.stack([_chamfer(cloud, part) for cloud in part.unbind(1)], dim=1) for part in parts]
    )
    risk = (distances @ ((_VOTES if strangers else 1.0) * top).softmax(1)[..., None])[..., 0]
    if mask is not None and views is not None:
        risk = risk + _outline_distances(clouds, mask, views)
    unlikely = risk.amax(1, keepdim=True).expand_as(log_probs)
    return log_probs - _UNIT * unlikely.scatter(1, index, risk)


def _outline_distances(
    clouds: Float[Tensor, "q t n 3"], mask: UInt8[Tensor, "q height width"], views: Views
) -> Float[Tensor, "q t"]:
    """Return how far projected points are from the object's pixels; 0 where there are too few."""
    found = []
    for points, covered, probs, matrices in zip(clouds, mask >= _COVERED, *views, strict=True):
        rows, columns = covered.nonzero(as_tuple=True)
        if len(rows) < _FEWEST:
            found.append(points.new_zeros(len(points)))
            continue
        some = torch.linspace(0, len(rows) - 1, POINTS, device=rows.device).long()
        pixels = _scaled(torch.stack([columns[some], -rows[some]], dim=1).to(points.dtype))
        apart = []
        for matrix in matrices.to(points.dtype):
            seen = points @ matrix[:, :3].T + matrix[:, 3]
            flat = _scaled(seen[..., :2] / seen[..., 2:].clamp_min(1e-3))
            apart.append(_chamfer(pixels[None], flat[None])[0])
        found.append(probs @ torch.stack(apart))
    return torch.stack(found)


def _scaled(points: Float[Tensor, "*batch n 2"]) -> Float[Tensor, "*batch n 2"]:
    """Move and scale points to a bounding box around 0 whose longer side is 1."""
    low, high = points.amin(-2, keepdim=True), points.amax(-2, keepdim=True)
    return (points - (low + high) / 2) / (high - low).amax(-1, keepdim=True).clamp_min(1e-6)


def _chamfer(
    cloud: Float[Tensor, "q n d"], others: Float[Tensor, "q t m d"]
) -> Float[Tensor, "q t"]:
    """Return the Chamfer distance, a mean over points, of one cloud to others."""
    apart = torch.cdist(cloud[:, None], others)
    return apart.amin(3).square().mean(2) + apart.amin(2).square().mean(2)
