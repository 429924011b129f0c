"""How a free-form deformation stretches and turns space at each point."""

import torch
from jaxtyping import Float
from torch import Tensor

from ffd_lightning.geometry.ffd import Degrees, Lattice, bernstein_basis, flat_axes

_CHUNK = 65_536  # points at a time: three matrices of 33 MB each at degree 3


def deformation_jacobian(
    points: Float[Tensor, "*batch num_points 3"],
    lattice: Lattice,
    offsets: Float[Tensor, "*queries_batch num_control_points 3"],
) -> Float[Tensor, "*queries_batch num_points 3 3"]:
    r"""Return the Jacobian of the deformation x + B(x) dP with respect to the position x.

    $$ J_{ij} = \delta_{ij} + \sum_m dP_{mi} \, \partial B_m / \partial x_j, \quad
              B_{i,n}' = n \, (B_{i-1,n-1} - B_{i,n-1}) $$

    Where its determinant is below 0 the deformation turns space inside out, which is where a
    surface folds over.

    Convention:
        Row i is the deformed coordinate, column j the original one; zero offsets give the identity.
        Along an axis of the box without extent, the lattice coordinate is constant and points are
        carried along as they are: det J is then that of the deformation within the plane.

    Args:
        points: (*batch, V, 3), in the frame of the lattice.
        lattice: box and degrees, same batch shape.
        offsets: displacement of each control point, (*queries, *batch, M, 3).

    Returns:
        (*queries, *batch, V, 3, 3), without unit.

    Source: the derivative of Sederberg and Parry 1986, equation 2.

    >>> box = torch.tensor([[0.0, 0, 0], [2, 1, 1]])
    >>> pull = torch.zeros(8, 3)
    >>> pull[4:, 0] = -3.0  # the end at x = 2 is pulled through the end at x = 0
    >>> deformation_jacobian(box, Lattice.bounding(box, (1, 1, 1)), pull)[0].diagonal()
    tensor([-0.5000,  1.0000,  1.0000])
    """
    # Mixed precision is for networks: the sign of a determinant needs all bits.
    with torch.autocast(points.device.type, enabled=False):
        chunks = lattice.to_stu(points).split(_CHUNK, dim=-2)
        moved = torch.cat([_change(stu, lattice.degrees, offsets) for stu in chunks], dim=-3)
        # How a coordinate within the box changes with its own of space: as `Lattice.to_stu` has it.
        size, flat = lattice.size, flat_axes(lattice.size)
        per_unit = torch.where(flat, 0, size / torch.where(flat, 1.0, size**2))
        return torch.eye(3).to(moved) + moved * per_unit[..., None, None, :]


def lattice_determinants(
    offsets: Float[Tensor, "*queries_batch num_control_points 3"],
    control_points: Float[Tensor, "*batch num_control_points 3"],
    degrees: Degrees,
) -> Float[Tensor, "*queries_batch num_control_points"]:
    r"""Return $\det J$ at the places of the control points at rest.

    Cheaper than `deformation_jacobian`, since all lattices have one matrix of derivatives.

    Args:
        offsets: of the control points, (*queries, *batch, M, 3).
        control_points: (*batch, M, 3); along an axis without extent nothing changes.
        degrees: of the lattices.

    Returns:
        (*queries, *batch, M), without unit: below 0 where space is turned inside out.

    >>> cube = torch.tensor([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    >>> lattice_determinants(cube * torch.tensor([2.0, 0, -3]), cube, (1, 1, 1)).unique()
    tensor([-6.])
    """
    count = offsets.shape[-2]
    with torch.autocast(offsets.device.type, enabled=False):
        grid = [torch.arange(degree + 1).to(offsets) / degree for degree in degrees]
        identity = torch.eye(count).to(offsets)
        matrix = _change(torch.cartesian_prod(*grid), degrees, identity)  # place, point, axis
        extent = control_points.amax(-2) - control_points.amin(-2)
        per_unit = torch.where(flat_axes(extent), 0, 1 / extent)
        moved = offsets.mT @ matrix.transpose(0, 1).flatten(1)
        moved = moved.unflatten(-1, (count, 3)).transpose(-3, -2) * per_unit[..., None, None, :]
        first, second, third = (torch.eye(3).to(moved) + moved).unbind(-1)
        return (torch.linalg.cross(first, second) * third).sum(-1)


def _change(
    stu: Float[Tensor, "*batch num_points 3"],
    degrees: Degrees,
    offsets: Float[Tensor, "*queries_batch num_control_points values"],
) -> Float[Tensor, "*queries_batch num_points values 3"]:
    """Derivatives of the displacement (rows) along s, t and u (columns)."""
    basis = [bernstein_basis(stu[..., k], degree) for k, degree in enumerate(degrees)]
    slope = [_slope(stu[..., k], degree) for k, degree in enumerate(degrees)]
    columns = []
    for k in range(3):
        s, t, u = (slope[i] if i == k else basis[i] for i in range(3))
        matrix = s[..., :, None, None] * t[..., None, :, None] * u[..., None, None, :]
        columns.append(matrix.flatten(-3) @ offsets)
    return torch.stack(columns, dim=-1)


def _slope(t: Float[Tensor, "*batch"], degree: int) -> Float[Tensor, "*batch {degree+1}"]:
    """Derivatives of all Bernstein polynomials of one degree, 1 or more."""
    lower = torch.nn.functional.pad(bernstein_basis(t, degree - 1), (1, 1))
    return degree * (lower[..., :-1] - lower[..., 1:])
