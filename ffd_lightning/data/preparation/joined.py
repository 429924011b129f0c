"""Prepared sets of several categories as one."""

from __future__ import annotations

import hashlib
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.preparation.packing import UNKNOWN_PART
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import DataError
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera


@dataclass(frozen=True)
class JoinedSet(PreparedSet):
    """Several categories' sets end to end; a shape's id is `<category>/<its own>`.

    Nothing is copied: each member stays mapped.

    Attributes:
        members: the sets, in the order of their rows.
    """

    members: tuple[PreparedSet, ...] = ()

    @classmethod
    def join(cls, members: Sequence[PreparedSet]) -> JoinedSet:
        """Join sets.

        Raises:
            DataError: they were prepared with other images or numbers of points.
        """
        first = members[0]
        for other in members[1:]:
            ours, theirs = ((*m.image_shape, m.num_points) for m in (first, other))
            if ours != theirs:
                raise DataError(
                    f"{first.path} and {other.path} cannot be joined: views, height, width, "
                    f"channels and points are {ours} and {theirs}"
                )
        categories = [str(m.manifest["settings"]["category"]) for m in members]
        digest = hashlib.sha256("".join(m.manifest["sha256"] for m in members).encode())
        return cls(
            path=Path("+".join(str(m.path) for m in members)),
            manifest={
                "sha256": digest.hexdigest(),
                "settings": {**first.manifest["settings"], "category": "+".join(categories)},
            },
            ids=tuple(f"{c}/{i}" for c, m in zip(categories, members, strict=True) for i in m.ids),
            families=tuple(f for m in members for f in m.families),
            part_names=tuple(dict.fromkeys(name for m in members for name in m.part_names)),
            image_shape=first.image_shape,
            arrays={},
            members=tuple(members),
        )

    def __reduce__(self) -> tuple[Any, ...]:
        # As of the members: files are mapped anew.
        return JoinedSet.join, (self.members,)

    @property
    def num_points(self) -> int:
        """Points per cloud, N."""
        return self.members[0].num_points

    @property
    def mapped_clouds(self) -> tuple[NDArray[np.int16], ...]:
        """See `PreparedSet.mapped_clouds`."""
        return tuple(array for m in self.members for array in m.mapped_clouds)

    def category(self, row: int) -> str:
        """Return the category of a shape."""
        return self._place(row)[0].category(0)

    def part_names_of(self, row: int) -> tuple[str, ...]:
        """See `PreparedSet.part_names_of`: those of the member that has it."""
        member, _ = self._place(row)
        return member.part_names

    def cloud(self, row: int, count: int | None = None) -> NDArray[np.float32]:
        """See `PreparedSet.cloud`."""
        member, own = self._place(row)
        return member.cloud(own, count)

    def image(self, row: int, view: int = 0) -> NDArray[np.uint8]:
        """See `PreparedSet.image`."""
        member, own = self._place(row)
        return member.image(own, view)

    def camera(self, row: int, view: int = 0) -> Camera:
        """See `PreparedSet.camera`."""
        member, own = self._place(row)
        return member.camera(own, view)

    def mesh(self, row: int) -> Mesh:
        """See `PreparedSet.mesh`; parts are numbered as all members' together."""
        member, own = self._place(row)
        mesh = member.mesh(own)
        if mesh.face_parts is None:
            return mesh
        parts = self._renumbered(member)[mesh.face_parts]
        return replace(mesh, face_parts=parts, part_names=self.part_names)

    def point_parts(self, row: int) -> NDArray[np.uint8] | None:
        """See `PreparedSet.point_parts`; of shapes without parts all are unknown."""
        if not self.part_names:
            return None
        member, own = self._place(row)
        parts = member.point_parts(own)
        if parts is None:
            return np.full(self.num_points, UNKNOWN_PART, np.uint8)
        return self._renumbered(member)[parts]

    @cached_property
    def rejected(self) -> dict[str, str]:
        """See `PreparedSet.rejected`."""
        pairs = [(m.category(0), m.rejected) for m in self.members]
        return {f"{c}/{i}": why for c, rejected in pairs for i, why in rejected.items()}

    @cached_property
    def _starts(self) -> list[int]:
        return list(accumulate((len(m) for m in self.members), initial=0))

    def _place(self, row: int) -> tuple[PreparedSet, int]:
        """Return the member that has a row, and its row there."""
        if not 0 <= row < len(self):
            raise IndexError(row)
        k = bisect_right(self._starts, row) - 1
        return self.members[k], row - self._starts[k]

    def _renumbered(self, member: PreparedSet) -> NDArray[np.uint8]:
        """Return the table from a member's parts to all members', (256,)."""
        table = np.full(256, UNKNOWN_PART, np.uint8)
        numbers = [self.part_names.index(name) for name in member.part_names]
        table[: len(numbers)] = numbers
        return table
