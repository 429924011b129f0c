import math

import numpy as np
import pytest
import torch
from lightning import Callback, Trainer
from lightning.pytorch.callbacks import ModelCheckpoint
from lightning.pytorch.utilities import rank_zero_only
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.util import tensor_util
from torch import nn

from ffd_lightning.app.build import build_data, build_module, build_network
from ffd_lightning.nn.network import FfdPrediction
from ffd_lightning.training import callbacks
from ffd_lightning.training.callbacks import (
    Clock,
    Reconstructions,
    TemplateSelection,
    example_rows,
)
from ffd_lightning.training.pictures import CLOUD_LEGEND
from ffd_lightning.training.tensorboard import StepLogger

CLOUDS = f"table e t2: {CLOUD_LEGEND}/clouds"
STEPS, EXAMPLES, SHOWN, TIMES = 8, 3, 2, 2
SETTINGS = (
    "regime=e",
    "schedule.annealing_steps=10",
    "schedule.learning_rate=1e-3",
    "lr_schedule=cosine",
    "split.val_fraction=0.3",
)


class Session:
    """A small training of its own: 8 steps of 4 queries, a validation every 2."""

    def __init__(self, config, folder, *, steps=STEPS, logger=True, purge=None, more=()):
        torch.manual_seed(0)
        self.data = build_data(config)
        self.data.prepare_data()
        self.data.setup()
        network = build_network(config)
        # One template by far: what so few steps make of it, or another order of adding up, must
        # not change that.
        with torch.no_grad():
            network.heads.logits.bias[0] = 0.8
        self.module = build_module(config, network, {})
        drawn = Reconstructions(EXAMPLES, SHOWN, TIMES, "table/e/t2")
        chosen = [*more, Clock(1), TemplateSelection(), drawn]
        self.folder = folder / "tensorboard"
        self.trainer = Trainer(
            accelerator="cpu",
            max_steps=steps,
            max_epochs=-1,
            val_check_interval=2,
            num_sanity_val_steps=0,
            log_every_n_steps=1,
            logger=logger and StepLogger(folder, "", "tensorboard", purge_step=purge),
            callbacks=chosen,
            enable_checkpointing=any(isinstance(c, ModelCheckpoint) for c in chosen),
            enable_progress_bar=False,
            enable_model_summary=False,
            default_root_dir=folder,
        )

    def fit(self, checkpoint=None):
        self.trainer.fit(self.module, datamodule=self.data, ckpt_path=checkpoint)
        return self

    @property
    def events(self):
        return read(self.folder)

    @property
    def prediction(self):
        """What the network says about all validation shapes, by row of the prepared set."""
        rows = self.data.rows(self.data.split.val).tolist()
        images = np.stack([self.data.prepared.image(r)[..., :3] for r in rows])
        with torch.no_grad():
            found = self.module.network.eval()(torch.from_numpy(images).permute(0, 3, 1, 2))
        return {
            row: (weights.numpy(), offsets.numpy())
            for row, weights, offsets in zip(rows, found[1], found[2], strict=True)
        }


def read(folder):
    events = EventAccumulator(str(folder), dict.fromkeys(("histograms", "images", "tensors"), 0))
    return events.Reload()


class Frozen(Callback):
    """Holds part of the network in evaluation mode, and looks before every step whether it is."""

    steps = 0

    def on_train_batch_start(self, trainer, pl_module, *_):
        if trainer.global_step:
            assert not pl_module.network.encoder.training
            assert pl_module.network.heads.training
        pl_module.network.encoder.eval()
        self.steps += 1


@pytest.fixture(scope="module")
def frozen():
    return Frozen()


@pytest.fixture(scope="module")
def logged(frozen, tiny_config, tmp_path_factory):
    folder = tmp_path_factory.mktemp("logged")
    return Session(tiny_config(*SETTINGS), folder, more=(frozen,)).fit()


