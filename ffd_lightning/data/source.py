"""What a source of shapes is."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera


@dataclass(frozen=True)
class PartCloud:
    """Points on a shape's surface of which the part is known.

    Attributes:
        points: (P, 3) float64, in the frame of the shape's mesh.
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
        images: the source's own images, one a view, (H, W, 4) uint8, colours and object mask, of
            any size; None where the mesh is to be rendered.
        cameras: that took them, in the mesh's frame and unit, one each; None where unknown.
        parts: annotated points, for meshes without part labels of their own.
        warning: what is wrong with it though it can be used, a line each, "" for nothing. What
            comes before a line's first colon is the kind by which warnings are counted.
    """

    mesh: Mesh
    family: str = ""
    images: Sequence[NDArray[np.uint8]] | None = None
    cameras: Sequence[Camera] | None = None
    parts: PartCloud | None = None
    warning: str = ""

    def warned(self, *lines: str) -> SourceShape:
        """Return the same shape with further warnings; empty ones are none."""
        return replace(self, warning="\n".join(filter(None, (self.warning, *lines))))


class Source:
    """Shapes by category and id. Picklable, so that worker processes can hold one each.

    Attributes:
        own_images: whether its shapes come with images, so that none are rendered.
    """

    own_images: bool = False

    @abstractmethod
    def categories(self) -> list[str]:
        """Return what can be asked for, sorted: names where the project has one, else ids."""
        raise NotImplementedError

    @abstractmethod
    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of `category`, sorted.

        Raises:
            DataError: the source has no such category; the message lists those it has.
        """
        raise NotImplementedError

    @abstractmethod
    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return one shape of `shape_ids`.

        Raises:
            RejectedShapeError: the shape cannot be used; the message is the reason.
        """
        raise NotImplementedError

    @abstractmethod
    def fingerprint(self, category: str) -> dict[str, object]:
        """Return the JSON-able facts that decide what `load` returns for this category."""
        raise NotImplementedError

    def rejected(self, category: str) -> dict[str, str]:
        """Return which shapes are seen to be unusable without loading them, and why, by id."""
        return {}

    def split(self, category: str) -> dict[str, str]:
        """Return the data set's own split, "train", "val" or "test" by id; {} if it has none."""
        return {}
