"""From where an image was taken, told from what the heads see of it."""

from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor, nn
from torch.nn.functional import cross_entropy, mse_loss

_BINS = 36  # of azimuth
_WIDTH = 128
_ELEVATION_SCALE = 30.0  # degrees: brings elevations to about -1 to 2
_DISTANCE = 1.46  # of a camera that frames a shape of box diagonal 1, see `imaging.camera`


class Viewpoint(NamedTuple):
    """From where an image was taken.

    Attributes:
        azimuth: about the vertical, degrees: 0 is the object's front, 90 its own right.
        elevation: above the horizontal, degrees.
        confidence: probability that the azimuth is right to 15 degrees; 1 where it is known.
    """

    azimuth: float
    elevation: float
    confidence: float


class Views(NamedTuple):
    """Cameras that may have taken each of q images.

    Attributes:
        probs: (q, A), how likely each is.
        projections: from points (x, y, z, 1) to how far to the right, up and away they are.
    """

    probs: Float[Tensor, "q views"]
    projections: Float[Tensor, "q views 3 4"]


class ViewpointHead(nn.Module):
    """Two layers on the trunk's output: azimuth as a class of 10 degrees, elevation as a number.

    It learns beside the other heads and changes nothing of them: its gradients stop at its input.

    Args:
        hidden: size of the trunk's output.
    """

    def __init__(self, hidden: int) -> None:
        super().__init__()
        self.layers = nn.Sequential(
            nn.Linear(hidden, _WIDTH), nn.ReLU(), nn.Linear(_WIDTH, _BINS + 1)
        )

    def forward(self, hidden: Float[Tensor, "q hidden"]) -> Float[Tensor, "q bins"]:
        """Return logits of 36 azimuths, 0, 10, ..., and the elevation in units of 30 degrees."""
        return self.layers(hidden.detach())


def viewpoint_loss(
    found: Float[Tensor, "q bins"], cameras: Float[Tensor, "q 2"]
) -> Float[Tensor, ""]:
    """Return the loss of what a head says, given azimuth and elevation in degrees: a mean.

    The azimuth's probability is shared between the two classes that it lies between.
    """
    place = cameras[:, 0] / (360 / _BINS)
    low, share = place.floor().long() % _BINS, (place % 1).float()
    logits = found[:, :_BINS]
    near = cross_entropy(logits, low, reduction="none")
    far = cross_entropy(logits, (low + 1) % _BINS, reduction="none")
    azimuth = ((1 - share) * near + share * far).mean()
    elevation = cameras[:, 1].float() / _ELEVATION_SCALE
    return azimuth + mse_loss(found[:, _BINS], elevation)


def likely_views(found: Float[Tensor, "q bins"]) -> Views:
    """Return a camera for every 30 degrees of azimuth, all of an image at its elevation."""
    probs = found[:, :_BINS].softmax(1).roll(1, 1).unflatten(1, (-1, 3)).sum(2)
    azimuth = torch.arange(probs.shape[1], device=found.device) * (6 * torch.pi / _BINS)
    elevation = torch.deg2rad(found[:, _BINS:] * _ELEVATION_SCALE)
    azimuth, elevation = torch.broadcast_tensors(azimuth, elevation)
    sin, cos, level = azimuth.sin(), azimuth.cos(), elevation.cos()
    right = torch.stack([-cos, torch.zeros_like(cos), -sin], dim=-1)
    toward = torch.stack([sin * level, elevation.sin(), -cos * level], dim=-1)
    axes = torch.stack([right, torch.linalg.cross(toward, right), -toward], dim=-2)
    shift = axes.new_tensor([[0], [0], [_DISTANCE]]).expand(*axes.shape[:-1], 1)
    return Views(probs, torch.cat([axes, shift], dim=-1))


def viewpoints(found: Float[Tensor, " bins"], count: int = 2) -> list[Viewpoint]:
    """Return the likeliest azimuths of one image, the best first, at least 60 degrees apart."""
    step = 360 / _BINS
    probs = found[:_BINS].softmax(0)
    turned = [probs.roll(1), probs, probs.roll(-1)]
    mass = torch.stack(turned).sum(0)
    # The mean over the three classes about the likeliest one is finer than a class.
    shift = step * (turned[2] - turned[0]) / mass
    elevation = float(found[_BINS]) * _ELEVATION_SCALE
    best: list[Viewpoint] = []
    for row in mass.argsort(descending=True).tolist():
        azimuth = (row * step + float(shift[row])) % 360
        if all(abs((azimuth - b.azimuth + 180) % 360 - 180) >= 60 for b in best):
            best.append(Viewpoint(azimuth, elevation, float(mass[row])))
    return best[:count]
