import itertools
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from box_source import BoxSource, boxes_of

from ffd_lightning.app.config import Residency, SplitKind, TemplateStrategy
from ffd_lightning.data import batches
from ffd_lightning.data.batches import Draw, ShapeStore
from ffd_lightning.data.datamodule import (
    EvaluationDraws,
    FfdDataModule,
    Gathered,
    StepSampler,
    TrainingDraws,
)
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.render_settings import RenderSettings

BATCH, POINTS, STEPS = 4, 32, 6


def make_module(preparation, **settings):
    module = FfdDataModule(
        preparations=[preparation],
        train_fraction=0.7,
        num_templates=2,
        template_strategy=TemplateStrategy.diverse,
        batch_size=BATCH,
        num_points=POINTS,
        steps=STEPS,
        **settings,
    )
    module.prepare_data()
    module.setup()
    return module


@pytest.fixture(scope="module")
def tables(prepared, data_root):
    """Tables, on the prepared set that is there already."""
    render = RenderSettings(height=48, width=64, samples=1)
    module = make_module(Preparation(ProceduralSource(24), "table", 256, render, data_root))
    assert module.prepared.path == prepared.path
    return module


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    """Boxes seen from two sides."""
    root = tmp_path_factory.mktemp("boxes")
    return make_module(boxes_of(BoxSource(10, root / "log"), root, num_points=64, workers=1))


def training_steps(module, seed=0, rank=0, world_size=1, batch_size=BATCH):
    rows = module.rows(module.split.train)
    draws = TrainingDraws(rows, module._sizes, batch_size, POINTS, seed, rank, world_size)
    return Gathered(draws, module.store)


def tensors(batch):
    return {
        "rows": batch.rows,
        "images": batch.images,
        "target_points": batch.target_points,
        "deformation_matrix": batch.templates.deformation_matrix,
        "control_points": batch.templates.control_points,
    }


def trainer(global_step=0, global_rank=0, world_size=1):
    strategy = SimpleNamespace(root_device=torch.device("cpu"))
    return SimpleNamespace(
        strategy=strategy, global_step=global_step, global_rank=global_rank, world_size=world_size
    )


def equal(a, b):
    pairs = zip(tensors(a).values(), tensors(b).values(), strict=True)
    return all(torch.equal(x, y) for x, y in pairs)


def test_templates_training_and_test_models_are_disjoint_and_complete(tables):
    parts = [tables.bank.ids, tables.split.train, tables.split.test]
    assert sorted(i for part in parts for i in part) == list(tables.prepared.ids)
    assert len(tables.bank.ids) == 2


def test_setup_runs_once(tables):
    before = tables.prepared, tables.bank, tables.split
    tables.setup("fit")
    tables.setup("test")
    assert all(
        a is b for a, b in zip(before, (tables.prepared, tables.bank, tables.split), strict=True)
    )


# --- training steps -----------------------------------------------------------------------------


def test_a_step_holds_what_the_prepared_set_holds(tables):
    batch = training_steps(tables)[3]
    for row, image, points in zip(batch.rows, batch.images, batch.target_points, strict=True):
        rgb = tables.prepared.image(int(row))[..., :3]
        np.testing.assert_array_equal(image.permute(1, 2, 0), rgb)
        cloud = {tuple(p) for p in tables.prepared.cloud(int(row)).tolist()}
        drawn = {tuple(p) for p in points.tolist()}
        assert len(drawn) == POINTS, "without replacement"
        assert drawn <= cloud
    assert batch.images.dtype == torch.uint8
    assert batch.templates.deformation_matrix.shape == (2, POINTS, 64)


def test_a_step_is_a_function_of_seed_and_number(tables):
    one, other = training_steps(tables), training_steps(tables)
    forth = [one[k] for k in range(12)]
    back = [other[k] for k in reversed(range(12))][::-1]
    assert all(equal(a, b) for a, b in zip(forth, back, strict=True))
    assert not any(equal(a, b) for a, b in itertools.pairwise(forth))
    assert not any(equal(a, training_steps(tables, seed=1)[k]) for k, a in enumerate(forth))


def test_points_are_drawn_afresh_at_each_step_and_for_each_query(tables):
    row = tables.rows(tables.split.train)[:1]
    draws = TrainingDraws(row, tables._sizes, BATCH, POINTS, seed=0)
    steps = Gathered(draws, tables.store)
    clouds = torch.cat([steps[k].target_points for k in range(3)])
    assert len({cloud.numpy().tobytes() for cloud in clouds}) == 3 * BATCH
    matrices = [steps[k].templates.deformation_matrix for k in range(3)]
    assert len({matrix.numpy().tobytes() for matrix in matrices}) == 3


