"""Templates, held ready for deformation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.data.preparation.packing import (
    pack_mesh,
    pack_points,
    unpack_mesh,
    unpack_points,
)
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.geometry.ffd import Degrees, Lattice, TemplateSample, deform, deformation_matrix
from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh, mean_colors, normalize, renumber_parts
from ffd_lightning.geometry.sampling import sample_stratified
from ffd_lightning.geometry.subdivision import subdivide_mesh
from ffd_lightning.metrics.distortion import unique_edges

_KEPT = 100  # subdivided meshes, with their B some 15 MB each
_DIVISIONS = 2  # of a small face's edges, where its texture is averaged


class _LazyMeshes(Sequence[Mesh]):
    """Meshes that are made of their keys when they are asked for, and kept."""

    def __init__(self, make: Callable[[Any], Mesh], keys: Sequence[Any]) -> None:
        self._make, self._keys = make, keys
        self._made: dict[int, Mesh] = {}

    def __len__(self) -> int:
        return len(self._keys)

    def __getitem__(self, index: Any) -> Any:
        key = self._keys[index]
        if index not in self._made:
            self._made[index] = self._make(key)
        return self._made[index]


def _renamed(names: tuple[str, ...], origin: tuple[TemplateBank, int]) -> Mesh:
    """Return a mesh of a bank, its parts numbered by other names."""
    bank, row = origin
    mesh = bank.meshes[row]
    if mesh.face_parts is None:
        return mesh
    parts = renumber_parts(mesh.face_parts, bank.part_names, names)
    return replace(mesh, face_parts=parts, part_names=names)


@dataclass(eq=False, repr=False)
class TemplateBank:
    """T templates: clouds, meshes, parts, and their decomposition.

    Made of a prepared set's shapes (`of`), of any meshes (`of_meshes`), or of what a checkpoint
    holds (`from_state`). One lattice per template, the bounding box of its mesh, serves its cloud
    and its mesh alike.

    Attributes:
        ids: T shape ids.
        families: T structural families, "" where unknown.
        points: clouds, (T, N, 3) float32.
        meshes: T normalised meshes as prepared (not subdivided).
        point_parts: part index per point, (T, N) uint8, or None.
        part_names: names of the parts.
        degrees: of the lattices.
        max_edge: longest edge of subdivided meshes.
        boxes: least corner and sides of each mesh's bounding box, (T, 2, 3) float64, if they are
            known already: meshes of a prepared set are read for it otherwise.
    """

    ids: tuple[str, ...]
    families: tuple[str, ...]
    points: Float[Tensor, "templates points 3"]
    meshes: Sequence[Mesh]
    point_parts: NDArray[np.uint8] | None = None
    part_names: tuple[str, ...] = ()
    degrees: Degrees = (3, 3, 3)
    max_edge: float = 0.02
    boxes: Float[Tensor, "templates 2 3"] | None = None
    _subdivided: dict[int, tuple[Mesh, Tensor]] = field(default_factory=dict, init=False)
    _edges: dict[int, NDArray[np.int64]] = field(default_factory=dict, init=False)

    @classmethod
    def of(
        cls,
        prepared: PreparedSet,
        ids: Sequence[str],
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
    ) -> TemplateBank:
        """Take shapes of a prepared set as templates."""
        rows = [prepared.index(i) for i in ids]
        parts = [p for r in rows if (p := prepared.point_parts(r)) is not None]  # all, or none
        return cls(
            tuple(ids),
            tuple(prepared.families[r] for r in rows),
            torch.from_numpy(np.stack([prepared.cloud(r) for r in rows])),
            _LazyMeshes(prepared.mesh, rows),
            np.stack(parts) if parts else None,
            prepared.part_names,
            degrees,
            max_edge,
        )

    @classmethod
    def of_meshes(
        cls,
        meshes: Mapping[str, Mesh],
        num_points: int = 16384,
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
    ) -> TemplateBank:
        """Take any meshes as templates: they are normalised, and clouds drawn from them.

        Args:
            meshes: by id, in ShapeNet's frame (y up, facing -z), of any size.
            num_points: per cloud.
            degrees: of the lattices.
            max_edge: longest edge of subdivided meshes.

        Raises:
            ValueError: a mesh without area.
        """
        names = tuple(dict.fromkeys(name for mesh in meshes.values() for name in mesh.part_names))
        clouds, parts, normalized = [], [], []
        for mesh in meshes.values():
            mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
            rng = np.random.default_rng(0)
            points, faces = sample_stratified(mesh.vertices, mesh.faces, num_points, rng)
            if names:
                own = renumber_parts(mesh.parts(), mesh.part_names, names)
                mesh = replace(mesh, face_parts=own, part_names=names)
                parts.append(own[faces])
            clouds.append(points)
            normalized.append(mesh)
        return cls(
            tuple(meshes),
            ("",) * len(meshes),
            torch.from_numpy(unpack_points(pack_points(np.stack(clouds)))),  # as `state` keeps them
            tuple(normalized),
            np.stack(parts) if names else None,
            names,
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
            tuple(state["ids"]),
            tuple(state["families"]),
            torch.from_numpy(unpack_points(state["points"].numpy())),
            tuple(mesh if named else replace(mesh, face_parts=None) for mesh, _ in unpacked),
            np.stack([parts for _, parts in unpacked]) if named else None,
            tuple(state["part_names"]),
            (first, second, third),
            state["max_edge"],
        )

    def __len__(self) -> int:
        return len(self.ids)

    def is_of(self, other: TemplateBank) -> bool:
        """Return whether another bank has the same ids and lattices: a shape's file may change."""
        named = (self.ids, self.degrees) == (other.ids, other.degrees)
        return named and torch.allclose(self.control_points, other.control_points, atol=1e-3)

    @cached_property
    def lattices(self) -> tuple[Lattice, ...]:
        """The bounding box of each mesh."""
        if self.boxes is not None:
            return tuple(Lattice(low, size, self.degrees) for low, size in self.boxes)
        vertices = (torch.from_numpy(mesh.used_vertices()) for mesh in self.meshes)
        return tuple(Lattice.bounding(v, self.degrees) for v in vertices)

    @cached_property
    def control_points(self) -> Float[Tensor, "templates control 3"]:
        """P, (T, M, 3)."""
        return torch.stack([lattice.control_points() for lattice in self.lattices]).float()

    @cached_property
    def deformation_matrix(self) -> Float[Tensor, "templates points control"]:
        """B of the clouds, (T, N, M); not needed where only meshes are deformed."""
        pairs = zip(self.points, self.lattices, strict=True)
        return torch.stack([deformation_matrix(p.double(), box).float() for p, box in pairs])

    def lighter(self, num_points: int, max_edge: float | None = None) -> TemplateBank:
        """Return the templates with the first points of each cloud, and perhaps longer edges."""
        return replace(
            self,
            points=self.points[:, :num_points],
            point_parts=None if self.point_parts is None else self.point_parts[:, :num_points],
            max_edge=self.max_edge if max_edge is None else max_edge,
        )

    def joined(self, rows: Sequence[int], others: TemplateBank) -> TemplateBank:
        """Return some of these templates, and all others after them.

        Args:
            rows: which of these, indices.
            others: of the same degrees; with as many points, or all get the fewer.
        """
        names = tuple(dict.fromkeys([*self.part_names, *others.part_names]))
        taken = [(self, k) for k in rows] + [(others, k) for k in range(len(others))]
        count = min(self.points.shape[1], others.points.shape[1])
        parts = np.full((len(taken), count), UNKNOWN_PART, np.uint8)
        for own, (bank, k) in zip(parts, taken, strict=True):
            if bank.point_parts is not None:
                own[:] = renumber_parts(bank.point_parts[k, :count], bank.part_names, names)
        lattices = [bank.lattices[k] for bank, k in taken]
        return replace(
            self,
            ids=tuple(bank.ids[k] for bank, k in taken),
            families=tuple(bank.families[k] for bank, k in taken),
            points=torch.stack([bank.points[k, :count] for bank, k in taken]),
            meshes=_LazyMeshes(partial(_renamed, names), taken),
            point_parts=parts if names else None,
            part_names=names,
            boxes=torch.stack([torch.stack([box.origin, box.size]) for box in lattices]),
        )

    def sample(self, num_points: int) -> TemplateSample:
        """Return some points of each template, decomposed."""
        matrix = self.lighter(num_points).deformation_matrix
        return TemplateSample(matrix, self.control_points, self.degrees)

    def subdivided(self, index: int) -> tuple[Mesh, Float[Tensor, "vertices control"]]:
        """Return a template's mesh with short edges and its B, (V, M).

        Parts and textures are kept; where there is a texture, each small face has its colour.
        """
        if (known := self._subdivided.get(index)) is not None:
            return known
        fine = subdivide_mesh(self.meshes[index], self.max_edge)
        fine = replace(fine, face_colors=mean_colors(fine, _DIVISIONS))
        matrix = deformation_matrix(torch.from_numpy(fine.vertices), self.lattices[index]).float()
        if len(self._subdivided) >= _KEPT:
            oldest, *_ = [*self._subdivided]  # a copy: other threads may add meanwhile
            self._subdivided.pop(oldest, None)
            self._edges.pop(oldest, None)
        self._subdivided[index] = fine, matrix
        return fine, matrix

    def edges(self, index: int) -> NDArray[np.int64]:
        """Return the edges of a template's subdivided mesh, (E, 2)."""
        if (known := self._edges.get(index)) is None:
            mesh, _ = self.subdivided(index)
            known = self._edges[index] = unique_edges(mesh.vertices, mesh.faces)
        return known

    def deformed_mesh(self, index: int, offsets: Float[Tensor, "control 3"]) -> Mesh:
        """Return a template's subdivided mesh, deformed by offsets (M, 3)."""
        mesh, matrix = self.subdivided(index)
        vertices = deform(matrix, self.control_points[index], offsets.detach().cpu().float())
        return mesh.with_vertices(vertices.double().numpy())
