"""Choosing templates, and holding them ready for deformation."""

from __future__ import annotations

import csv
import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import Float
from numpy.typing import NDArray
from torch import Tensor

from ffd_lightning.app.config import SourceKind, TemplateStrategy
from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.packing import (
    UNKNOWN_PART,
    pack_mesh,
    pack_points,
    unpack_mesh,
    unpack_points,
)
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.deformation import deform, deformation_matrix
from ffd_lightning.geometry.lattice import Degrees, Lattice
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.geometry.subdivision import subdivide

log = logging.getLogger(__name__)

_CANDIDATES = 1000
_SPREAD = 16
_CANDIDATE_POINTS = 256


def choose_templates(
    prepared: PreparedSet,
    count: int,
    strategy: TemplateStrategy,
    file: str | Path | None = None,
    seed: int = 0,
) -> tuple[str, ...]:
    """Choose template ids from a prepared set.

    Args:
        prepared: the models to choose from.
        count: how many, T.
        strategy: `paper` takes the first T of the paper's 30 for the set's category, and as
            `diverse` would what the set does not hold of them; `auto` is `paper` for ShapeNet's
            models where the paper has templates, else `diverse`. `diverse` starts at the most
            central model and goes on to whichever is farthest in Chamfer distance from all chosen;
            `random` draws with `seed`; `listed` takes the first T ids of a file (one a line);
            `ranking` takes the first T of the `id` column of a run's `template_ranking.csv`.
        file: for `listed` and `ranking`.
        seed: for `random`.

    Raises:
        ConfigError: a file that is missing or too short, ids that the set does not hold, or
            `paper` for a category that the paper does not have.
        DataError: fewer models than templates.
    """
    if count > len(prepared):
        raise DataError(
            f"{count} templates asked for, but {prepared.path} holds only {len(prepared)} models: "
            "choose fewer (templates=t1 ... t30) or prepare more models"
        )
    if strategy is TemplateStrategy.random:
        order = np.random.default_rng(seed).permutation(len(prepared))[:count]
        return tuple(prepared.ids[i] for i in order)
    settings = prepared.manifest["settings"]
    known = paper_templates(settings["category"])
    if strategy is TemplateStrategy.auto:
        of_shapenet = settings["source"].get("source") == SourceKind.shapenet.value
        strategy = TemplateStrategy.paper if known and of_shapenet else TemplateStrategy.diverse
    if strategy is TemplateStrategy.paper:
        return _paper_templates(prepared, count, known)
    if strategy is TemplateStrategy.diverse:
        return _farthest_points(prepared, count)
    return _read_ids(prepared, count, strategy, file)


def _read_ids(
    prepared: PreparedSet, count: int, strategy: TemplateStrategy, file: str | Path | None
) -> tuple[str, ...]:
    try:
        # -sig: some editors put a byte order mark first.
        text = Path(str(file)).read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"templates.file={file} cannot be read: {error}") from None
    if strategy is TemplateStrategy.ranking:
        rows = list(csv.DictReader(text.splitlines()))
        if not rows or "id" not in rows[0]:
            raise ConfigError(
                f"templates.file={file} has no column `id`: give a run's template_ranking.csv"
            )
        column = [(row["id"] or "").strip() for row in rows]  # None where a row is short
    else:
        column = [line.split("#")[0].strip() for line in text.splitlines()]
    ids = list(dict.fromkeys(i for i in column if i))
    if len(ids) < count:
        raise ConfigError(f"templates.file={file} lists {len(ids)} ids, {count} are needed")
    unknown = sorted(set(ids[:count]) - set(prepared.ids))
    if unknown:
        raise ConfigError(
            f"templates.file={file} names {len(unknown)} models that are not in {prepared.path}, "
            f"the first {unknown[0]!r}"
        )
    return tuple(ids[:count])


def _paper_templates(prepared: PreparedSet, count: int, known: tuple[str, ...]) -> tuple[str, ...]:
    """Take the first `count` of the paper's ids, or replacements for those that are not there."""
    if not known:
        raise ConfigError(
            "templates.strategy=paper: the paper has no templates for "
            f"{prepared.manifest['settings']['category']}; use diverse"
        )
    wanted, held = known[:count], set(prepared.ids)
    absent = [i for i in wanted if i not in held]
    if absent:
        log.warning(
            "%s lacks %d of the paper's %d templates, replaced by the models farthest from the "
            "others: %s",
            prepared.path,
            len(absent),
            len(wanted),
            ", ".join(absent),
        )
    return _farthest_points(prepared, count, [i for i in wanted if i in held])


def _farthest_points(
    prepared: PreparedSet, count: int, first: Sequence[str] = ()
) -> tuple[str, ...]:
    """Farthest-point choice under Chamfer distance, among `_CANDIDATES` models of a larger set.

    It begins with the models `first`, or with the most central one.
    """
    if len(first) >= count:
        return tuple(first[:count])
    size = min(len(prepared), max(_CANDIDATES, count))
    given = [prepared.index(i) for i in first]
    candidates = np.union1d(np.linspace(0, len(prepared) - 1, size).astype(int), given).astype(int)
    points = torch.from_numpy(
        np.stack([prepared.cloud(int(i), _CANDIDATE_POINTS) for i in candidates])
    )
    chosen = np.searchsorted(candidates, given).tolist()
    if not chosen:
        # The most central model: the least total distance to a spread of others.
        spread = points[np.linspace(0, len(points) - 1, min(len(points), _SPREAD)).astype(int)]
        chosen = [
            int(torch.stack([chamfer_distance(p, points, "mean") for p in spread]).sum(0).argmin())
        ]
    distance = torch.stack([chamfer_distance(points[c], points, "mean") for c in chosen]).amin(0)
    while len(chosen) < count:
        distance[chosen] = -1
        chosen.append(int(distance.argmax()))
        distance = torch.minimum(distance, chamfer_distance(points[chosen[-1]], points, "mean"))
    return tuple(prepared.ids[candidates[i]] for i in chosen)


class TemplateBank:
    """All templates of a run: clouds, meshes, parts, and their decomposition.

    One lattice per template, the bounding box of its mesh, serves its cloud and its mesh alike.

    Args:
        ids: T model ids.
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
        """Take models of a prepared set as templates.

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

    def subdivided(self, index: int) -> tuple[Mesh, Float[Tensor, "vertices control"]]:
        """Return a template's mesh with short edges, parts and colours kept, and its B, (V, M)."""
        if index not in self._subdivided:
            self._subdivided[index] = self._subdivide(index)
        return self._subdivided[index]

    def _subdivide(self, index: int) -> tuple[Mesh, Float[Tensor, "vertices control"]]:
        mesh = self.meshes[index]
        vertices, faces, face_index = subdivide(mesh.vertices, mesh.faces, self.max_edge)
        parts = mesh.face_parts
        fine = Mesh(
            vertices=vertices,
            faces=faces,
            face_colors=mesh.face_colors[face_index],
            face_parts=None if parts is None else parts[face_index],
            part_names=mesh.part_names,
        )
        matrix = deformation_matrix(torch.from_numpy(vertices), self.lattices[index])
        return fine, matrix.float()

    def deformed_mesh(self, index: int, offsets: Float[Tensor, "control 3"]) -> Mesh:
        """Return a template's subdivided mesh, deformed by offsets (M, 3)."""
        mesh, matrix = self.subdivided(index)
        vertices = deform(matrix, self.control_points[index], offsets.detach().cpu().float())
        return mesh.with_vertices(vertices.double().numpy())
