import numpy as np
import pytest

from ffd_lightning.data.batches import ShapeStore
from ffd_lightning.data.datamodule import FfdDataModule, TrainingIndices
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.data.splits import HashSplit
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.render_settings import RenderSettings

NAMES = ("table", "sofa")
RENDER = RenderSettings(height=48, width=64, samples=1)


def preparation(category, root, points=256):
    return Preparation(
        ProceduralSource(12), category, points, RENDER, root, workers=2, progress=False
    )


@pytest.fixture(scope="module")
def members(data_root):
    return [preparation(category, data_root).run() for category in NAMES]


@pytest.fixture(scope="module")
def joined(members):
    return PreparedSet.open(*(member.path for member in members))


def test_rows_are_the_members_end_to_end(joined, members):
    tables, sofas = members
    assert len(joined) == len(tables) + len(sofas)
    for member, offset, category in ((tables, 0, "table"), (sofas, len(tables), "sofa")):
        for own in (0, len(member) - 1):
            row = offset + own
            assert joined.category(row) == category
            assert joined.ids[row] == f"{category}/{member.ids[own]}"
            assert joined.index(joined.ids[row]) == row
            assert joined.families[row] == member.families[own]
            np.testing.assert_array_equal(joined.cloud(row, 9), member.cloud(own, 9))
            np.testing.assert_array_equal(joined.image(row), member.image(own))
            assert joined.camera(row) == member.camera(own)
            assert joined.part_names_of(row) == member.part_names_of(own) == member.part_names
            for found in (lambda s, r: s.point_parts(r), lambda s, r: s.mesh(r).face_parts):
                parts = [
                    np.array(s.part_names)[found(s, r)] for s, r in ((joined, row), (member, own))
                ]
                np.testing.assert_array_equal(*parts)
    with pytest.raises(IndexError):
        joined.cloud(len(joined))


def test_sets_that_do_not_go_together(members, data_root):
    other = preparation("sofa", data_root, points=128).run()
    with pytest.raises(DataError, match=r"cannot be joined.*256\).*128\)"):
        PreparedSet.open(members[0].path, other.path)


def module(root, categories=NAMES, **settings):
    given = {"num_templates": 4, "split": HashSplit(0.6), "val_fraction": 0.3, **settings}
    preparations = [preparation(category, root) for category in categories]
    result = FfdDataModule(preparations, batch_size=6, num_points=64, **given)
    result.setup()
    return result


def test_each_category_gives_its_share_of_templates_and_its_own_split(data_root):
    joint = module(data_root, hold_out=6)
    alone = [module(data_root, [name], num_templates=2, hold_out=3) for name in NAMES]
    for k, subset in enumerate(joint.split):
        expected = [f"{n}/{i}" for n, a in zip(NAMES, alone, strict=True) for i in a.split[k]]
        assert list(subset) == expected != []
    templates = [f"{n}/{i}" for n, a in zip(NAMES, alone, strict=True) for i in a.bank.ids]
    assert list(joint.bank.ids) == templates
    assert sum(len(subset) for subset in joint.split) == len(joint.prepared) - 6, "held out"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"num_templates": 3}, r"templates\.count=3 must be a multiple of 2"),
        ({"hold_out": 5}, r"templates\.hold_out=5 must be a multiple of 2"),
        ({"hold_out": 2}, r"templates\.hold_out=2 is less than templates\.count=4"),
        ({"categories": ("sofa", "sofa")}, "none twice"),
    ],
)
def test_templates_that_cannot_be_shared_out(data_root, settings, words):
    with pytest.raises(ConfigError, match=words):
        module(data_root, **settings)


def test_each_query_knows_the_templates_of_its_category(joined, members):
    tables, _ = members
    templates = np.array([len(tables), 0, 1, len(tables) + 1])
    rows = np.array([len(tables) + 2, 2, 3])
    indices = TrainingIndices(rows, joined, templates, 3, 5)[0]
    own = dict(zip(indices.rows.tolist(), indices.own_templates.tolist(), strict=True))
    assert own == {len(tables) + 2: [0, 3], 2: [1, 2], 3: [1, 2]}
    bank = TemplateBank.of(joined, [joined.ids[row] for row in templates])
    assert ShapeStore(joined, bank).batch(indices).own_templates.tolist() == [*own.values()]
    assert TrainingIndices(rows % len(tables), tables, np.arange(4), 3, 5)[0].own_templates is None
