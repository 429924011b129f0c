from dataclasses import dataclass

import pytest
from box_source import BoxSource, box_mesh, box_module, boxes_of

from ffd_lightning.data.source import SourceShape
from ffd_lightning.data.splits import AutoSplit, HashSplit, SplitInput, make_split
from ffd_lightning.data.twins import twin_note, twins

POINTS = 16384


@dataclass(frozen=True)
class Doubled(BoxSource):
    """Boxes of which every second is nearly the one before; the last is a little longer."""

    def load(self, category, shape_id):
        number = int(shape_id[1:])
        mesh = box_mesh(number // 2 * 2)
        if number == self.count - 1:
            mesh = mesh.with_vertices(mesh.vertices * (1.05, 1, 1))
        return SourceShape(mesh)

    def split(self, category):
        return {i: "test" if i in ("b00", "b03") else "train" for i in self.shape_ids(category)}


@pytest.fixture(scope="module")
def doubled(tmp_path_factory):
    root = tmp_path_factory.mktemp("doubled")
    source = Doubled(6, root / "log")
    boxes_of(source, root, num_points=POINTS, progress=False).run()
    return source, root


def test_twins_are_copies_and_not_what_is_alike(doubled):
    source, root = doubled
    prepared = boxes_of(source, root, num_points=POINTS).run()
    copies = {"b00": "b00", "b01": "b00", "b02": "b02", "b03": "b02"}
    assert twins(prepared) == copies
    assert twins(prepared.without(["b00"])) == {"b02": "b02", "b03": "b02"}
    assert "4 shapes" in twin_note(copies, {})
    assert "2 that the published split tests on" in twin_note(copies, source.split("box"))


def test_copies_go_where_the_first_goes(doubled):
    ids = tuple(f"{k:03d}" for k in range(200))
    alone = HashSplit()(SplitInput("box", ids, (), {}))
    pairs = {i: f"{int(i) // 2 * 2:03d}" for i in ids[:100]}
    found = HashSplit()(SplitInput("box", ids, (), {}, pairs))
    assert all(found[i] == alone[pairs.get(i, i)] for i in ids)
    split = make_split(ids, found, 0.3, pairs)
    assert all((i in split.val) == (pairs[i] in split.val) for i in pairs)


def test_what_a_published_split_parts_is_said(doubled):
    made_by = boxes_of(*doubled, num_points=POINTS)
    given = {"num_templates": 1, "val_fraction": 0}
    data = box_module(made_by, split=AutoSplit(), **given)
    assert data.split.test == ("b00", "b03")
    assert data.seen_twins == {"b00", "b03"}
    assert not box_module(made_by, split=HashSplit(0.5), **given).seen_twins
