"""The shapes of a set that templates may be chosen from."""

from __future__ import annotations

import hashlib
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.preparation.joined import JoinedSet
from ffd_lightning.data.preparation.prepared import PreparedSet


@dataclass(frozen=True)
class Candidates(JoinedSet):
    """Some shapes of a set as a set of their own; nothing is copied.

    Attributes:
        rows: of the shapes in `whole`.
    """

    rows: tuple[int, ...] = ()

    @classmethod
    def without(cls, whole: PreparedSet, exclude: Collection[str]) -> Candidates:
        """Take the shapes of a set that are not excluded."""
        left_out = set(exclude)
        rows = tuple(row for row, shape_id in enumerate(whole.ids) if shape_id not in left_out)
        own = tuple(whole.ids[row] for row in rows)
        digest = hashlib.sha256("\n".join((str(whole.manifest.get("sha256")), *own)).encode())
        return cls(
            path=whole.path,
            manifest={**whole.manifest, "sha256": digest.hexdigest()},
            ids=own,
            families=tuple(whole.families[row] for row in rows),
            part_names=whole.part_names,
            image_shape=whole.image_shape,
            arrays={},
            members=(whole,),
            rows=rows,
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return Candidates.without, (self.whole, set(self.whole.ids).difference(self.ids))

    @property
    def whole(self) -> PreparedSet:
        """The set that they are of."""
        return self.members[0]

    @property
    def mapped_clouds(self) -> tuple[NDArray[np.int16], ...]:
        """See `PreparedSet.mapped_clouds`."""
        (clouds,) = self.whole.mapped_clouds
        return tuple(clouds[row : row + 1] for row in self.rows)

    @cached_property
    def rejected(self) -> dict[str, str]:
        """See `PreparedSet.rejected`."""
        return self.whole.rejected

    def _place(self, row: int) -> tuple[PreparedSet, int]:
        return self.whole, self.rows[row]


def whole_set(prepared: PreparedSet) -> PreparedSet:
    """Return the set that candidates are of; any other set is whole."""
    return prepared.whole if isinstance(prepared, Candidates) else prepared
