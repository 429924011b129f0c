r"""Free-form deformation: the paper's section 3 on one page.

Points S of a template lie in a box with a grid of control points P. Each point is a mean of the
control points whose weights are Bernstein polynomials of its place in the box,

$$ S = B P, \quad S' = B (P + \Delta P), $$

so a shape is deformed by one product with a matrix B that is computed once per template.

Convention:
    Frame: any right-handed one; in this package y is up and objects face -z (see `geometry.mesh`).
    Boxes lie along its axes, and (s, t, u) in [0, 1]^3 are coordinates within a box, along x, y, z.

    Order: of degrees (l, m, n), control point (i, j, k) is number (i (m + 1) + j) (n + 1) + k, so
    the index along z runs fastest; it rests at (i / l, j / m, k / n) of the box.

    Identity: offsets of 0 leave every point where it is, the polynomials summing to 1 and
    reproducing linear functions. Offsets that are affine in P deform by that affine map. Outside
    of the box the polynomials go on, and so does the deformation.

Sources: T. W. Sederberg and S. R. Parry, "Free-form deformation of solid geometric models",
SIGGRAPH 1986 (Bernstein polynomials, lattices); D. Jack et al., "Learning free-form deformations
for 3D object reconstruction", ACCV 2018, "the paper" (matrix form).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

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
    numbers = np.arange(num_control_points(degrees)).reshape([degree + 1 for degree in degrees])
    pairs = ([np.delete(numbers, k, axis).ravel() for k in (-1, 0)] for axis in range(3))
    return np.concatenate([np.stack(pair, axis=1) for pair in pairs])


def flat_axes(size: Float[Tensor, "*batch 3"]) -> Bool[Tensor, "*batch 3"]:
    """Return along which axes a box has no extent, up to rounding beside its longest side.

    >>> flat_axes(torch.tensor([1.0, 0, 1e-9]))
    tensor([False,  True,  True])
    """
    return size <= torch.finfo(size.dtype).eps * size.amax(-1, keepdim=True)


@dataclass(frozen=True, eq=False)  # tensors have no one answer to ==
class Lattice:
    """An axis-aligned box with a regular grid of control points; conventions are the module's.

    A side may have length zero: points then get the middle coordinate 0.5 along it, so that every
    layer of control points moves a flat template.

    Attributes:
        origin: the corner with the least coordinates, (*batch, 3).
        size: lengths of the sides, (*batch, 3).
        degrees: polynomial degree along each axis, 1 or more.

    Source: Sederberg and Parry 1986, equation 1; the paper's section 3.2.

    >>> Lattice(torch.zeros(3), torch.tensor([2.0, 1, 1]), (1, 1, 1)).control_points()[-1]
    tensor([2., 1., 1.])
    """

    origin: Float[Tensor, "*batch 3"]
    size: Float[Tensor, "*batch 3"]
    degrees: Degrees = (3, 3, 3)

    def __post_init__(self) -> None:
        if len(self.degrees) != 3 or min(self.degrees) < 1:
            raise ValueError(f"degrees must be three integers of 1 or more, got {self.degrees}")

    @classmethod
    def bounding(
        cls, points: Float[Tensor, "*batch num_points 3"], degrees: Degrees = (3, 3, 3)
    ) -> Lattice:
        """Return the bounding box of points (*batch, N, 3) as a lattice.

        Raises:
            ValueError: points that are not finite.
        """
        if not torch.isfinite(points).all():
            raise ValueError("points to bound must be finite")
        low, high = points.amin(-2), points.amax(-2)
        return cls(low, high - low, degrees)

    def to_stu(
        self, points: Float[Tensor, "*batch num_points 3"]
    ) -> Float[Tensor, "*batch num_points 3"]:
        """Return the coordinates of points within the box, (*batch, N, 3)."""
        size = self.size[..., None, :]
        flat = flat_axes(self.size)[..., None, :]
        # Not `relative / size`: trained networks are reproduced to the last bit.
        stu = (points - self.origin[..., None, :]) * size / torch.where(flat, 1.0, size**2)
        return torch.where(flat, 0.5, stu)

    def control_points(self) -> Float[Tensor, "*batch num_control_points 3"]:
        """Return the control points at rest, P, (*batch, M, 3)."""
        dtype, device = self.size.dtype, self.size.device
        steps = [torch.linspace(0, 1, d + 1, dtype=dtype, device=device) for d in self.degrees]
        return self.origin[..., None, :] + torch.cartesian_prod(*steps) * self.size[..., None, :]


class TemplateSample(NamedTuple):
    """Decomposed points of every template: all that a training step sees of them.

    Attributes:
        deformation_matrix: B, (*templates, N, M).
        control_points: P, (*templates, M, 3).
        degrees: of the lattices, which M alone does not say.
    """

    deformation_matrix: Float[Tensor, "*templates num_points num_control_points"]
    control_points: Float[Tensor, "*templates num_control_points 3"]
    degrees: Degrees

    def deformed(
        self, offsets: Float[Tensor, "*queries_templates num_control_points 3"]
    ) -> Float[Tensor, "*queries_templates num_points 3"]:
        """Return the points moved by offsets of their control points, see `deform`."""
        return deform(self.deformation_matrix, self.control_points, offsets)


def bernstein_basis(t: Float[Tensor, "*batch"], degree: int) -> Float[Tensor, "*batch {degree+1}"]:
    r"""Return all Bernstein polynomials of one degree at t, with the index i as last axis.

    $$ B_{i,n}(t) = \binom{n}{i} t^i (1 - t)^{n - i}, \quad 0 \le i \le n $$

    Built up by degree, $B_{i,n} = (1 - t) B_{i,n-1} + t B_{i-1,n-1}$, which stays smooth
    at t = 0 and t = 1 (powers would differentiate to 0 * inf there).

    Source: Sederberg and Parry 1986, equation 2.

    >>> bernstein_basis(torch.tensor(0.5), 2)
    tensor([0.2500, 0.5000, 0.2500])
    """
    basis = [torch.ones_like(t)]
    for _ in range(degree):
        left = [(1 - t) * b for b in basis] + [torch.zeros_like(t)]
        right = [torch.zeros_like(t)] + [t * b for b in basis]
        basis = [a + b for a, b in zip(left, right, strict=True)]
    return torch.stack(basis, dim=-1)


def deformation_matrix(
    points: Float[Tensor, "*batch num_points 3"], lattice: Lattice
) -> Float[Tensor, "*batch num_points num_control_points"]:
    """Decompose points (*batch, N, 3) over the control points of a lattice of the same batch shape.

    Returns:
        B, (*batch, N, M), with S = B P; rows sum to 1.

    Source: the paper's equations 4 and 5.

    >>> cube = torch.tensor([[0.0, 0, 0], [1, 1, 1], [0.2, 0.5, 0.9]])
    >>> lattice = Lattice.bounding(cube, (1, 2, 3))
    >>> matrix = deformation_matrix(cube, lattice)
    >>> matrix.shape, torch.allclose(matrix @ lattice.control_points(), cube, atol=1e-6)
    (torch.Size([3, 24]), True)
    """
    s, t, u = lattice.to_stu(points).unbind(-1)
    degree_s, degree_t, degree_u = lattice.degrees
    basis = (
        bernstein_basis(s, degree_s)[..., :, None, None]
        * bernstein_basis(t, degree_t)[..., None, :, None]
        * bernstein_basis(u, degree_u)[..., None, None, :]
    )
    return basis.flatten(-3)


def deform(
    matrix: Float[Tensor, "*templates num_points num_control_points"],
    control_points: Float[Tensor, "*templates num_control_points 3"],
    offsets: Float[Tensor, "*queries_templates num_control_points 3"],
) -> Float[Tensor, "*queries_templates num_points 3"]:
    """Move decomposed points with their control points: B (P + dP).

    Args:
        matrix: B, (*templates, N, M).
        control_points: P, (*templates, M, 3).
        offsets: dP, (*queries, *templates, M, 3); zero offsets give the points back.

    Returns:
        Deformed points, (*queries, *templates, N, 3).

    Source: the paper's equation 6.

    >>> lifted = torch.tensor([[0.0, 0, 4], [0, 0, 0]])
    >>> deform(torch.tensor([[0.25, 0.75]]), torch.eye(2, 3), lifted)
    tensor([[0.2500, 0.7500, 1.0000]])
    """
    moved = control_points + offsets
    lead = moved.shape[: moved.dim() - matrix.dim()]
    # Queries become columns: one product per template, and no copy of B for every query.
    columns = moved.reshape(-1, *moved.shape[len(lead) :]).movedim(0, -1).flatten(-2)
    # Mixed precision is for networks: bfloat16 keeps 8 bits, a few tenths of a percent.
    with torch.autocast(matrix.device.type, enabled=False):
        points = (matrix @ columns).unflatten(-1, (3, -1)).movedim(-1, 0)
    return points.reshape(*lead, *points.shape[1:])


def bending_energy(
    offsets: Float[Tensor, "*batch num_control_points 3"], degrees: Degrees
) -> Float[Tensor, "*batch"]:
    r"""Return by how much offsets bend a lattice: the sum of their squared second differences.

    $$ \sum_{a} \sum_{i} |\Delta P_{i - e_a} - 2 \Delta P_i + \Delta P_{i + e_a}|^2 $$

    over the axes a of the lattice and its control points i with neighbours on both sides along a.
    It is 0 for all offsets that are affine in the index of the control point: to move, turn,
    stretch or shear a template costs nothing.

    >>> squares = torch.tensor([[0.0, 0, 0], [0, 0, 1], [0, 0, 4]])
    >>> bending_energy(squares.repeat_interleave(4, 0), (2, 1, 1))
    tensor(16.)
    """
    grid = _on_grid(offsets, degrees)
    return sum(
        (grid.diff(n=2, dim=axis).square().sum((-4, -3, -2, -1)) for axis in (-4, -3, -2)),
        start=offsets.new_zeros(offsets.shape[:-2]),
    )


def mirrored_offsets(
    offsets: Float[Tensor, "*batch num_control_points 3"], degrees: Degrees
) -> Float[Tensor, "*batch num_control_points 3"]:
    """Return offsets as the plane x = 0 mirrors them, for lattices that lie symmetrically to it.

    >>> mirrored_offsets(torch.arange(24.0).reshape(8, 3), (1, 1, 1))[0]
    tensor([-12.,  13.,  14.])
    """
    signs = offsets.new_tensor([-1.0, 1.0, 1.0])
    return (_on_grid(offsets, degrees).flip(-4) * signs).flatten(-4, -2)


def _on_grid(offsets: Tensor, degrees: Degrees) -> Tensor:
    """Return offsets (*batch, M, 3) as (*batch, l + 1, m + 1, n + 1, 3)."""
    return offsets.unflatten(-2, [degree + 1 for degree in degrees])
