"""What a network makes of one photograph."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import torch
import trimesh
from numpy.typing import NDArray

from ffd_lightning.data.categories import ANY, members
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.geometry.sampling import sample_surface
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.framing import FramedPhoto
from ffd_lightning.inference.pieces import MeshColors
from ffd_lightning.inference.seen_side import choose_viewpoint, photo_colored
from ffd_lightning.nn.viewpoint import Viewpoint
from ffd_lightning.terminal import counted

_SURE = 0.5  # confidence of a viewpoint that needs no warning


@dataclass(frozen=True, eq=False)  # arrays have no one answer to ==
class Reconstruction:
    """One of T templates, deformed into what a photograph shows.

    Convention:
        y is up and the object faces -z. Templates have a bounding box of diagonal 1 about the
        origin; deformed they keep that unit.

    Attributes:
        photo: what the network saw.
        bank: the templates.
        weights: of the templates, (T,) float32; they sum to 1.
        offsets: of each template's M control points, (T, M, 3) float32.
        categories: of the templates, T.
        category: whose templates are ranked.
        index: the template that is deformed: the category's of the greatest weight, unless another
            `candidate` was asked for.
        viewpoints: from where the photograph may have been taken, the likeliest first; the camera
            of the training images, where all have one; () where nothing is known.
    """

    photo: FramedPhoto = field(repr=False)
    bank: TemplateBank = field(repr=False)
    weights: NDArray[np.float32] = field(repr=False)
    offsets: NDArray[np.float32] = field(repr=False)
    categories: tuple[str, ...] = field(repr=False)
    category: str
    index: int
    viewpoints: tuple[Viewpoint, ...] = ()

    @property
    def template_id(self) -> str:
        """The template's shape id."""
        return self.bank.ids[self.index]

    @property
    def weight(self) -> float:
        """The template's weight."""
        return float(self.weights[self.index])

    @property
    def part_names(self) -> tuple[str, ...]:
        """Names of the parts that labels count, () where the training data had none."""
        return self.bank.part_names

    @property
    def ranking(self) -> NDArray[np.int64]:
        """The category's templates, and those of `ANY`, by weight, the greatest first: indices."""
        own = np.array(members(self.categories, self.category))
        return own[np.argsort(-self.weights[own], kind="stable")]

    @property
    def category_weights(self) -> dict[str, float]:
        """The weight of each category, the sum of its templates': the greatest first."""
        total = dict.fromkeys(self.categories, 0.0)
        for category, weight in zip(self.categories, self.weights, strict=True):
            total[category] += float(weight)
        return dict(sorted(total.items(), key=lambda item: -item[1]))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user must know before the result is trusted: the photo's, and a doubt."""
        found, weights = self.photo.warnings, self.category_weights
        if self.viewpoint is not None and self.viewpoint.confidence < _SURE:
            found += (
                "the network doubts from which side the photograph was taken (confidence "
                f"{self.viewpoint.confidence:.2f}): the preview's side, "
                "and colours taken from the photograph, may be wrong",
            )
        own = weights.pop(self.category, 0.0)
        if self.category == ANY or own + weights.pop(ANY, 0.0) >= 0.5:
            return found
        name, other = next(iter(weights.items()))
        doubt = (
            f"the network doubts that it is of category {self.category}: it gives {self.category} "
            f"{own:.2f}, {name} {other:.2f}"
        )
        return (*found, doubt)

    def of_category(self, category: str) -> Reconstruction:
        """Return the same with the best template of another category, one of `categories`.

        Raises:
            ConfigError: no template is of it.
        """
        if category not in {*self.categories, ANY}:
            known = ", ".join(dict.fromkeys(self.categories))
            raise ConfigError(f"no template is of category {category!r}: they are of {known}")
        found = replace(self, category=category)
        return replace(found, index=int(found.ranking[0]))

    def candidate(self, rank: int) -> Reconstruction:
        """Return the same with the template of that rank, 0 being the selected one.

        Raises:
            IndexError: there are not so many templates.
        """
        ranking = self.ranking
        if not 0 <= rank < len(ranking):
            raise IndexError(
                f"no candidate {rank}: {counted(len(ranking), 'template')} of {self.category}"
            )
        return replace(self, index=int(ranking[rank]))

    @cached_property
    def surface(self) -> Mesh:
        """The deformed mesh with the project's own colours and parts per face."""
        return self.bank.deformed_mesh(self.index, torch.from_numpy(self.offsets[self.index]))

    @cached_property
    def viewpoint(self) -> Viewpoint | None:
        """From where the photograph was taken, front and back told apart by the mesh's outline."""
        if not self.viewpoints:
            return None
        return choose_viewpoint(self.viewpoints, self.surface, self.photo.image)

    @property
    def camera(self) -> Camera | None:
        """The camera that shows the mesh from the photograph's side, framed."""
        found = self.viewpoint
        return None if found is None else Camera(found.azimuth, found.elevation)

    def colored(self, colors: MeshColors, surface: Mesh | None = None) -> Mesh:
        """Return a mesh, for `photo` in the photograph's colours, if its side is known.

        Args:
            colors: what they are to say; only `photo` changes anything.
            surface: in the frame of `surface`, which it is by default.
        """
        mesh = self.surface if surface is None else surface
        if colors != "photo" or self.viewpoint is None:
            return mesh
        return photo_colored(mesh, self.viewpoint, self.photo.image)

    @property
    def mesh(self) -> trimesh.Trimesh:
        """The subdivided template, deformed, with a colour per face."""
        return _trimesh(self.surface)

    @property
    def template(self) -> trimesh.Trimesh:
        """The template as it is, with the vertices and faces of `mesh`."""
        return _trimesh(self.bank.subdivided(self.index)[0])

    @property
    def labels(self) -> NDArray[np.uint8] | None:
        """Part of each face of `mesh`, (F,) index into `part_names`, 255 unknown, or None.

        They are the template's: a deformation carries them along.
        """
        return self.surface.face_parts

    def cloud(self, count: int, seed: int = 0) -> NDArray[np.float32]:
        """Draw points uniformly from the deformed surface, (count, 3); see `sample`."""
        return self.sample(count, seed)[0]

    def sample(self, count: int, seed: int = 0) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Draw points uniformly from the deformed surface, in template units.

        Returns:
            (count, 3), and the face of `mesh` that each lies on, (count,).
        """
        rng = np.random.default_rng(seed)
        return sample_surface(self.surface.vertices, self.surface.faces, count, rng)


def _trimesh(mesh: Mesh) -> trimesh.Trimesh:
    # Copied, as callers may edit theirs, and the bank keeps its own. Not processed: vertices and
    # faces stay in the order of labels and decomposition.
    vertices, faces, colors = (a.copy() for a in (mesh.vertices, mesh.faces, mesh.face_colors))
    return trimesh.Trimesh(vertices, faces, face_colors=colors, process=False)
