import itertools
import pickle
from contextlib import nullcontext
from types import SimpleNamespace
from unittest.mock import NonCallableMock

import numpy as np
import pytest
import torch
from box_source import RENDER, BoxSource, box_module, boxes_of
from lightning import Callback, Trainer
from lightning.pytorch.callbacks import LambdaCallback, ModelCheckpoint
from torch.utils._pytree import tree_leaves

from ffd_lightning.app.build import build_data, build_module, build_network
from ffd_lightning.data.batches import BatchIndices, ShapeStore
from ffd_lightning.data.datamodule import EvaluationIndices, TrainingIndices
from ffd_lightning.data.splits import HashSplit
from ffd_lightning.errors import ConfigError, DataError

BATCH, POINTS, STEPS = 4, 32, 6


SETTINGS = {
    "num_templates": 2,
    "split": HashSplit(0.7),
    "val_fraction": 0.2,
    "batch_size": BATCH,
    "num_points": POINTS,
}


@pytest.fixture(scope="module")
def table_config(prepared, tiny_config):
    """Return a function from overrides to a configuration of tables."""
    split = ("split.train_fraction=0.7", "split.val_fraction=0.2")
    return lambda *overrides: tiny_config(*split, *overrides)


@pytest.fixture(scope="module")
def tables(table_config):
    module = build_data(table_config())
    module.setup()
    return module


@pytest.fixture(scope="module")
def make_boxes(tmp_path_factory):
    """Return a function that makes modules of boxes seen from two sides."""
    root = tmp_path_factory.mktemp("boxes")
    made_by = boxes_of(BoxSource(10, root / "log"), root, workers=1, num_points=64)
    return lambda **settings: box_module(made_by, **(SETTINGS | settings))


@pytest.fixture(scope="module")
def boxes(make_boxes):
    return make_boxes()


def drawn_from(kind, module, ids, batch_size=BATCH, seed=0):
    rows = module.rows(ids)
    templates = module.rows(module.bank.ids)
    return kind(rows, module.prepared, templates, batch_size, POINTS, seed)


def steps_of(module, seed=0):
    """Return the indices of a training's batches, by number."""
    return drawn_from(TrainingIndices, module, module.split.train, seed=seed)


def trainer(rank=0, devices=1, **settings):
    """Return what a data module asks of a trainer of so many steps."""
    strategy = SimpleNamespace(root_device=torch.device("cpu"))
    share = {"strategy": strategy, "global_rank": rank, "world_size": devices}
    usual = {"max_steps": STEPS, "max_epochs": -1, "accumulate_grad_batches": 1}
    return NonCallableMock(Trainer, **share, **usual | settings)


def equal(a, b):
    """Return whether batches show the same, whether or not masks are kept of it."""
    leaves = (tree_leaves(batch._replace(mask=None, seed=None)) for batch in (a, b))
    pairs = zip(*leaves, strict=True)
    return all(torch.equal(x, y) if isinstance(x, torch.Tensor) else x == y for x, y in pairs)


def seen(module, batches):
    return [module.on_after_batch_transfer(batch, 0) for batch in batches]


def test_a_step_holds_what_the_prepared_set_holds_from_views_that_vary(boxes):
    steps, views = steps_of(boxes), set()
    for k in range(40):
        batch, drawn_views = boxes.store.batch(steps[k]), steps[k].views.tolist()
        for row, view, image, points in zip(
            batch.rows.tolist(), drawn_views, batch.images, batch.target_points, strict=True
        ):
            views.add((row, view))
            rgb = boxes.prepared.image(row, view)[..., :3]
            np.testing.assert_array_equal(image.permute(1, 2, 0), rgb)
            drawn = {tuple(p) for p in points.tolist()}
            assert len(drawn) == POINTS, "without replacement"
            assert drawn <= {tuple(p) for p in boxes.prepared.cloud(row).tolist()}
        sides = [(azimuth, 30) for azimuth in (RENDER.azimuths[view] for view in drawn_views)]
        assert list(map(tuple, batch.cameras.tolist())) == sides
    assert views == set(itertools.product(boxes.rows(boxes.split.train).tolist(), (0, 1)))


def test_every_shape_is_seen_once_in_each_pass(boxes):
    rows, indices = boxes.rows(boxes.split.train).tolist(), steps_of(boxes)
    assert len(rows) % BATCH, "passes begin within batches"
    passes = torch.cat([indices[k].rows for k in range(len(rows))]).reshape(BATCH, -1).tolist()
    assert [sorted(p) for p in passes] == [rows] * BATCH
    assert len({tuple(p) for p in passes}) > 1, "in other orders"


