"""What shapes of several categories are built of.

The names that every family needs are here; the rest of the vocabulary is in the modules: legs,
boards, sheets, upholstery, cross-sections, paths.
"""

from ffd_lightning.shapes.kit.builder import Builder
from ffd_lightning.shapes.kit.materials import Material, Rng, draw, pick_material
from ffd_lightning.shapes.kit.product import Chosen, Component, Product, nothing

__all__ = [
    "Builder",
    "Chosen",
    "Component",
    "Material",
    "Product",
    "Rng",
    "draw",
    "nothing",
    "pick_material",
]