def test_curves_count_steps_from_one_and_leave_the_epoch_out(logged):
    events = logged.events
    minimised, watched = ("weighted_chamfer", "negative_entropy"), ("offset_penalty",)
    every = {f"train/{name}" for name in (*minimised, *watched, "loss", "box_chamfer")}
    every |= {f"weighted_terms/{name}" for name in minimised} | {"work/learning_rate"}
    for tag in every:
        assert [s.step for s in events.Scalars(tag)] == list(range(1, STEPS + 1)), tag
    shown = ("box_chamfer", "undeformed_box_chamfer", "entropy", "effective_templates")
    judged = {f"val/{name}" for name in shown}
    for tag in judged:
        assert [s.step for s in events.Scalars(tag)] == [2, 4, 6, 8]
    speed = {"work/steps_per_second", "work/queries_per_second"}
    assert set(events.Tags()["scalars"]) == every | judged | speed


def test_weighted_terms_add_up_to_the_loss(logged):
    events = logged.events
    parts = [
        [point.value for point in events.Scalars(f"weighted_terms/{name}")]
        for name in ("weighted_chamfer", "negative_entropy")
    ]
    losses = [point.value for point in events.Scalars("train/loss")]
    assert np.sum(parts, axis=0) == pytest.approx(losses, rel=1e-4)


def test_box_chamfer_is_what_the_validation_scores_say_times_1000(logged):
    scores = logged.module.scores
    mean = scores.deformed[np.arange(len(scores.rows)), scores.weights.argmax(1)].mean()
    assert logged.events.Scalars("val/box_chamfer")[-1].value == pytest.approx(1000 * mean)


def test_learning_rate_and_weights_are_those_of_the_step(logged):
    events = logged.events
    for point in events.Scalars("work/learning_rate"):
        cosine = 1e-3 * (1 + math.cos(math.pi * (point.step - 1) / STEPS)) / 2
        assert point.value == pytest.approx(cosine, rel=1e-5)
    shown, terms = (events.Scalars(f"{x}/negative_entropy") for x in ("weighted_terms", "train"))
    for weighted, term in zip(shown, terms, strict=True):
        weight = 100 * math.exp(-(term.step - 1) / 10)
        assert weighted.value == pytest.approx(weight * term.value, rel=1e-5)


def test_bars_and_histograms_are_drawn_at_every_validation(logged):
    events, step, scores = logged.events, [2, 4, 6, 8], logged.module.scores
    assert [i.step for i in events.Images("which_template/bars")] == step
    assert [i.step for i in events.Images("which_template/all")] == step[:1]
    for tag in ("selected", "weight_of_selected"):
        assert [h.step for h in events.Histograms(f"which_template/{tag}")] == step
    last = events.Histograms("which_template/selected")[-1].histogram_value
    assert last.bucket_limit == [1.5, 2.5]
    assert last.bucket == pytest.approx(100 * scores.counts / len(scores.rows))


def test_examples_are_drawn_as_often_as_asked(logged):
    events = logged.events
    assert [i.step for i in events.Images("worked_examples/reconstructions")] == [4]
    for part in ("VERTEX", "COLOR"):
        assert [t.step for t in events.Tensors(f"{CLOUDS}_{part}")] == [4, 8]


def deformed_by_hand(bank, t, offsets):
    moved = bank.control_points[t].numpy().astype(float) + np.asarray(offsets)
    return bank.deformation_matrix[t].numpy().astype(float) @ moved


def test_clouds_are_the_deformed_points_beside_the_truth(logged):
    prepared, size = logged.data.prepared, logged.data.prepared.num_points
    stored, colors = (
        tensor_util.make_ndarray(logged.events.Tensors(f"{CLOUDS}_{part}")[-1].tensor_proto)
        for part in ("VERTEX", "COLOR")
    )
    assert stored.shape == colors.shape == (1, SHOWN * 2 * size, 3)
    parts = np.split(stored[0], SHOWN * 2)
    for k, row in enumerate(example_rows(logged.data, EXAMPLES)[:SHOWN]):
        weights, offsets = logged.prediction[row]
        t = int(weights.argmax())
        assert weights[t] > 0.6, "rounding selects no other"
        deformed, truth = parts[2 * k : 2 * k + 2]
        lower = deformed - deformed_by_hand(logged.data.bank, t, offsets[t])
        aside = truth - prepared.cloud(row)
        for moved in (lower, aside):
            assert moved == pytest.approx(np.tile(moved[0], (size, 1)), abs=1e-5)
        assert lower[0] == pytest.approx([0, lower[0, 1], 0], abs=1e-5)
        assert (lower[0, 1] < -0.1) == (k > 0)
        assert aside[0] == pytest.approx([aside[0, 0], lower[0, 1], 0], abs=1e-5)
        assert truth[:, 0].min() > deformed[:, 0].max()
    assert parts[0][:, 1].min() > parts[2][:, 1].max()