def test_points_depend_on_the_shape_alone(tables):
    """Not on how shapes are cut into chunks, nor on which others are scored."""
    ids = tables.split.test
    whole = drawn_from(EvaluationIndices, tables, ids, len(ids))[0]
    drawn = dict(zip(whole.rows.tolist(), whole.points, strict=True))
    assert len({points.numpy().tobytes() for points in whole.points}) == len(ids)
    for some, size in ((ids, 2), (ids[1::2], 2), (ids[::-1], 3)):
        chunks = drawn_from(EvaluationIndices, tables, some, size)
        for chunk in (chunks[k] for k in range(len(chunks))):
            for row, points in zip(chunk.rows.tolist(), chunk.points, strict=True):
                assert torch.equal(points, drawn[row])
            assert torch.equal(chunk.template_points, whole.template_points)
    other = drawn_from(EvaluationIndices, tables, ids, len(ids), seed=1)[0]
    assert not torch.equal(other.points, whole.points)


@pytest.mark.parametrize("subset", ["val", "test"])
def test_subsets_show_the_first_view_as_it_is(boxes, dark_boxes, subset):
    first, again = (list(getattr(m, f"{subset}_dataloader")()) for m in (boxes, dark_boxes))
    ids = getattr(boxes.split, subset)
    assert torch.cat([batch.rows for batch in first]).tolist() == boxes.rows(ids).tolist()
    for batch, same in zip(first, seen(dark_boxes, again), strict=True):
        assert equal(batch, same), "whatever training images are"
        rgb = [boxes.prepared.image(row)[..., :3] for row in batch.rows.tolist()]
        np.testing.assert_array_equal(batch.images.permute(0, 2, 3, 1), rgb)


@pytest.mark.parametrize("subset", ["val", "test"])
def test_devices_share_out_what_is_scored(tables, monkeypatch, subset):
    def scored(*share):
        monkeypatch.setattr(tables, "trainer", trainer(*share))
        found = list(getattr(tables, f"{subset}_dataloader")())
        rows = torch.cat([batch.rows for batch in found]).tolist()
        return dict(zip(rows, torch.cat([batch.target_points for batch in found]), strict=True))

    whole, *shares = scored(), scored(0, 2), scored(1, 2)
    assert not shares[0].keys() & shares[1].keys()
    assert whole.keys() == shares[0].keys() | shares[1].keys()
    assert all(torch.equal(whole[row], own[row]) for own in shares for row in own)


