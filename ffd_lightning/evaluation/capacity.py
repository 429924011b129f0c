"""What free-form deformation can do: templates fitted to a shape that is known."""

from __future__ import annotations

import math

import numpy as np
import torch
from numpy.typing import NDArray

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform

_STEPS = 150
_FIRST, _KEPT = 40, 4  # after so many steps, so many templates are fitted further
_POINTS = 512  # of each cloud, drawn anew for each step
_RATE = 0.02  # of Adam, fading to 0
_FINAL = 2048  # points that tell which template came nearest


def fitted_template(
    bank: TemplateBank, cloud: NDArray[np.float32], seed: int
) -> tuple[int, NDArray[np.float32]]:
    """Fit the offsets of every template to a shape by gradient descent, and return the nearest.

    An upper bound, nearly, of what any network can make of these templates: it stands between the
    floor of a metric and the error of a network.

    The shape is independent samples of it, (N, 3). Returns the template, and the offsets of its
    control points, (M, 3).
    """
    generator = torch.Generator().manual_seed(seed)
    truth = torch.from_numpy(cloud)
    kept = torch.arange(len(bank))
    offsets = torch.zeros_like(bank.control_points)
    for steps, left in ((range(_FIRST), _KEPT), (range(_FIRST, _STEPS), 1)):
        offsets.requires_grad_()
        optimizer = torch.optim.Adam([offsets], lr=_RATE)
        for step in steps:
            rows = torch.randint(bank.points.shape[1], (len(kept), _POINTS), generator=generator)
            aim = torch.randint(len(truth), (_POINTS,), generator=generator)
            optimizer.param_groups[0]["lr"] = _RATE * (1 + math.cos(math.pi * step / _STEPS)) / 2
            optimizer.zero_grad()
            matrix = bank.deformation_matrix[kept[:, None], rows]
            moved = deform(matrix, bank.control_points[kept], offsets)
            chamfer_distance(moved, truth[aim], "mean").sum().backward()
            optimizer.step()
        offsets = offsets.detach()
        moved = deform(bank.deformation_matrix[kept, :_FINAL], bank.control_points[kept], offsets)
        order = chamfer_distance(moved, truth[:_FINAL], "mean").argsort()[:left]
        kept, offsets = kept[order], offsets[order]
    return int(kept[0]), offsets[0].numpy()
