import importlib
from functools import lru_cache

import numpy as np
import pytest

from ffd_lightning.data.categories import PAPER_CATEGORIES
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.shapes import categories, families
from ffd_lightning.shapes.kit import Builder, Material

PACKAGE = "ffd_lightning.shapes"
COUNT = 80
FACES = (100, 10_000)

pytestmark = pytest.mark.parametrize("category", list(PAPER_CATEGORIES))


@lru_cache
def models(category):
    source = ProceduralSource(COUNT)
    return [source.load(category, i) for i in source.shape_ids(category)]


def test_meshes_are_usable_and_of_all_families(category):
    assert categories() == tuple(PAPER_CATEGORIES)
    module = importlib.import_module(f"{PACKAGE}.{category}")
    assert {model.family for model in models(category)} == set(families(category))
    for model in models(category):
        mesh = model.mesh
        assert np.isfinite(mesh.vertices).all()
        assert FACES[0] <= len(mesh.faces) <= FACES[1], model.family
        assert 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices)
        assert mesh.part_names == tuple(module.PARTS)
        assert mesh.face_parts.max() < len(module.PARTS)
        assert np.ptp(mesh.vertices, axis=0).min() > 0, "flat"


def test_part_labels_keep_their_meaning(category, monkeypatch):
    """A family that names its parts in another order: every face keeps its part's name."""
    module = importlib.import_module(f"{PACKAGE}.{category}")
    expected = list(reversed(module.PARTS))

    def build(rng):
        b = Builder()
        for height, part in enumerate(expected):
            b.box(part, Material((1, 0, 0)), (0, height, 0), (1, 1, 1))
        return b

    monkeypatch.setattr(module, "FAMILIES", {"stack": build})
    mesh = ProceduralSource(1).load(category, f"{category}-000000").mesh
    names = [mesh.part_names[p] for p in mesh.face_parts]
    assert names == [part for part in expected for _ in range(12)]


def test_seed_draws_another_set(category):
    other = ProceduralSource(1, seed=1)
    model = other.load(category, other.shape_ids(category)[0])
    assert not np.array_equal(model.mesh.vertices, models(category)[0].mesh.vertices)
    assert other.fingerprint(category) != ProceduralSource(1).fingerprint(category)
    assert ProceduralSource(2).fingerprint(category) != ProceduralSource(1).fingerprint(category)
