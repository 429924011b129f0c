"""Templates, held ready for deformation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.packing import (
    UNKNOWN_PART,
    pack_mesh,
    pack_points,
    unpack_mesh,
    unpack_points,
)
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.geometry.ffd import Degrees, Lattice, deform, deformation_matrix
from ffd_lightning.geometry.mesh import Mesh, mean_colors
from ffd_lightning.geometry.subdivision import subdivide_mesh

_DIVISIONS = 2  # of a small face's edges, where its texture is averaged


class TemplateBank:
    """All templates of a run: clouds, meshes, parts, and their decomposition.

    One lattice per template, the bounding box of its mesh, serves its cloud and its mesh alike.

    Args:
        ids: T shape ids.
        families: T structural families, "" where unknown.
        points: clouds, (T, N, 3) float32.
        meshes: T normalised meshes as prepared (not subdivided).
        point_parts: part index per point, (T, N) uint8, or None.
        part_names: names of the parts.
        degrees: of the lattices.
        max_edge: longest edge of subdivided meshes.

    Attributes:
        lattices: T lattices.
        control_points: P, (T, M, 3).
    """

    def __init__(
        self,
        ids: Sequence[str],
        families: Sequence[str],
        points: NDArray[np.float32],
        meshes: Sequence[Mesh],
        point_parts: NDArray[np.uint8] | None = None,
        part_names: Sequence[str] = (),
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
    ) -> None:
        self.ids, self.families, self.meshes = tuple(ids), tuple(families), tuple(meshes)
        self.points = torch.from_numpy(points)
        self.point_parts, self.part_names = point_parts, tuple(part_names)
        self.degrees, self.max_edge = degrees, max_edge
        self._subdivided: dict[int, tuple[Mesh, Tensor]] = {}
        self.lattices = tuple(
            Lattice.bounding(torch.from_numpy(m.used_vertices()), degrees) for m in self.meshes
        )
        self.control_points = torch.stack([k.control_points() for k in self.lattices]).float()

    @cached_property
    def deformation_matrix(self) -> Float[Tensor, "templates points control"]:
        """B of the clouds, (T, N, M); not needed where only meshes are deformed."""
        matrices = [
            deformation_matrix(p.double(), lattice).float()
            for p, lattice in zip(self.points, self.lattices, strict=True)
        ]
        return torch.stack(matrices)

    @classmethod
    def of(
        cls,
        prepared: PreparedSet,
        ids: Sequence[str],
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
    ) -> TemplateBank:
        """Take shapes of a prepared set as templates.

        Raises:
            DataError: the set does not hold one of them.
        """
        rows = [prepared.index(i) for i in ids]
        parts = [p for r in rows if (p := prepared.point_parts(r)) is not None]  # all, or none
        return cls(
            ids,
            [prepared.families[r] for r in rows],
            np.stack([prepared.cloud(r) for r in rows]),
            [prepared.mesh(r) for r in rows],
            np.stack(parts) if parts else None,
            prepared.part_names,
            degrees,
            max_edge,
        )

    def state(self) -> dict[str, Any]:
        """Return all that `from_state` needs: numbers, words and tensors, packed small."""
        unknown = np.full(self.points.shape[:2], UNKNOWN_PART, np.uint8)
        parts = unknown if self.point_parts is None else self.point_parts
        packed = [pack_mesh(mesh, own) for mesh, own in zip(self.meshes, parts, strict=True)]
        return {
            "ids": list(self.ids),
            "families": list(self.families),
            "part_names": list(self.part_names),
            "degrees": list(self.degrees),
            "max_edge": self.max_edge,
            "points": torch.from_numpy(pack_points(self.points.numpy())),
            "meshes": [torch.frombuffer(bytearray(mesh), dtype=torch.uint8) for mesh in packed],
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> TemplateBank:
        """Return the templates that `state` was called on.

        Raises:
            KeyError, ValueError: it is of something else, or damaged.
        """
        unpacked = [unpack_mesh(mesh.numpy().tobytes()) for mesh in state["meshes"]]
        first, second, third = state["degrees"]
        named = bool(state["part_names"])
        return cls(
            state["ids"],
            state["families"],
            unpack_points(state["points"].numpy()),
            [mesh if named else replace(mesh, face_parts=None) for mesh, _ in unpacked],
            np.stack([parts for _, parts in unpacked]) if named else None,
            state["part_names"],
            (first, second, third),
            state["max_edge"],
        )

    def __len__(self) -> int:
        return len(self.ids)

    def lighter(self, num_points: int, max_edge: float | None = None) -> TemplateBank:
        """Return the same templates with fewer points, or with longer edges.

        Args:
            num_points: the first of each cloud, whose order is random.
            max_edge: longest edge of subdivided meshes; None leaves it.
        """
        parts = None if self.point_parts is None else self.point_parts[:, :num_points]
        return TemplateBank(
            self.ids,
            self.families,
            self.points[:, :num_points].numpy(),
            self.meshes,
            parts,
            self.part_names,
            self.degrees,
            self.max_edge if max_edge is None else max_edge,
        )

    def subdivided(self, index: int) -> tuple[Mesh, Float[Tensor, "vertices control"]]:
        """Return a template's mesh with short edges and its B, (V, M).

        Parts and textures are kept; where there is a texture, each small face has its colour.
        """
        if index not in self._subdivided:
            self._subdivided[index] = self._subdivide(index)
        return self._subdivided[index]

    def _subdivide(self, index: int) -> tuple[Mesh, Float[Tensor, "vertices control"]]:
        fine = subdivide_mesh(self.meshes[index], self.max_edge)
        fine = replace(fine, face_colors=mean_colors(fine, _DIVISIONS))
        matrix = deformation_matrix(torch.from_numpy(fine.vertices), self.lattices[index])
        return fine, matrix.float()

    def deformed_mesh(self, index: int, offsets: Float[Tensor, "control 3"]) -> Mesh:
        """Return a template's subdivided mesh, deformed by offsets (M, 3)."""
        mesh, matrix = self.subdivided(index)
        vertices = deform(matrix, self.control_points[index], offsets.detach().cpu().float())
        return mesh.with_vertices(vertices.double().numpy())