def test_every_model_is_seen_once_in_each_pass(tables):
    steps, rows = training_steps(tables), tables.rows(tables.split.train).tolist()
    count = len(rows)
    assert count % BATCH, "passes end in the middle of a step"
    seen = torch.cat([steps[k].rows for k in range(3 * count)]).tolist()
    passes = [seen[i : i + count] for i in range(0, 4 * count, count)]
    assert [sorted(p) for p in passes] == [rows] * 4
    assert len({tuple(p) for p in passes}) == 4, "each in another order"


@pytest.mark.parametrize("world_size", [2, 4])
def test_devices_share_out_what_one_would_see(boxes, world_size):
    for step in range(4):
        whole = training_steps(boxes)[step]
        shares = [training_steps(boxes, 0, rank, world_size)[step] for rank in range(world_size)]
        for rank, share in enumerate(shares):
            for name in ("rows", "images", "target_points"):
                expected = tensors(whole)[name][rank::world_size]
                assert torch.equal(tensors(share)[name], expected), (name, rank)
            assert torch.equal(
                share.templates.deformation_matrix, whole.templates.deformation_matrix
            )


def test_a_batch_that_cannot_be_shared_out(tables):
    with pytest.raises(ConfigError, match=r"schedule\.batch_size=5 .* over 2 devices"):
        training_steps(tables, world_size=2, batch_size=5)


def test_views_vary(boxes):
    steps = training_steps(boxes)
    views = {row: set() for row in boxes.rows(boxes.split.train).tolist()}
    for k in range(40):
        batch = steps[k]
        for row, image in zip(batch.rows.tolist(), batch.images, strict=True):
            sides = [boxes.prepared.image(row, view)[..., :3] for view in (0, 1)]
            matches = [v for v in (0, 1) if np.array_equal(sides[v], image.permute(1, 2, 0))]
            assert len(matches) == 1
            views[row].update(matches)
    assert all(seen == {0, 1} for seen in views.values())


def test_steps_can_be_sent_to_another_process(tables):
    """As loaders must where processes are spawned and not forked."""
    steps = training_steps(tables)
    expected = steps[2]
    assert equal(pickle.loads(pickle.dumps(steps))[2], expected)


# --- evaluation chunks --------------------------------------------------------------------------


def test_chunks_hold_every_test_model_once(tables):
    rows = tables.rows(tables.split.test)
    assert len(rows) > 3
    chunks = EvaluationDraws(rows, tables._sizes, 3, POINTS)
    draws = [chunks[k] for k in range(len(chunks))]
    assert torch.cat([d.rows for d in draws]).tolist() == rows.tolist()
    assert [len(d.rows) for d in draws[:-1]] == [3] * (len(draws) - 1)
    for k in (-1, len(chunks)):
        with pytest.raises(IndexError):
            chunks[k]


def test_chunks_are_the_same_at_every_call_and_show_the_first_view(boxes):
    first, again = list(boxes.evaluation_batches()), list(boxes.evaluation_batches())
    assert len(first) == -(-len(boxes.split.test) // BATCH)
    for batch, same in zip(first, again, strict=True):
        assert equal(batch, same)
        rgb = [boxes.prepared.image(row)[..., :3] for row in batch.rows.tolist()]
        np.testing.assert_array_equal(batch.images.permute(0, 2, 3, 1), rgb)


# --- residency ----------------------------------------------------------------------------------


@pytest.fixture
def resident(boxes):
    """The boxes again, copied into memory."""
    return make_module(boxes.preparations[0], residency=Residency.device)


def test_where_the_data_is_kept_changes_nothing(boxes, resident):
    pairs = zip(boxes.train_dataloader(), resident.train_dataloader(), strict=True)
    assert all(equal(a, b) for a, b in pairs)
    assert resident.store.images.shape[-1] == 3
    assert not np.shares_memory(
        resident.store.clouds[0].numpy(), resident.prepared.arrays["points"]
    )
    assert equal(training_steps(resident)[2], training_steps(boxes)[2])


def test_data_on_a_gpu_is_gathered_there(boxes, resident, monkeypatch):
    """The loader then hands out draws alone."""
    monkeypatch.setattr(ShapeStore, "device", torch.device("cuda"))
    draws = list(resident.train_dataloader())
    monkeypatch.undo()
    assert {type(draw) for draw in draws} == {Draw}
    gathered = [resident.on_after_batch_transfer(draw, 0) for draw in draws]
    expected = list(boxes.train_dataloader())
    assert all(equal(a, b) for a, b in zip(gathered, expected, strict=True))
    assert resident.on_after_batch_transfer(expected[0], 0) is expected[0]


def test_another_process_maps_the_files_itself(resident):
    store = pickle.loads(pickle.dumps(resident.store))
    assert np.shares_memory(store.clouds[0].numpy(), store._prepared.arrays["points"])


def test_files_are_mapped_and_not_copied(boxes):
    assert boxes.residency is Residency.auto
    assert boxes.store.images is None
    assert np.shares_memory(boxes.store.clouds[0].numpy(), boxes.prepared.arrays["points"])


def test_copying_in_blocks(boxes, monkeypatch):
    monkeypatch.setattr(batches, "_BLOCK", 3)
    store = ShapeStore(boxes.prepared, boxes.bank, torch.device("cpu"))
    np.testing.assert_array_equal(store.clouds[0], boxes.prepared.arrays["points"])
    for row, images in enumerate(store.images):
        for view, image in enumerate(images):
            np.testing.assert_array_equal(image, boxes.prepared.image(row, view)[..., :3])


def test_too_little_memory_is_said(boxes, monkeypatch):
    def full(*_, **__):
        raise torch.OutOfMemoryError("CUDA out of memory")

    cpu = torch.device("cpu")
    with monkeypatch.context() as patch:
        patch.setattr(batches.torch, "empty", full)
        with pytest.raises(
            DataError, match=r"GB, more than cpu has left: use data\.residency=disk"
        ):
            ShapeStore(boxes.prepared, boxes.bank, cpu)
    assert 2**20 < batches._available_memory() < 2**50
    monkeypatch.setattr(batches, "_available_memory", lambda: 1000)
    with pytest.raises(DataError, match="more than cpu has left"):
        ShapeStore(boxes.prepared, boxes.bank, cpu)


def test_automatic_residency(monkeypatch):
    gpu = torch.device("cuda", 0)
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda _: (100, 1000))
    monkeypatch.setattr(batches, "_available_memory", lambda: 1000)
    assert batches.choose_residency(1, torch.device("cpu")) is Residency.disk
    assert batches.choose_residency(50, gpu) is Residency.device
    assert batches.choose_residency(51, gpu) is Residency.ram
    assert batches.choose_residency(501, gpu) is Residency.disk


