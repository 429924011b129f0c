"""What is put before the ground truth: templates, deformed or not, and prepared shapes."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import PartCloud
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.ffd import bending_energy, deform, deformation_matrix
from ffd_lightning.geometry.jacobian import deformation_jacobian
from ffd_lightning.geometry.mesh import UNKNOWN_PART
from ffd_lightning.geometry.sampling import sample_stratified
from ffd_lightning.metrics.distortion import distortion

Cloud = NDArray[np.float64]
Surface = tuple[NDArray[np.float64], NDArray[np.int64]]
"""Vertices (V, 3) and faces (F, 3)."""

CANDIDATES = {
    "": "the model: selected template, deformed",
    "resampled": "the model, points drawn on the deformed surface",
    "undeformed": "selected template as it is",
    "best_deformed": "best of its templates deformed, an oracle",
    "fitted": "best of its templates fitted to the truth, an oracle",
    "best_undeformed": "best of its templates as it is, an oracle",
    "feature_retrieval": "training shape of the most similar image (encoder)",
    "retrieval": "nearest training shape, an oracle",
    "medoid": "most central training shape, always",
    "floor": "the truth itself, sampled again",
}
"""What is scored, by the prefix of its columns, the model first."""


class Candidate(ABC):
    """One shape in the frame of prepared shapes (bounding-box diagonal 1 before deformation)."""

    @abstractmethod
    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """Draw from the shape's own surface samples, with replacement: (count, 3)."""

    @abstractmethod
    def mesh(self) -> Surface:
        """Return vertices (V, 3) and faces (F, 3)."""

    @abstractmethod
    def labelled_points(self) -> PartCloud:
        """Return the second half of the shape's own surface samples, with their parts."""


@dataclass(frozen=True)
class PreparedShape(Candidate):
    """A prepared shape, as the ground truth or as a candidate for another."""

    prepared: PreparedSet
    row: int

    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """See `Candidate`."""
        return _drawn(self.prepared.cloud(self.row), count, rng)

    def truth_cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """Draw, with replacement, from as many points of the mesh itself: (count, 3).

        The authors sample a ground truth with a share of the points for each face, and then draw
        as many from those. Drawn again, a cloud has only 63% of its points, so that even the true
        surface scores a distance 1.3 times that of two fresh clouds.
        """
        return _drawn(sample_stratified(*self.mesh(), count, rng)[0], count, rng)

    def mesh(self) -> Surface:
        """See `Candidate`."""
        mesh = self.prepared.mesh(self.row)
        return mesh.vertices, mesh.faces

    def labelled_points(self) -> PartCloud:
        """See `Candidate`; none of the points of `truth_labelled_points`."""
        return self._labelled(slice(self.prepared.num_points // 2, None))

    def truth_labelled_points(self) -> PartCloud:
        """Return the first half of the shape's surface samples, with their parts."""
        return self._labelled(slice(self.prepared.num_points // 2))

    def _labelled(self, half: slice) -> PartCloud:
        points, parts = self.prepared.cloud(self.row), self.prepared.point_parts(self.row)
        return _part_cloud(points[half], parts, half, self.prepared.part_names)


@dataclass(frozen=True)
class TemplateShape(Candidate):
    """A template, moved by the offsets of its control points (M, 3); None leaves it as it is."""

    bank: TemplateBank
    index: int
    offsets: NDArray[np.float32] | None = None

    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """See `Candidate`."""
        return self._points(torch.from_numpy(rng.integers(self.bank.points.shape[1], size=count)))

    def _points(self, rows: Tensor | slice) -> Cloud:
        if self.offsets is None:
            return self.bank.points[self.index][rows].double().numpy()
        return self._moved(self.bank.deformation_matrix[self.index][rows], self.offsets)

    def carried(self, points: Cloud) -> Cloud:
        """Return any points of the template as it is, (n, 3), moved as its deformation does."""
        if self.offsets is None:
            return points
        matrix = deformation_matrix(torch.from_numpy(points), self.bank.lattices[self.index])
        return self._moved(matrix, self.offsets)

    def _moved(self, matrix: Tensor, offsets: NDArray[np.float32]) -> Cloud:
        control_points = self.bank.control_points[self.index].double()
        moved = deform(matrix.double(), control_points, torch.from_numpy(offsets).double())
        return np.asarray(moved.numpy(), np.float64)

    def mesh(self) -> Surface:
        """Return the subdivided mesh, deformed."""
        if self.offsets is None:
            mesh, _ = self.bank.subdivided(self.index)
        else:
            mesh = self.bank.deformed_mesh(self.index, torch.from_numpy(self.offsets))
        return mesh.vertices, mesh.faces

    def labelled_points(self) -> PartCloud:
        """See `Candidate`; the points are deformed and keep their parts."""
        half = slice(self.bank.points.shape[1] // 2, None)
        parts = None if self.bank.point_parts is None else self.bank.point_parts[self.index]
        return _part_cloud(self._points(half), parts, half, self.bank.part_names)

    def distortion(self) -> dict[str, float]:
        """Return how the deformation folds, stretches and bends; see `metrics.distortion`.

        `bending` is the energy of the offsets, see `geometry.ffd.bending_energy`.
        """
        (mesh, _), edges = self.bank.subdivided(self.index), self.bank.edges(self.index)
        still = torch.zeros_like(self.bank.control_points[0])
        offsets = still if self.offsets is None else torch.from_numpy(self.offsets)
        jacobians = deformation_jacobian(
            torch.from_numpy(mesh.vertices), self.bank.lattices[self.index], offsets.double()
        )
        return {
            **distortion(mesh.vertices, self.mesh()[0], mesh.faces, edges, jacobians.numpy()),
            "bending": float(bending_energy(offsets, self.bank.degrees)),
        }


@dataclass(frozen=True)
class ResampledTemplate(TemplateShape):
    """A deformed template whose points are drawn on its deformed surface.

    Points that are carried by a deformation lie thinner where it stretches the surface; these are
    spread by area, as those of any prepared shape.
    """

    def cloud(self, count: int, rng: np.random.Generator) -> Cloud:
        """Draw, with replacement, from as many points as the template has, drawn anew: (count, 3).

        Each face has its share of those, as in the clouds of prepared shapes.
        """
        points = self.bank.points.shape[1]
        return _drawn(sample_stratified(*self.mesh(), points, rng)[0], count, rng)


def _drawn(points: NDArray[np.float32], count: int, rng: np.random.Generator) -> Cloud:
    return points[rng.integers(len(points), size=count)].astype(np.float64)


def _part_cloud(
    points: NDArray[np.floating], parts: NDArray[np.uint8] | None, half: slice, names: Sequence[str]
) -> PartCloud:
    """Label some of a shape's points, (P, 3), by the parts of all of them, (N,)."""
    labels = np.full(len(points), UNKNOWN_PART, np.uint8) if parts is None else parts[half]
    return PartCloud(points.astype(np.float64), labels, tuple(names))
