"""The oriented box of control points that a free-form deformation moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float
from numpy.typing import NDArray
from torch import Tensor

Degrees = tuple[int, int, int]


def num_control_points(degrees: Degrees) -> int:
    """Return (l + 1)(m + 1)(n + 1).

    >>> num_control_points((3, 3, 3))
    64
    """
    return (degrees[0] + 1) * (degrees[1] + 1) * (degrees[2] + 1)


def lattice_edges(degrees: Degrees) -> NDArray[np.int64]:
    """Return the pairs of control points that are neighbours along an axis, (E, 2).

    >>> lattice_edges((1, 1, 1))[:4].tolist()
    [[0, 4], [1, 5], [2, 6], [3, 7]]
    """
    shape = tuple(degree + 1 for degree in degrees)
    numbers = np.arange(num_control_points(degrees)).reshape(shape)
    pairs = []
    for axis in range(3):
        first, last = (np.delete(numbers, k, axis).ravel() for k in (-1, 0))
        pairs.append(np.stack([first, last], axis=1))
    return np.concatenate(pairs)


def flat_axes(lengths: Float[Tensor, "*batch 3"]) -> Bool[Tensor, "*batch 3"]:
    """Tell along which axes of a lattice there is nothing, up to rounding beside its longest."""
    return lengths <= torch.finfo(lengths.dtype).eps * lengths.amax(-1, keepdim=True)


@dataclass(frozen=True)
class Lattice:
    """An oriented box with a regular grid of control points.

    Convention:
        A point is ``origin + s * axes[0] + t * axes[1] + u * axes[2]`` with (s, t, u) in [0, 1]^3
        inside the box, its faces included. Control points are numbered row-major: the index along
        axis 2 runs fastest. Axes are orthogonal and may have length zero: points then get the
        middle coordinate 0.5 along them, so that every layer of control points moves a flat
        template.

    Args:
        origin: corner of the box, (*batch, 3).
        axes: rows are the edge vectors of the box, (*batch, 3, 3).
        degrees: polynomial degree per axis, each 1 or more.

    Raises:
        ValueError: wrong shapes, axes that are not finite or not orthogonal, degrees below 1.

    Source: Sederberg and Parry 1986, section 2; the paper's section 3.2.
    """

    origin: Float[Tensor, "*batch 3"]
    axes: Float[Tensor, "*batch 3 3"]
    degrees: Degrees = (3, 3, 3)

    def __post_init__(self) -> None:
        if self.origin.shape[-1:] != (3,) or self.axes.shape != (*self.origin.shape, 3):
            raise ValueError(
                f"origin must be (..., 3) and axes (..., 3, 3), got {tuple(self.origin.shape)} "
                f"and {tuple(self.axes.shape)}"
            )
        if len(self.degrees) != 3 or min(self.degrees) < 1:
            raise ValueError(f"degrees must be three integers of 1 or more, got {self.degrees}")
        axes = self.axes.detach()
        if not (torch.isfinite(axes).all() and torch.isfinite(self.origin).all()):
            raise ValueError("origin and axes must be finite")
        gram = axes @ axes.mT
        lengths = torch.diagonal(gram, dim1=-2, dim2=-1).sqrt()
        cosines = (gram - torch.diag_embed(lengths**2)).abs()
        if (cosines > 1e-3 * lengths[..., :, None] * lengths[..., None, :]).any():
            raise ValueError("axes must be orthogonal to each other")

    @classmethod
    def bounding(
        cls, points: Float[Tensor, "*batch num_points 3"], degrees: Degrees = (3, 3, 3)
    ) -> Lattice:
        """Return the axis-aligned bounding box of points as a lattice.

        Args:
            points: (*batch, N, 3) with N at least 1.
            degrees: polynomial degree per axis.

        Raises:
            ValueError: no points, or points that are not finite.
        """
        if points.shape[-2] == 0:
            raise ValueError("no points to bound")
        if not torch.isfinite(points).all():
            raise ValueError("points to bound must be finite")
        low, high = points.amin(-2), points.amax(-2)
        return cls(low, torch.diag_embed(high - low), degrees)

    def to_stu(
        self, points: Float[Tensor, "*batch num_points 3"]
    ) -> Float[Tensor, "*batch num_points 3"]:
        """Return the lattice coordinates of points, (*batch, N, 3)."""
        squared = (self.axes**2).sum(-1)
        flat = flat_axes(self.axes.detach().norm(dim=-1))
        relative = (points - self.origin[..., None, :]) @ self.axes.mT
        stu = relative / torch.where(flat, torch.ones_like(squared), squared)[..., None, :]
        return torch.where(flat[..., None, :], torch.full_like(stu, 0.5), stu)

    def contains(
        self, points: Float[Tensor, "*batch num_points 3"]
    ) -> Bool[Tensor, "*batch num_points"]:
        """Tell which points lie in the box, its faces included, up to rounding."""
        nearest = self.origin[..., None, :] + self.to_stu(points).clamp(0, 1) @ self.axes
        # Rounding of a point grows with its distance from the frame's origin, not with the box.
        reach = torch.maximum(self.axes.norm(dim=-1).amax(-1)[..., None], points.abs().amax(-1))
        tolerance = 16 * torch.finfo(points.dtype).eps * reach
        return (points - nearest).norm(dim=-1) <= tolerance

    def control_points(self) -> Float[Tensor, "*batch num_control_points 3"]:
        """Return the undeformed control points P, (*batch, M, 3)."""
        grid = torch.stack(
            torch.meshgrid(
                *(
                    torch.linspace(0, 1, d + 1, dtype=self.axes.dtype, device=self.axes.device)
                    for d in self.degrees
                ),
                indexing="ij",
            ),
            dim=-1,
        ).reshape(-1, 3)
        return self.origin[..., None, :] + grid @ self.axes
