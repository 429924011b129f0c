from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from ffd_lightning.data.categories import PAPER_CATEGORIES
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.shapes import categories, product
from ffd_lightning.shapes.kit import Builder, Material

COUNT = 80
FACES = (100, 10_000)

pytestmark = pytest.mark.parametrize("category", list(PAPER_CATEGORIES))


@lru_cache
def models(category):
    source = ProceduralSource(COUNT)
    return [source.load(category, i) for i in source.shape_ids(category)]


def test_meshes_are_usable_and_made_of_all_components(category):
    assert categories() == tuple(PAPER_CATEGORIES)
    parts = product(category).parts
    for model in models(category):
        mesh = model.mesh
        assert np.isfinite(mesh.vertices).all()
        assert FACES[0] <= len(mesh.faces) <= FACES[1], model.family
        assert 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices)
        assert mesh.part_names == parts
        assert mesh.face_parts.max() < len(parts)
        assert np.ptp(mesh.vertices, axis=0).min() > 0, "flat"


def test_every_choice_leads_to_a_shape_and_every_component_is_chosen(category):
    slots, seen = product(category).slots, set()
    needed = {slot for components in slots.values() for c in components for slot in c.needs}
    states = [{}]
    for slot, components in slots.items():
        following = {}
        for state in states:
            fitting = [c for c in components if c.fits(state)]
            assert fitting, (slot, {name: c.name for name, c in state.items()})
            seen |= {id(c) for c in fitting}
            for component in fitting:
                chosen = {**state, slot: component}
                # What no later slot asks for makes no difference.
                following[tuple(c.name for s, c in chosen.items() if s in needed)] = chosen
        states = list(following.values())
    assert seen == {id(c) for components in slots.values() for c in components}


def test_part_labels_keep_their_meaning(category):
    """Parts that are drawn in another order: every face keeps its part's name."""
    found = product(category)
    expected = list(reversed(found.parts))

    def stack(rng, chosen):
        b = Builder()
        for height, part in enumerate(expected):
            b.box(part, Material((1, 0, 0)), (0, height, 0), (1, 1, 1))
        return b

    mesh, _ = replace(found, assemble=stack).draw(np.random.default_rng(0))
    names = [mesh.part_names[p] for p in mesh.face_parts]
    assert names == [part for part in expected for _ in range(12)]


def test_seed_draws_another_set(category):
    other = ProceduralSource(1, seed=1)
    model = other.load(category, other.shape_ids(category)[0])
    assert not np.array_equal(model.mesh.vertices, models(category)[0].mesh.vertices)
    assert other.fingerprint(category) != ProceduralSource(1).fingerprint(category)
    assert ProceduralSource(2).fingerprint(category) != ProceduralSource(1).fingerprint(category)
