import numpy as np
import pytest
import torch
from lightning.fabric.utilities import move_data_to_device

from ffd_lightning.app.build import build_data
from ffd_lightning.data.batches import ShapeStore
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.pool import TemplatePool
from ffd_lightning.errors import ConfigError


class _Set:
    """A prepared set of names."""

    def __init__(self, *ids):
        self.ids = ids
        self.origins = {i: i.partition("~")[0] for i in ids if "~" in i}

    def __len__(self):
        return len(self.ids)

    def index(self, shape_id):
        return self.ids.index(shape_id)

    def category(self, row):
        return self.ids[row].rpartition("/")[0]


def test_no_shape_is_a_template_of_itself_or_of_a_variant_of_itself():
    prepared = _Set("a", "a~0", "a~1", "b", "b~0", "c", "d")
    pool = TemplatePool(prepared, prepared.ids, count=24)
    assert pool.count == 2, "half of four shapes"
    seen = set()
    for step in range(50):
        templates, queries = pool.draw(4, np.random.default_rng(step))
        of = [
            {prepared.ids[row].partition("~")[0] for row in rows} for rows in (templates, queries)
        ]
        assert len(of[0]) == 2
        assert not of[0] & of[1]
        seen |= {*templates.tolist()}
    assert seen == set(range(7)), "every shape is a template now and then, variants too"
    with pytest.raises(ConfigError, match="add shapes"):
        TemplatePool(prepared, ["a", "a~0"], 1)


def test_of_several_categories_a_step_takes_a_few_and_as_many_templates_of_each():
    prepared = _Set(*(f"{name}/{k}" for name in "abc" for k in range(9)))
    pool = TemplatePool(prepared, prepared.ids, count=8)
    assert pool.count == 8
    for step in range(20):
        templates, queries = pool.draw(6, np.random.default_rng(step))
        drawn, seen = ([prepared.category(row) for row in rows] for rows in (templates, queries))
        assert sorted(map(drawn.count, set(drawn))) == [4, 4]
        assert {*seen} <= {*drawn}


def test_half_of_the_drawn_templates_are_of_the_bank():
    prepared = _Set(*(f"{name}/{k}" for name in "ab" for k in range(40)))
    pool = TemplatePool(prepared, prepared.ids, count=16, bank=[f"a/{k}" for k in range(6)])
    for step in range(20):
        templates, _ = pool.draw(6, np.random.default_rng(step))
        drawn = [prepared.ids[row] for row in templates]
        assert sum(shape in {f"a/{k}" for k in range(6)} for shape in drawn) >= 4
        assert sum(shape.startswith("b/") for shape in drawn) == 8


def test_drawn_templates_of_several_categories_are_told_apart(tiny_config):
    joint = ("category=joint", "category.members=[sofa,table]", "templates=t2")
    data = build_data(tiny_config(*joint, "heads=conditioned", "heads.draw=4"))
    data.setup()
    indices = data.train_dataloader().loader.dataset[0]
    batch = data.store.batch(indices)
    of_query = [data.prepared.category(row) for row in batch.rows.tolist()]
    of_template = np.array([data.prepared.category(k) for k in indices.template_rows.tolist()])
    for name, own in zip(of_query, batch.own_templates.tolist(), strict=True):
        assert own == np.flatnonzero(of_template == name).tolist()
    # Tensors without content stand in for a GPU's, of which a step reads nothing back.
    gpu = torch.device("meta")
    store = ShapeStore(data.prepared, data.bank, gpu, boxes=data.pool.boxes)
    found = store.batch(move_data_to_device(indices, gpu))
    assert found.drawn.points.shape == batch.drawn.points.shape


def test_drawn_templates_are_decomposed_as_those_of_a_bank(tiny_config):
    data = build_data(tiny_config("category=table", "heads=conditioned", "templates=t2"))
    data.setup()
    indices = data.train_dataloader().loader.dataset[3]
    batch = data.store.batch(indices)
    rows = indices.template_rows.tolist()
    assert len(rows) == len(batch.templates.control_points) > len(data.bank)
    bank = TemplateBank.of(data.prepared, [data.prepared.ids[row] for row in rows])
    for t, points in enumerate(indices.template_points):
        assert torch.equal(batch.drawn.points[t], bank.points[t, points])
        assert torch.equal(
            batch.templates.deformation_matrix[t], bank.deformation_matrix[t, points]
        )
        picture = torch.from_numpy(data.prepared.image(rows[t])[..., :3].copy())
        assert torch.equal(batch.drawn.images[t], picture.permute(2, 0, 1))
    assert torch.equal(batch.templates.control_points, bank.control_points)
    assert data.test_dataloader().loader.dataset[0].template_rows is None
