"""What a source of shapes is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera


@dataclass(frozen=True)
class PartCloud:
    """Points on a shape's surface of which the part is known.

    Attributes:
        points: (P, 3) float64, in the frame of the model's mesh.
        labels: (P,) uint8 index into `names`, 255 unknown.
        names: names of the parts.
    """

    points: NDArray[np.float64]
    labels: NDArray[np.uint8]
    names: tuple[str, ...]


@dataclass(frozen=True)
class SourceShape:
    """One shape as its source gives it, before normalisation.

    Attributes:
        mesh: geometry, colours, textures and part labels; y up, facing -z (+x is its own right).
        family: structural family where the source knows it ("pedestal", say), else "".
        images: the source's own images, (views, H, W, 4) uint8, RGB over white and coverage, in the
            size asked for; None where the mesh is to be rendered.
        cameras: that took them, in the mesh's frame and unit, one each; None where unknown.
        parts: annotated points, for meshes without part labels of their own.
        warning: what is wrong with it though it can be used, "" for nothing.
    """

    mesh: Mesh
    family: str = ""
    images: NDArray[np.uint8] | None = None
    cameras: Sequence[Camera] | None = None
    parts: PartCloud | None = None
    warning: str = ""


@dataclass(frozen=True)
class Survey:
    """What can be seen of a category without loading its shapes.

    Attributes:
        layout: how its files are kept ("v1, zip archive", say).
        faults: shapes that cannot be used, and why.
        notes: what a user should know.
    """

    layout: str
    faults: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@runtime_checkable
class Source(Protocol):
    """Shapes by category and id. Picklable, so that worker processes can hold one each.

    A class of your own may inherit from this for what has a default.
    """

    def categories(self) -> list[str]:
        """Return what can be asked for, sorted: names where the project has one, else ids."""
        ...

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of `category`, sorted.

        Raises:
            DataError: the source has no such category; the message lists those it has.
        """
        ...

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return one shape.

        Args:
            category: one of `categories`.
            shape_id: one of `shape_ids`.

        Raises:
            RejectedShapeError: the model cannot be used; the message is the reason.
        """
        ...

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return the JSON-able facts that decide what `load` returns for this category."""
        ...

    def survey(self, category: str) -> Survey:
        """Look at a category without loading its shapes; by default there is nothing to say.

        Raises:
            DataError: as `shape_ids`.
        """
        self.shape_ids(category)
        return Survey("")

    def split(self, category: str) -> dict[str, str]:
        """Return the data set's own split, "train", "val" or "test" by id; {} if it has none."""
        return {}