def darkened(images):
    """Return images with an amount of black drawn for each, and half the mask."""
    shares = torch.rand(len(images), 1, 1, 1)
    return torch.cat([images[:, :3] * shares, images[:, 3:] // 2], dim=1).to(torch.uint8)


@pytest.fixture(scope="module")
def dark_boxes(make_boxes):
    """The boxes again, darkened while training."""
    return make_boxes(augmentation=darkened)


def test_training_images_are_changed_with_their_masks(boxes, dark_boxes):
    plain, loaded_ = list(boxes.train_dataloader()), list(dark_boxes.train_dataloader())
    assert all(equal(a, b) for a, b in zip(plain, loaded_, strict=True)), "as they are loaded"
    changed = seen(dark_boxes, loaded_)
    for before, after in zip(plain, changed, strict=True):
        shares = after.images.float().amax((1, 2, 3)) / before.images.float().amax((1, 2, 3))
        assert 0 < shares.min() < shares.max() < 1
        expected = before.images * shares[:, None, None, None]
        torch.testing.assert_close(after.images.float(), expected, rtol=0, atol=2)
        rows = itertools.product(after.rows.tolist(), (0, 1))
        own = {(boxes.prepared.image(*view)[..., 3] // 2).tobytes() for view in rows}
        assert {mask.numpy().tobytes() for mask in after.mask.contiguous()} <= own
        same = before._replace(images=after.images, mask=after.mask, seed=after.seed)
        assert equal(same, after), "nothing else changes"


def test_what_is_drawn_of_images_follows_from_seed_and_step(dark_boxes):
    before = torch.get_rng_state()
    seen(dark_boxes, [steps_of(dark_boxes)[0]])
    assert torch.equal(torch.get_rng_state(), before), "nothing is drawn from others' numbers"
    seeds = [steps_of(dark_boxes, seed)[step].seed for seed in (0, 1) for step in range(6)]
    assert len(set(seeds)) == 2 * 6


def test_where_the_data_is_kept_changes_no_batch(make_boxes, dark_boxes, monkeypatch):
    assert dark_boxes.store.images is None, "on the CPU it stays in files"
    kept = make_boxes(augmentation=darkened, residency="device")
    assert kept.store.images.shape[-1] == 4
    assert pickle.loads(pickle.dumps(kept.store)).images is None, "other processes read files"
    there = seen(kept, kept.train_dataloader())
    files = seen(dark_boxes, dark_boxes.train_dataloader())
    assert all(equal(a, b) for a, b in zip(there, files, strict=True))
    monkeypatch.setattr(ShapeStore, "device", torch.device("cuda"))
    indices = list(kept.train_dataloader())
    monkeypatch.undo()
    assert {type(i) for i in indices} == {BatchIndices}, "gathered where the data is"
    assert all(equal(a, b) for a, b in zip(seen(kept, indices), files, strict=True))


def test_an_epoch_is_the_training_or_a_pass(tables, monkeypatch):
    batches_of_a_pass = -(-len(tables.split.train) // BATCH)
    assert batches_of_a_pass != STEPS
    for settings, length in (
        ({}, STEPS),
        ({"accumulate_grad_batches": 3}, 3 * STEPS),
        ({"max_steps": -1, "max_epochs": 4}, batches_of_a_pass),
        ({"max_epochs": 4}, batches_of_a_pass),
    ):
        monkeypatch.setattr(tables, "trainer", trainer(**settings))
        assert len(tables.train_dataloader()) == length


@pytest.mark.parametrize("hold_out", [None, 4])
def test_templates_are_chosen_from_what_is_not_tested_on(make_boxes, hold_out):
    seen = []

    def first(prepared, count):
        seen.append(prepared.ids)
        return prepared.ids[:count]

    rule = {f"b{k:02d}": "train" if k > 3 else "test" for k in range(9)}  # nothing is said of b09
    module = make_boxes(split=lambda _: rule, template_strategy=first, hold_out=hold_out)
    assert seen == [tuple(f"b{k:02d}" for k in range(4, 10))]
    assert module.bank.ids == ("b04", "b05")
    assert module.split.test == ("b00", "b01", "b02", "b03")
    left = {f"b{k:02d}" for k in range(4 + (hold_out or 2), 9)}
    assert set(module.split.train + module.split.val) == left
    with pytest.raises(DataError, match=r"holds only 6 shapes to choose from, and 4 that are"):
        make_boxes(split=lambda _: rule, hold_out=7)


class Watch(Callback):
    """Notes what each batch sees, and fails at one of them."""

    def __init__(self, fails_at=None):
        self.fails_at, self.rows = fails_at, []

    def on_train_batch_start(self, trainer, module, batch, batch_idx):
        if len(self.rows) == self.fails_at:
            raise RuntimeError("the machine goes down")
        self.rows.append(tuple(batch.rows.tolist()))


def fit(cfg, folder, fails_at=None, resume=None, more=(), **settings):
    """Train a tiny network; return the rows of its batches, and its last weights."""
    torch.manual_seed(0)
    data, network = build_data(cfg), build_network(cfg)
    data.augmentation = darkened
    module = build_module(cfg, network, {})
    watch = Watch(fails_at)
    quiet = {"logger": False, "enable_progress_bar": False, "enable_model_summary": False}
    keep = ModelCheckpoint(folder, every_n_train_steps=1, save_top_k=-1)
    callbacks = [watch, *more, keep]
    trainer = Trainer(accelerator="cpu", callbacks=callbacks, **quiet, **settings)
    failure = nullcontext() if fails_at is None else pytest.raises(RuntimeError, match="goes down")
    with failure:
        trainer.fit(module, datamodule=data, ckpt_path=resume)
    return watch.rows, {name: value.clone() for name, value in module.state_dict().items()}


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("overrides", "limits"),
    [
        ((), {"max_steps": 7}),
        (("heads=conditioned", "heads.draw=3"), {"max_steps": 7}),
        ((), {"max_epochs": 3, "accumulate_grad_batches": 2}),
        ((), {"max_steps": 5, "limit_train_batches": 3, "accumulate_grad_batches": 2}),
    ],
)
def test_a_resumed_training_equals_an_uninterrupted_one(table_config, tmp_path, overrides, limits):
    cfg = table_config(*overrides)
    data = build_data(cfg)
    data.setup()
    length = -(-len(data.split.train) // BATCH)
    assert length == 3, "an odd number, so that accumulation ends epochs early"
    indices = data.train_dataloader().loader.dataset
    every = limits.get("accumulate_grad_batches", 1)
    rows, weights = fit(cfg, tmp_path / "whole", **limits)
    assert rows == [tuple(indices[k].rows.tolist()) for k in range(len(rows))]
    for fails_at in {every, length, length + every}:
        folder = tmp_path / f"killed{fails_at}"
        before, _ = fit(cfg, folder, fails_at, **limits)
        newest = max(folder.iterdir(), key=lambda path: int(path.stem.rpartition("=")[2]))
        # Processes that read ahead start early.
        ahead = table_config(*overrides, f"trainer.num_workers={fails_at % 2}")
        after, ends = fit(ahead, folder, resume=newest, **limits)
        again = len(before) + len(after) - len(rows)
        assert 0 <= again < every, "of an accumulated step that was not done"
        assert before[: fails_at - again] + after == rows, fails_at
        assert all(torch.equal(ends[name], weights[name]) for name in weights), fails_at


@pytest.mark.filterwarnings("ignore")
def test_a_checkpoint_in_the_middle_of_a_step_is_refused(table_config, tmp_path):
    cfg, path = table_config(), tmp_path / "middle.ckpt"
    limits = {"max_steps": 2, "accumulate_grad_batches": 2}

    def save(trainer, module, outputs, batch, batch_idx):
        if batch_idx + 1 == 3:
            trainer.save_checkpoint(path)

    fit(cfg, tmp_path, more=[LambdaCallback(on_train_batch_end=save)], **limits)
    with pytest.raises(ConfigError, match="after 3 batches of the epoch, of which 2 make a step"):
        fit(cfg, tmp_path, resume=path, **limits)
