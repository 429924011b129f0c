import itertools
import pickle
from contextlib import contextmanager, nullcontext
from types import SimpleNamespace
from unittest.mock import NonCallableMock

import numpy as np
import pytest
import torch
from box_source import RENDER, BoxSource, box_module, boxes_of
from lightning import Callback, Trainer
from lightning.pytorch.callbacks import LambdaCallback, ModelCheckpoint
from torch.optim.lr_scheduler import CosineAnnealingLR

from ffd_lightning.components import Component
from ffd_lightning.data.batches import BatchIndices, ShapeStore
from ffd_lightning.data.datamodule import EvaluationIndices, FfdDataModule, TrainingIndices
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.data.splits import HashSplit
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.losses.terms import Chamfer
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.training.module import FfdModule

BATCH, POINTS, STEPS = 4, 32, 6


SETTINGS = {
    "num_templates": 2,
    "split": HashSplit(0.7),
    "val_fraction": 0.2,
    "batch_size": BATCH,
    "num_points": POINTS,
}


def table_module(root, **settings):
    """Tables, on the prepared set that is there already."""
    render = RenderSettings(height=48, width=64, samples=1)
    made_by = Preparation(ProceduralSource(24), "table", 256, render, root, progress=False)
    module = FfdDataModule(made_by, **(SETTINGS | settings))
    module.setup()
    return module


@pytest.fixture(scope="module")
def tables(prepared, data_root):
    module = table_module(data_root)
    assert module.prepared.path == prepared.path
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


class Steps:
    """The batches of a training, by number."""

    def __init__(self, module, seed=0):
        self.store, ids = module.store, module.split.train
        self.indices = drawn_from(TrainingIndices, module, ids, seed=seed)

    def __getitem__(self, step):
        return self.store.batch(self.indices[step])


def tensors(batch):
    cameras = {} if batch.cameras is None else {"cameras": batch.cameras}
    return cameras | {
        "rows": batch.rows,
        "images": batch.images,
        "target_points": batch.target_points,
        "deformation_matrix": batch.templates.deformation_matrix,
        "control_points": batch.templates.control_points,
    }


@contextmanager
def trained(module, device="cpu", **settings):
    """Give a module a trainer of so many steps."""
    given = {
        "fit_loop": Trainer(accelerator="cpu", logger=False).fit_loop,
        "lightning_module": SimpleNamespace(automatic_optimization=True),
        "global_rank": 0,
        "world_size": 1,
        "max_steps": STEPS,
        "num_training_batches": STEPS,
        "max_epochs": -1,
        "accumulate_grad_batches": 1,
        **settings,
    }
    strategy = SimpleNamespace(root_device=torch.device(device))
    module.trainer = NonCallableMock(Trainer, strategy=strategy, **given)
    try:
        yield
    finally:
        module.trainer = None


def equal(a, b):
    pairs = zip(tensors(a).values(), tensors(b).values(), strict=True)
    return all(torch.equal(x, y) for x, y in pairs)


def seen(module, batches):
    return [module.on_after_batch_transfer(batch, 0) for batch in batches]


def test_a_step_holds_what_the_prepared_set_holds_from_views_that_vary(boxes):
    steps, views = Steps(boxes), set()
    for k in range(40):
        batch, drawn_views = steps[k], steps.indices[k].views.tolist()
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
    rows, indices = boxes.rows(boxes.split.train).tolist(), Steps(boxes).indices
    assert len(rows) % BATCH, "passes begin within batches"
    passes = torch.cat([indices[k].rows for k in range(len(rows))]).reshape(BATCH, -1).tolist()
    assert [sorted(p) for p in passes] == [rows] * BATCH
    assert len({tuple(p) for p in passes}) > 1, "in other orders"


# --- evaluation chunks --------------------------------------------------------------------------


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
def test_devices_share_out_what_is_scored(tables, subset):
    whole = scored(tables, subset)
    shares = [scored(tables, subset, global_rank=k, world_size=2) for k in range(2)]
    assert not shares[0].keys() & shares[1].keys()
    assert whole.keys() == shares[0].keys() | shares[1].keys()
    assert all(torch.equal(whole[row], own[row]) for own in shares for row in own)


def scored(module, subset, **settings):
    """Return the points of each row that is scored."""
    with trained(module, **settings):
        found = list(getattr(module, f"{subset}_dataloader")())
    return {
        row: points
        for batch in found
        for row, points in zip(batch.rows.tolist(), batch.target_points, strict=True)
    }


