"""A category as a product of components: its slots, what fills them, what goes together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Self

import numpy as np

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.shapes.kit.builder import Builder
from ffd_lightning.shapes.kit.materials import Rng


def nothing(*_: object) -> None:
    """Add nothing, for slots that may stay empty."""


Chosen = Mapping[str, "Component"]
"""The component of each slot."""
Needs = Mapping[str, tuple[str, ...]]
"""Names of components of earlier slots."""
_NONE: Needs = {}


@dataclass(frozen=True)
class Component:
    """One way to fill a slot.

    It goes with those components of earlier slots that `needs` names, and with all of the slots
    that are not named there.
    """

    name: str
    weight: float  # how frequent it is in the world, relative to the slot's others
    build: Callable[..., Any]  # draws it; which arguments it gets is its category's affair
    needs: Needs = field(default_factory=dict)

    def fits(self, chosen: Chosen) -> bool:
        """Return whether the component goes with those of the earlier slots."""
        return all(chosen[slot].name in names for slot, names in self.needs.items())

    @classmethod
    def of(
        cls, name: str, weight: float, build: Callable[..., Any], needs: Needs = _NONE, **fixed: Any
    ) -> Self:
        """Return a component whose `build` gets the arguments `fixed` besides the category's."""
        return cls(name, weight, partial(build, **fixed), needs)


@dataclass(frozen=True)
class Product:
    """A category."""

    parts: tuple[str, ...]  # in the order of their labels
    slots: Mapping[str, tuple[Component, ...]]  # in the order in which they are drawn
    family: tuple[str, ...]  # the slots whose components name a shape's structural family
    assemble: Callable[[Rng, Chosen], Builder]  # draws shared dimensions, calls the components

    def draw(self, rng: Rng) -> tuple[Mesh, str]:
        """Draw a shape, for each slot a component that goes with the ones before it.

        Return its mesh and its family, such as `legs-ladder`.
        """
        chosen: dict[str, Component] = {}
        for slot, components in self.slots.items():
            fitting = [c for c in components if c.fits(chosen)]
            weights = np.array([c.weight for c in fitting])
            chosen[slot] = fitting[int(rng.choice(len(fitting), p=weights / weights.sum()))]
        family = "-".join(chosen[slot].name for slot in self.family)
        mesh = self.assemble(rng, chosen).mesh()
        order = np.array([self.parts.index(name) for name in mesh.part_names], np.uint8)
        return replace(mesh, face_parts=order[mesh.face_parts], part_names=self.parts), family