def test_logging_changes_no_weights_and_no_modes(logged, frozen, tiny_config, tmp_path):
    assert frozen.steps == STEPS
    plain = Session(tiny_config(*SETTINGS), tmp_path, logger=False, more=(Frozen(),)).fit()
    assert not plain.folder.exists()
    states = plain.module.state_dict(), logged.module.state_dict()
    for a, b in zip(*(state.values() for state in states), strict=True):
        assert torch.equal(a, b)


class Known(nn.Module):
    """Stands for a network: selects template 1, then 0, and moves each of its points its own way.

    A real one that has seen eight steps says the same of every image.
    """

    def __init__(self, bank):
        super().__init__()
        self.parts = nn.ModuleList([nn.Linear(1, 1), nn.Dropout()])
        shape = (SHOWN, *bank.control_points.shape)
        self.offsets = torch.rand(shape, generator=torch.Generator().manual_seed(0))

    def forward(self, images):
        assert not self.training
        weights = torch.tensor([[0.25, 0.75], [0.75, 0.25]])
        return FfdPrediction(weights, weights, self.offsets, weights.log())


def test_pictures_are_of_their_model_and_give_every_part_its_mode_back(logged, monkeypatch):
    clouds, bank, network = [], logged.data.bank, Known(logged.data.bank).train()
    network.parts[1].eval()
    monkeypatch.setattr(callbacks, "write_clouds", lambda *args: clouds.extend(args[2]))
    monkeypatch.setattr(logged.module, "network", network)
    Reconstructions(EXAMPLES, SHOWN, 1).on_validation_end(logged.trainer, logged.module)
    assert [part.training for part in network.modules()] == [True, True, True, False]
    rows = example_rows(logged.data, EXAMPLES)[:SHOWN]
    for row, offsets, t, (deformed, truth) in zip(
        rows, network.offsets, (1, 0), clouds, strict=True
    ):
        expected = deformed_by_hand(bank, t, offsets[t])
        assert deformed.numpy() == pytest.approx(expected, abs=1e-5)
        assert (truth.numpy() == logged.data.prepared.cloud(row)).all()


def test_further_devices_write_nothing(tiny_config, tmp_path, monkeypatch):
    monkeypatch.setattr(rank_zero_only, "rank", 1)
    session = Session(tiny_config(), tmp_path, steps=2).fit()
    assert session.trainer.global_step == 2
    assert not session.folder.exists()


def test_a_resumed_run_goes_on_without_doubling(logged, tiny_config, tmp_path):
    class Killed(Exception):
        pass

    class Kill(Callback):
        def on_train_batch_start(self, trainer, *_):
            if trainer.global_step == 7:
                raise Killed

    config, checkpoint = tiny_config(*SETTINGS), tmp_path / "checkpoints" / "step=4.ckpt"
    saving = ModelCheckpoint(checkpoint.parent, "{step}", every_n_train_steps=4, save_top_k=-1)
    first = Session(config, tmp_path, more=(Frozen(), Kill(), saving))
    with pytest.raises(Killed):
        first.fit()
    first.trainer.logger.finalize("failed")
    assert [s.step for s in first.events.Scalars("train/loss")][-1] == 7
    second = Session(config, tmp_path, purge=5, more=(Frozen(),))
    second.module.network.encoder.eval()
    second.fit(checkpoint)
    assert len(list(second.folder.glob("events.*"))) == 2
    whole, resumed = logged.events, second.events
    assert resumed.Tags() == whole.Tags()
    for tag in whole.Tags()["scalars"]:
        if not tag.endswith("_per_second"):
            expected = [(s.step, s.value) for s in whole.Scalars(tag)]
            assert [(s.step, s.value) for s in resumed.Scalars(tag)] == expected, tag
    for kind, load in (("histograms", "Histograms"), ("images", "Images"), ("tensors", "Tensors")):
        for tag in whole.Tags()[kind]:
            steps = [[e.step for e in getattr(run, load)(tag)] for run in (whole, resumed)]
            assert steps[0] == steps[1], tag