# --- augmentation -------------------------------------------------------------------------------


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
    steps = [Steps(dark_boxes)[k] for k in range(6)]
    torch.manual_seed(0)
    forth = seen(dark_boxes, steps)
    before = torch.get_rng_state()
    back = seen(dark_boxes, reversed(steps))[::-1]
    assert all(equal(a, b) for a, b in zip(forth, back, strict=True))
    assert torch.equal(torch.get_rng_state(), before), "nothing is drawn from others' numbers"
    seeds = [Steps(dark_boxes, seed)[step].seed for seed in (0, 1) for step in range(6)]
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


def test_an_epoch_is_the_training_or_a_pass(tables):
    batches_of_a_pass = -(-len(tables.split.train) // BATCH)
    assert batches_of_a_pass != STEPS
    for settings, length in (
        ({}, STEPS),
        ({"accumulate_grad_batches": 3}, 3 * STEPS),
        ({"max_steps": -1, "max_epochs": 4}, batches_of_a_pass),
        ({"max_epochs": 4}, batches_of_a_pass),
    ):
        with trained(tables, **settings):
            assert len(list(tables.train_dataloader())) == length


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


# --- whole trainings ----------------------------------------------------------------------------


class Watch(Callback):
    """Notes what each batch sees, and fails at one of them."""

    def __init__(self, fails_at=None):
        self.fails_at, self.rows = fails_at, []

    def on_train_batch_start(self, trainer, module, batch, batch_idx):
        if len(self.rows) == self.fails_at:
            raise RuntimeError("the machine goes down")
        self.rows.append(tuple(batch.rows.tolist()))


def fit(data, folder, fails_at=None, resume=None, more=(), **settings):
    """Train a tiny network; return the rows of its batches, and its last weights."""
    torch.manual_seed(0)
    encoder = MobileNetV1()
    told = None if data.draw is None else Component("heads", "conditioned", {"draw": data.draw})
    network = TemplateFfdNetwork(encoder, (48, 64), 2, 64, bottleneck=4, hidden=8, heads=told)
    objective = Objective({"chamfer": WeightedTerm(Chamfer())})
    module = FfdModule(network, objective, scheduler=CosineAnnealingLR)
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
    "limits",
    [
        {"max_steps": 7},
        {"max_steps": 7, "draw": 3},
        {"max_epochs": 3, "accumulate_grad_batches": 2},
        {"max_steps": 5, "limit_train_batches": 3, "accumulate_grad_batches": 2},
    ],
)
def test_a_resumed_training_equals_an_uninterrupted_one(data_root, tmp_path, limits):
    settings = {"augmentation": darkened, "draw": limits.get("draw")}
    limits = {name: value for name, value in limits.items() if name != "draw"}
    data = table_module(data_root, **settings)
    length = -(-len(data.split.train) // BATCH)
    assert length == 3, "an odd number, so that accumulation ends epochs early"
    indices = data.train_dataloader().loader.dataset
    every = limits.get("accumulate_grad_batches", 1)
    rows, weights = fit(data, tmp_path / "whole", **limits)
    assert rows == [tuple(indices[k].rows.tolist()) for k in range(len(rows))]
    for fails_at in {every, length, length + every}:
        folder = tmp_path / f"killed{fails_at}"
        before, _ = fit(data, folder, fails_at, **limits)
        newest = max(folder.iterdir(), key=lambda path: int(path.stem.rpartition("=")[2]))
        # Processes that read ahead start early.
        ahead = table_module(data_root, **settings, num_workers=fails_at % 2)
        after, ends = fit(ahead, folder, resume=newest, **limits)
        again = len(before) + len(after) - len(rows)
        assert 0 <= again < every, "of an accumulated step that was not done"
        assert before[: fails_at - again] + after == rows, fails_at
        assert all(torch.equal(ends[name], weights[name]) for name in weights), fails_at


@pytest.mark.filterwarnings("ignore")
def test_a_checkpoint_in_the_middle_of_a_step_is_refused(data_root, tmp_path):
    data, path = table_module(data_root), tmp_path / "middle.ckpt"
    limits = {"max_steps": 2, "accumulate_grad_batches": 2}

    def save(trainer, module, outputs, batch, batch_idx):
        if batch_idx + 1 == 3:
            trainer.save_checkpoint(path)

    fit(data, tmp_path, more=[LambdaCallback(on_train_batch_end=save)], **limits)
    with pytest.raises(ConfigError, match="after 3 batches of the epoch, of which 2 make a step"):
        fit(data, tmp_path, resume=path, **limits)