# --- loaders ------------------------------------------------------------------------------------


def test_sampler_counts_from_the_start_and_goes_on_in_the_middle():
    assert list(StepSampler(0, 3)) == [0, 1, 2]
    assert list(StepSampler(2, 5)) == [2, 3, 4]
    assert list(StepSampler(5, 5)) == []
    assert len(StepSampler(2, 5)) == 5


def test_a_resumed_loader_goes_on_where_the_run_stopped(tables):
    whole = list(tables.train_dataloader())
    assert len(whole) == STEPS
    tables.trainer = trainer(global_step=2)
    try:
        resumed = list(tables.train_dataloader())
    finally:
        tables.trainer = None
    assert len(resumed) == STEPS - 2
    assert all(equal(a, b) for a, b in zip(resumed, whole[2:], strict=True))


def test_each_device_loads_its_own_share(tables):
    whole = next(iter(tables.train_dataloader()))
    tables.trainer = trainer(global_rank=1, world_size=2)
    try:
        share = next(iter(tables.train_dataloader()))
    finally:
        tables.trainer = None
    assert share.rows.tolist() == whole.rows.tolist()[1::2]


def test_reading_ahead_changes_nothing(tables):
    whole = list(tables.train_dataloader())
    tables.num_workers = 1
    try:
        ahead = list(tables.train_dataloader())
    finally:
        tables.num_workers = 0
    assert all(equal(a, b) for a, b in zip(ahead, whole, strict=True))
    validation = list(tables.val_dataloader())
    assert (
        torch.cat([b.rows for b in validation]).tolist() == tables.rows(tables.split.test).tolist()
    )


def test_each_template_has_its_own_points(tables):
    for count in (40, 256):
        draws = TrainingDraws(tables.rows(tables.split.train), tables._sizes, BATCH, count, seed=0)
        draw = draws[0]
        batch = tables.store.batch(draw)
        drawn = [set(points) for points in draw.template_points.tolist()]
        assert [len(points) for points in drawn] == [count] * 2, "without replacement"
        assert (drawn[0] == drawn[1]) == (count == 256)
        for t, points in enumerate(draw.template_points):
            matrix = tables.bank.deformation_matrix[t, points]
            assert torch.equal(batch.templates.deformation_matrix[t], matrix)


# --- splits -------------------------------------------------------------------------------------


def test_each_rule_splits(boxes, tmp_path):
    rest = [i for i in boxes.prepared.ids if i not in boxes.bank.ids]
    (tmp_path / "test.txt").write_text("\n".join(rest[:3]))
    listed = make_module(
        boxes.preparations[0], split=SplitKind.listed, split_file=str(tmp_path / "test.txt")
    )
    assert listed.split == (tuple(rest[3:]), tuple(rest[:3]))
    r2n2 = make_module(boxes.preparations[0], split=SplitKind.r2n2).split
    assert r2n2 == tuple(tuple(i for i in rest if (i < "b08") == side) for side in (True, False))
    with pytest.raises(ConfigError, match="no split of its own"):
        make_module(boxes.preparations[0], split=SplitKind.source)
