"""What one visitor of the viewer looks at and has changed, apart from how it is drawn."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.geometry.ffd import deform, deformation_matrix
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.inference.reconstruction import Reconstruction
from ffd_lightning.metrics.chamfer import chamfer

Floats = NDArray[np.float32]

NUM_POINTS = 1024
"""Of a cloud that Chamfer distances are of, as in training."""


class Truth(NamedTuple):
    """What a test shape really is: its mesh, and points of its surface, (N, 3)."""

    mesh: Mesh
    points: Floats


class State:
    """A reconstruction that can be looked at step by step, and pulled at.

    What is drawn is ``deform(B, P, amount * dP + edit)``: `amount` goes from the template as it is
    (0) to the network's deformation (1) and beyond; `edit` is what was pulled by hand, and is kept
    for each template.

    Args:
        reconstruction: of the network.
        display: its templates, light enough to be moved many times a second.
        name: of the input, which files are named after.
        truth: None for photographs.

    Attributes:
        template: index of the template that is drawn, the selected one at first.
        amount: how much of the network's deformation is drawn.
        edits: by hand, (T, M, 3).
    """

    def __init__(
        self,
        reconstruction: Reconstruction,
        display: TemplateBank,
        name: str = "",
        truth: Truth | None = None,
    ) -> None:
        self.reconstruction, self.display = reconstruction, display
        self.name, self.truth = name, truth
        self.template = reconstruction.index
        self.amount = 1.0
        self.edits = np.zeros_like(reconstruction.offsets)

    @property
    def offsets(self) -> Floats:
        """How far each control point is from its place of rest, (M, 3)."""
        predicted = self.reconstruction.offsets[self.template]
        return np.float32(self.amount) * predicted + self.edits[self.template]

    @property
    def control_points(self) -> Floats:
        """Where the control points are, (M, 3)."""
        return self.display.control_points[self.template].numpy() + self.offsets

    @property
    def edited(self) -> NDArray[np.bool_]:
        """Which control points were moved by hand, (M,)."""
        return (self.edits[self.template] != 0).any(axis=1)

    def move(self, index: int, position: NDArray[np.floating]) -> None:
        """Put a control point somewhere, (3,)."""
        change = (position - self.control_points[index]).astype(np.float32)
        self.edits[self.template, index] += change

    def reset(self) -> None:
        """Take back the amount, and what was pulled at this template."""
        self.amount = 1.0
        self.edits[self.template] = 0

    def surface(self) -> Mesh:
        """Return the mesh to draw, deformed."""
        return self.display.deformed_mesh(self.template, torch.from_numpy(self.offsets))

    def template_surface(self) -> Mesh:
        """Return the mesh to draw as the template has it: the same vertices, at rest."""
        return self.display.subdivided(self.template)[0]

    def scores(self) -> dict[str, float]:
        """Return box Chamfer distances to the ground truth, {} for a photograph.

        Not times 1,000. Squared distances, mean over points, both directions added; the first
        1,024 points of each cloud; in units in which shapes have a bounding box of diagonal 1. Of
        what is drawn, of the template as the network deforms it, and of the template as it is.
        """
        if self.truth is None:
            return {}
        bank, t = self.display, self.template
        matrix = deformation_matrix(bank.points[t].double(), bank.lattices[t]).float()
        rest, truth = bank.control_points[t], self.truth.points
        predicted = self.reconstruction.offsets[t]
        kinds = {"drawn": self.offsets, "predicted": predicted, "undeformed": 0 * predicted}
        return {
            kind: chamfer(deform(matrix, rest, torch.from_numpy(o)).numpy(), truth[:NUM_POINTS])
            for kind, o in kinds.items()
        }

    def result(self) -> Reconstruction:
        """Return what is drawn as a reconstruction of its own, at full resolution."""
        offsets = self.reconstruction.offsets.copy()
        offsets[self.template] = self.offsets
        return replace(self.reconstruction, index=self.template, offsets=offsets)
