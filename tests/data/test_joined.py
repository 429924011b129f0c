import pickle

import numpy as np
import pytest
import torch

from ffd_lightning.app.config import TemplateStrategy
from ffd_lightning.data.batches import ShapeStore
from ffd_lightning.data.datamodule import FfdDataModule
from ffd_lightning.data.preparation.joined import JoinedSet
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import DataError
from ffd_lightning.imaging.render_settings import RenderSettings


def preparation(category, root, points=256):
    render = RenderSettings(height=48, width=64, samples=1)
    return Preparation(
        ProceduralSource(12), category, points, render, root, workers=2, progress=False
    )


@pytest.fixture(scope="module")
def preparations(data_root):
    return [preparation(category, data_root) for category in ("table", "sofa")]


@pytest.fixture(scope="module")
def members(preparations):
    return [p.run() for p in preparations]


@pytest.fixture(scope="module")
def joined(members):
    return JoinedSet.join(members)


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
            ours, theirs = joined.mesh(row), member.mesh(own)
            np.testing.assert_array_equal(ours.faces, theirs.faces)
            assert joined.part_names_of(row) == member.part_names_of(own) == member.part_names
            names = [
                np.array(s.part_names)[p]
                for s, p in ((joined, joined.point_parts(row)), (member, member.point_parts(own)))
            ]
            np.testing.assert_array_equal(*names)
            faces = [np.array(m.part_names)[m.face_parts] for m in (ours, theirs)]
            np.testing.assert_array_equal(*faces)
    with pytest.raises(IndexError):
        joined.cloud(len(joined))
    with pytest.raises(DataError, match="no model"):
        joined.index(tables.ids[0])


def test_another_process_gets_the_same(joined):
    again = pickle.loads(pickle.dumps(joined))
    assert again.ids == joined.ids
    assert again.manifest == joined.manifest
    np.testing.assert_array_equal(again.cloud(20), joined.cloud(20))


def test_sets_that_do_not_go_together(members, data_root):
    other = preparation("sofa", data_root, points=128).run()
    with pytest.raises(DataError, match=r"cannot be joined.*256\).*128\)"):
        JoinedSet.join([members[0], other])


def module(preparations, **settings):
    result = FfdDataModule(
        preparations=preparations,
        num_templates=4,
        template_strategy=TemplateStrategy.diverse,
        train_fraction=0.6,
        batch_size=6,
        num_points=64,
        steps=3,
        **settings,
    )
    result.setup()
    return result


def test_each_category_gives_its_share_of_templates_and_its_own_split(preparations):
    joint = module(preparations, hold_out=6)
    alone = [
        FfdDataModule(
            preparations=[p],
            num_templates=2,
            hold_out=3,
            template_strategy=TemplateStrategy.diverse,
            train_fraction=0.6,
        )
        for p in preparations
    ]
    for own in alone:
        own.setup()
    names = ("table", "sofa")
    for part in ("train", "test"):
        expected = [
            f"{n}/{i}" for n, a in zip(names, alone, strict=True) for i in getattr(a.split, part)
        ]
        assert list(getattr(joint.split, part)) == expected
    templates = [f"{n}/{i}" for n, a in zip(names, alone, strict=True) for i in a.bank.ids]
    assert list(joint.bank.ids) == templates
    assert len(joint.split.train) + len(joint.split.test) == len(joint.prepared) - 6, "held out"


def test_batches_are_gathered_from_all_members(preparations):
    joint = module(preparations)
    batch = next(iter(joint.train_dataloader()))
    for row, points, image in zip(batch.rows, batch.target_points, batch.images, strict=True):
        cloud = {tuple(p) for p in joint.prepared.cloud(int(row)).tolist()}
        assert {tuple(p) for p in points.tolist()} <= cloud
        rgb = joint.prepared.image(int(row))[..., :3]
        np.testing.assert_array_equal(image.permute(1, 2, 0), rgb)
    resident = ShapeStore(joint.prepared, joint.bank, torch.device("cpu"))
    draws = joint.train_dataloader().dataset
    assert torch.equal(resident.batch(draws.draws[1]).target_points, draws[1].target_points)


def test_the_templates_file_may_name_the_category(preparations, tmp_path):
    for p in preparations:
        ids = p.run().ids[3:6]
        (tmp_path / f"{p.category}.txt").write_text("\n".join(ids))
    joint = FfdDataModule(
        preparations=preparations,
        num_templates=2,
        template_strategy=TemplateStrategy.listed,
        template_file=str(tmp_path / "{category}.txt"),
    )
    joint.setup()
    assert joint.bank.ids == tuple(f"{p.category}/{p.run().ids[3]}" for p in preparations)
