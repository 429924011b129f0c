"""What can be put before the ground truth: templates, deformed or not, and prepared shapes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import PartCloud
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.ffd import bending_energy, deform
from ffd_lightning.geometry.jacobian import deformation_jacobian
from ffd_lightning.geometry.mesh import UNKNOWN_PART
from ffd_lightning.geometry.sampling import sample_stratified
from ffd_lightning.metrics.distortion import distortion

Cloud = NDArray[np.float64]
Surface = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices (V, 3) and faces (F, 3)."""


class Shape(Protocol):
    """One shape in the frame of prepared shapes (bounding-box diagonal 1 before deformation)."""

    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """Draw from the shape's own surface samples, with replacement: (count, 3)."""
        ...

    def mesh(self) -> Surface:
        """Return vertices and faces."""
        ...

    def labelled_points(self) -> PartCloud:
        """Return the second half of the shape's own surface samples, with their parts."""
        ...


@dataclass(frozen=True)
class PreparedShape:
    """A prepared shape."""

    prepared: PreparedSet
    row: int

    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """See `Shape`."""
        cloud = self.prepared.cloud(self.row)
        return cloud[rng.integers(len(cloud), size=count)].astype(np.float64)

    def truth_cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """Draw, with replacement, from as many points of the mesh itself: (count, 3).

        The authors sample a ground truth with a share of the points for each face, and then draw
        as many from those. Drawn again, a cloud has only 63% of its points, so that even the true
        surface scores a distance 1.3 times that of two fresh clouds.
        """
        cloud, _ = sample_stratified(*self.mesh(), count, rng)
        return cloud[rng.integers(count, size=count)].astype(np.float64)

    def mesh(self) -> Surface:
        """See `Shape`."""
        mesh = self.prepared.mesh(self.row)
        return mesh.vertices, mesh.faces

    def labelled_points(self) -> PartCloud:
        """See `Shape`; none of the points of `truth_labelled_points`."""
        return self._labelled(slice(self.prepared.num_points // 2, None))

    def truth_labelled_points(self) -> PartCloud:
        """Return the first half of the model's surface samples, with their parts."""
        return self._labelled(slice(self.prepared.num_points // 2))

    def _labelled(self, part: slice) -> PartCloud:
        points, parts = self.prepared.cloud(self.row), self.prepared.point_parts(self.row)
        return _part_cloud(points[part], parts, part, self.prepared.part_names)

    @property
    def category_parts(self) -> tuple[str, ...]:
        """Names of the parts that shapes of its category have."""
        return self.prepared.part_names_of(self.row)


@dataclass(frozen=True)
class TemplateShape:
    """A template, moved by the offsets of its control points (M, 3); None leaves it as it is."""

    bank: TemplateBank
    index: int
    offsets: NDArray[np.float32] | None = None

    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """See `Shape`."""
        return self._points(torch.from_numpy(rng.integers(self.bank.points.shape[1], size=count)))

    def _points(self, rows: Tensor | slice) -> Cloud:
        if self.offsets is None:
            return self.bank.points[self.index][rows].double().numpy()
        matrix = self.bank.deformation_matrix[self.index][rows]
        moved = deform(
            matrix.double(),
            self.bank.control_points[self.index].double(),
            torch.from_numpy(self.offsets).double(),
        )
        return np.asarray(moved.numpy(), np.float64)

    def mesh(self) -> Surface:
        """Return the subdivided mesh, deformed; vertices (V, 3) and faces (F, 3)."""
        if self.offsets is None:
            mesh, _ = self.bank.subdivided(self.index)
        else:
            mesh = self.bank.deformed_mesh(self.index, torch.from_numpy(self.offsets))
        return mesh.vertices, mesh.faces

    def labelled_points(self) -> PartCloud:
        """See `Shape`; the points are deformed and keep their parts."""
        half = slice(self.bank.points.shape[1] // 2, None)
        parts = None if self.bank.point_parts is None else self.bank.point_parts[self.index]
        return _part_cloud(self._points(half), parts, half, self.bank.part_names)

    def distortion(self) -> dict[str, float]:
        """Return how the deformation folds, stretches and bends; see `metrics.distortion`.

        `bending` is the energy of the offsets, see `geometry.ffd.bending_energy`.
        """
        mesh, _ = self.bank.subdivided(self.index)
        jacobians = deformation_jacobian(
            torch.from_numpy(mesh.vertices),
            self.bank.lattices[self.index],
            torch.from_numpy(self._offsets.astype(np.float64)),
        )
        bending = bending_energy(torch.from_numpy(self._offsets), self.bank.degrees)
        return {
            **distortion(mesh.vertices, self.mesh()[0], mesh.faces, jacobians.numpy()),
            "bending": float(bending),
        }

    @property
    def _offsets(self) -> NDArray[np.float32]:
        count = self.bank.control_points.shape[1]
        return np.zeros((count, 3), np.float32) if self.offsets is None else self.offsets


@dataclass(frozen=True)
class ResampledTemplate(TemplateShape):
    """A deformed template whose points are drawn on its deformed surface.

    Points that are carried by a deformation lie thinner where it stretches the surface; these are
    spread by area, as those of any prepared shape.
    """

    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """Draw, with replacement, from as many points as the template has, drawn anew.

        Each face has its share of those, as in the clouds of prepared shapes: (count, 3).
        """
        cloud, _ = sample_stratified(*self.mesh(), self.bank.points.shape[1], rng)
        return cloud[rng.integers(len(cloud), size=count)].astype(np.float64)


def _part_cloud(
    points: NDArray[np.floating], parts: NDArray[np.uint8] | None, part: slice, names: Sequence[str]
) -> PartCloud:
    """Label some of a shape's points, (P, 3), by the parts of all of them, (N,)."""
    labels = np.full(len(points), UNKNOWN_PART, np.uint8) if parts is None else parts[part]
    return PartCloud(points.astype(np.float64), labels, tuple(names))
