"""Free-form deformation as one linear map: decomposition, deformation, inverse."""

from __future__ import annotations

from typing import NamedTuple

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.geometry.bernstein import bernstein_basis
from ffd_lightning.geometry.lattice import Degrees, Lattice, num_control_points


class TemplateSample(NamedTuple):
    """Decomposed points of every template: all that a training step sees of them.

    Attributes:
        deformation_matrix: B, (*templates, N, M).
        control_points: P, (*templates, M, 3).
        degrees: of the lattices, which M alone does not tell.
    """

    deformation_matrix: Float[Tensor, "*templates num_points num_control_points"]
    control_points: Float[Tensor, "*templates num_control_points 3"]
    degrees: Degrees

    def deformed(
        self, offsets: Float[Tensor, "*queries_templates num_control_points 3"]
    ) -> Float[Tensor, "*queries_templates num_points 3"]:
        """Return the points moved by offsets of their control points, see `deform`."""
        return deform(self.deformation_matrix, self.control_points, offsets)


def deformation_matrix(
    points: Float[Tensor, "*batch num_points 3"], lattice: Lattice
) -> Float[Tensor, "*batch num_points num_control_points"]:
    """Decompose points over the control points of a lattice: S = B P.

    Args:
        points: (*batch, N, 3) in the frame of the lattice.
        lattice: box and degrees; its batch shape is that of the points.

    Returns:
        B, (*batch, N, M); rows sum to 1 and ``B @ lattice.control_points()`` gives the points.

    Source: the paper's equations 4 and 5 (FFD in matrix form).

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

    Raises:
        ValueError: shapes that do not go together.

    Source: the paper's equation 6.
    """
    templates = matrix.shape[:-2]
    lead = offsets.shape[: offsets.dim() - 2 - len(templates)]
    if (
        offsets.shape != (*lead, *templates, matrix.shape[-1], 3)
        or control_points.shape[-2:] != offsets.shape[-2:]
    ):
        raise ValueError(
            f"matrix {tuple(matrix.shape)}, control_points {tuple(control_points.shape)} and "
            f"offsets {tuple(offsets.shape)} do not go together"
        )
    moved = control_points + offsets
    # Queries become columns: one product per template, and no copy of B for every query.
    columns = moved.reshape(-1, *moved.shape[len(lead) :]).movedim(0, -1).flatten(-2)
    # Mixed precision is for networks: bfloat16 keeps 8 bits, a few tenths of a percent.
    with torch.autocast(matrix.device.type, enabled=False):
        points = (matrix @ columns).unflatten(-1, (3, -1)).movedim(-1, 0)
    return points.reshape(*lead, *points.shape[1:])


def deform_points(
    points: Float[Tensor, "*batch num_points 3"],
    lattice: Lattice,
    offsets: Float[Tensor, "*batch num_control_points 3"],
) -> Float[Tensor, "*batch num_points 3"]:
    """Deform the points inside the lattice's box (faces included), leave the others in place.

    Args:
        points: (*batch, N, 3).
        lattice: box and degrees, same batch shape.
        offsets: displacement of each control point, (*batch, M, 3).

    Source: Sederberg and Parry 1986, section 2 (local deformation).
    """
    moved = deformation_matrix(points, lattice) @ (lattice.control_points() + offsets)
    return torch.where(lattice.contains(points)[..., None], moved, points)


def fit_offsets(
    matrix: Float[Tensor, "*batch num_points num_control_points"],
    control_points: Float[Tensor, "*batch num_control_points 3"],
    target_points: Float[Tensor, "*batch num_points 3"],
    ridge: float = 1e-6,
) -> Float[Tensor, "*batch num_control_points 3"]:
    r"""Find the offsets that carry decomposed points onto targets, in the least-squares sense.

    $$ \Delta P = (B^\top B + \rho N I)^{-1} B^\top (Y - B P) $$

    Solved in float64. The ridge keeps control points without points near them at rest; plain
    least squares lets them drift by tens of box sizes.

    Args:
        matrix: B, (*batch, N, M).
        control_points: P, (*batch, M, 3).
        target_points: Y, (*batch, N, 3), in correspondence with the rows of B.
        ridge: rho, relative to the number of points; above 0.

    Returns:
        Offsets, (*batch, M, 3), in the dtype of `matrix`.

    Raises:
        ValueError: a ridge of 0 or below (the system would be singular for most shapes).
    """
    if not ridge > 0:
        raise ValueError(f"ridge must be above 0, got {ridge}")
    basis, rest = matrix.double(), control_points.double()
    residual = target_points.double() - basis @ rest
    num_points, num_control = basis.shape[-2:]
    eye = torch.eye(num_control, dtype=basis.dtype, device=basis.device)
    normal = basis.mT @ basis + ridge * num_points * eye
    return torch.linalg.solve(normal, basis.mT @ residual).to(matrix.dtype)


def bending_energy(
    offsets: Float[Tensor, "*batch num_control_points 3"], degrees: Degrees
) -> Float[Tensor, "*batch"]:
    r"""Return by how much offsets bend a lattice: the sum of their squared second differences.

    $$ \sum_{a} \sum_{i} |\Delta P_{i - e_a} - 2 \Delta P_i + \Delta P_{i + e_a}|^2 $$

    over the axes a of the lattice and its control points i with neighbours on both sides along a.
    It is 0 for all offsets that are affine in the index of the control point: to move, turn,
    stretch or shear a template costs nothing.

    Args:
        offsets: of the control points, (*batch, M, 3), numbered as `Lattice` does.
        degrees: of the lattice.

    Raises:
        ValueError: M is not that of the degrees.

    >>> squares = torch.tensor([[0.0, 0, 0], [0, 0, 1], [0, 0, 4]])
    >>> bending_energy(squares.repeat_interleave(4, 0), (2, 1, 1))
    tensor(16.)
    """
    lattice = _on_lattice(offsets, degrees)
    first = lattice.dim() - 4
    return sum(
        (lattice.diff(n=2, dim=first + axis).square().sum((-4, -3, -2, -1)) for axis in range(3)),
        start=offsets.new_zeros(offsets.shape[:-2]),
    )


def mirrored_offsets(
    offsets: Float[Tensor, "*batch num_control_points 3"], degrees: Degrees
) -> Float[Tensor, "*batch num_control_points 3"]:
    """Return offsets as the plane x = 0 mirrors them, for lattices that lie symmetrically to it.

    Args:
        offsets: of the control points, (*batch, M, 3), numbered as `Lattice` does.
        degrees: of the lattice, whose first axis is along x.

    Raises:
        ValueError: M is not that of the degrees.
    """
    lattice = _on_lattice(offsets, degrees).flip(-4)
    signs = offsets.new_tensor([-1.0, 1.0, 1.0])
    return (lattice * signs).flatten(-4, -2)


def _on_lattice(offsets: Tensor, degrees: Degrees) -> Tensor:
    """Return offsets (*batch, M, 3) as (*batch, l + 1, m + 1, n + 1, 3)."""
    if offsets.shape[-2:] != (num_control_points(degrees), 3):
        raise ValueError(
            f"offsets {tuple(offsets.shape)} are not of a lattice of degrees {degrees}"
        )
    return offsets.unflatten(-2, tuple(degree + 1 for degree in degrees))
