"""What a score is worth: shapes that a model must beat, and what no model can."""

import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.prepared import PreparedSet, spread_rows
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation.candidates import Candidate, PreparedShape, TemplateShape
from ffd_lightning.evaluation.samples import Subset, sample_seed
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform

_COARSE = 256  # points of a cloud for a first ranking
_FINE = 1024
_CANDIDATES = 16  # that the first ranking leaves
_MEDOID_SHAPES = 512

# The fit of the templates to one cloud
_STEPS = 150
_FIRST, _KEPT = 40, 4  # after so many steps, so many templates are fitted further
_POINTS = 512  # of each cloud, drawn anew for each step
_RATE = 0.02  # of Adam, fading to 0
_FINAL = 2048  # points that tell which template came nearest


class NetworkFree:
    """The references that no network has a part in, for shapes that are known."""

    def __init__(self, bank: TemplateBank, trained_on: Subset, seed: int) -> None:
        self._bank, self._seed = bank, seed
        self._training, self._among = trained_on.prepared, trained_on.rows.tolist()
        self._medoid = medoid(self._training, self._among)
        self._coarse = _clouds(self._training, self._among, _COARSE)

    def candidates(self, prepared: PreparedSet, row: int) -> dict[str, Candidate]:
        """Return them for one shape by name, see `candidates.CANDIDATES`."""
        cloud, bank = prepared.cloud(row), self._bank
        seed = (sample_seed(prepared.ids[row]) + self._seed) % 2**64
        return {
            "best_undeformed": TemplateShape(bank, best_template(prepared, row, bank)),
            "fitted": TemplateShape(bank, *fitted_template(bank, cloud, seed)),
            "retrieval": PreparedShape(self._training, self.nearest(cloud)),
            "medoid": PreparedShape(self._training, self._medoid),
            "floor": PreparedShape(prepared, row),
        }

    def nearest(self, cloud: NDArray[np.float32]) -> int:
        """Return the row of the training shape that is nearest in Chamfer distance.

        All are ranked by 256 points of their clouds, the first 16 again by 1,024. The cloud is
        independent samples, (>= 1024, 3).
        """
        query = torch.from_numpy(cloud[:_FINE])
        first = chamfer_distance(query[:_COARSE], self._coarse, "mean").topk(
            min(_CANDIDATES, len(self._among)), largest=False
        )
        close = [self._among[k] for k in sorted(first.indices.tolist())]
        fine = chamfer_distance(query, _clouds(self._training, close, _FINE), "mean")
        return close[int(fine.argmin())]


def nearest_by_feature(
    features: NDArray[np.float32], others: NDArray[np.float32]
) -> NDArray[np.int64]:
    """Return for each image, (q, D), the place of the one that looks most alike to the encoder.

    The others are features (k, D), all of length 1: the greatest cosine. Returns (q,).
    """
    known = torch.from_numpy(others).T
    chunks = torch.from_numpy(features).split(256)
    return torch.cat([(chunk @ known).argmax(1) for chunk in chunks]).numpy()


def medoid(prepared: PreparedSet, among: Sequence[int]) -> int:
    """Return the row of the shape with the least mean Chamfer distance to the others.

    Of a larger set, 512 shapes evenly spread are looked at, with 256 points each.
    """
    rows = [among[k] for k in spread_rows(len(among), _MEDOID_SHAPES)]
    clouds = _clouds(prepared, rows, _COARSE)
    totals = [float(chamfer_distance(cloud, clouds, "mean").sum()) for cloud in clouds]
    return rows[int(np.argmin(totals))]


@torch.no_grad()
def best_template(
    prepared: PreparedSet, row: int, bank: TemplateBank, offsets: NDArray[np.float32] | None = None
) -> int:
    """Return the template nearest to a shape in Chamfer distance.

    Offsets (T, M, 3) deform the templates; None leaves them as they are.
    """
    truth, points = torch.from_numpy(prepared.cloud(row, _FINE)), bank.points[:, :_FINE]
    if offsets is not None:
        matrix = bank.deformation_matrix[:, :_FINE]
        points = deform(matrix, bank.control_points, torch.from_numpy(offsets))
    return int(chamfer_distance(points, truth, "mean").argmin())


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


def _clouds(prepared: PreparedSet, rows: Sequence[int], count: int) -> Tensor:
    """Return the first points of clouds, (k, count, 3): they are drawn independently."""
    return torch.from_numpy(np.stack([prepared.cloud(row, count) for row in rows]))
