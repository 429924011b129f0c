import itertools
import math

import numpy as np
import pytest
import torch
from lightning import Trainer
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from tensorboard.util import tensor_util
from torch import nn

from ffd_lightning.app.build import build_data, build_module, build_network
from ffd_lightning.nn.network import FfdPrediction
from ffd_lightning.training import callbacks
from ffd_lightning.training.callbacks import Clock, Reconstructions, TemplateSelection, example_rows
from ffd_lightning.training.tensorboard import CLOUD_LEGEND, StepLogger

CLOUDS = f"table e t2: {CLOUD_LEGEND}/clouds"
STEPS, EXAMPLES, SHOWN, TIMES = 8, 3, 2, 2
VALIDATIONS = [2, 4, 6, 8]
SETTINGS = (
    "regime=e",
    "schedule.annealing_steps=10",
    "schedule.learning_rate=1e-3",
    "lr_schedule=cosine",
    "split.val_fraction=0.3",
)


class Session:
    """A small training of its own: 8 steps of 4 queries, a validation every 2."""

    def __init__(self, config, folder, *, logger=True):
        torch.manual_seed(0)
        self.data = build_data(config)
        self.data.prepare_data()
        self.data.setup()
        self.module = build_module(config, build_network(config), {})
        drawn = Reconstructions(EXAMPLES, SHOWN, TIMES, "table/e/t2")
        self.folder = folder / "tensorboard"
        self.trainer = Trainer(
            accelerator="cpu",
            max_steps=STEPS,
            max_epochs=-1,
            val_check_interval=2,
            num_sanity_val_steps=0,
            log_every_n_steps=1,
            logger=logger and StepLogger(folder, "", "tensorboard"),
            callbacks=[Clock(1), TemplateSelection(), drawn],
            enable_checkpointing=False,
            enable_progress_bar=False,
            enable_model_summary=False,
            default_root_dir=folder,
        )

    def fit(self):
        self.trainer.fit(self.module, datamodule=self.data)
        return self

    @property
    def events(self):
        kinds = dict.fromkeys(("histograms", "images", "tensors"), 0)
        return EventAccumulator(str(self.folder), kinds).Reload()


@pytest.fixture(scope="module")
def logged(tiny_config, tmp_path_factory):
    return Session(tiny_config(*SETTINGS), tmp_path_factory.mktemp("logged")).fit()


def test_curves_count_steps_from_one_and_rate_and_weights_are_those_of_the_step(logged):
    events = logged.events
    minimised, others = ("weighted_chamfer", "negative_entropy"), ("offset_penalty", "box_chamfer")
    every = {f"train/{name}" for name in (*minimised, *others, "loss")}
    every |= {f"weighted_terms/{name}" for name in minimised} | {"work/learning_rate"}
    for tag in every:
        assert [s.step for s in events.Scalars(tag)] == list(range(1, STEPS + 1)), tag
    scores = ("box_chamfer", "undeformed_box_chamfer", "entropy", "effective_templates")
    judged = {f"val/{name}" for name in scores}
    for tag in judged:
        assert [s.step for s in events.Scalars(tag)] == VALIDATIONS
    speed = {"work/steps_per_second", "work/queries_per_second"}
    assert set(events.Tags()["scalars"]) == every | judged | speed
    chamfer = logged.module.scores.summary()["box_chamfer"]
    assert events.Scalars("val/box_chamfer")[-1].value == pytest.approx(chamfer)
    weighted = [[s.value for s in events.Scalars(f"weighted_terms/{name}")] for name in minimised]
    losses = [s.value for s in events.Scalars("train/loss")]
    assert np.sum(weighted, axis=0) == pytest.approx(losses, rel=1e-4)
    for point in events.Scalars("work/learning_rate"):
        cosine = 1e-3 * (1 + math.cos(math.pi * (point.step - 1) / STEPS)) / 2
        assert point.value == pytest.approx(cosine, rel=1e-5)
    pages = (events.Scalars(f"{x}/negative_entropy") for x in ("weighted_terms", "train"))
    for weighted, term in zip(*pages, strict=True):
        weight = 100 * math.exp(-(term.step - 1) / 10)
        assert weighted.value == pytest.approx(weight * term.value, rel=1e-5)


def test_selections_are_drawn_at_every_validation_and_examples_as_often_as_asked(logged):
    events, scores = logged.events, logged.module.scores
    assert [i.step for i in events.Images("which_template/bars")] == VALIDATIONS
    assert [i.step for i in events.Images("which_template/all")] == VALIDATIONS[:1]
    assert [h.step for h in events.Histograms("which_template/selected")] == VALIDATIONS
    assert [i.step for i in events.Images("worked_examples/reconstructions")] == [4]
    for part in ("VERTEX", "COLOR"):
        tensors = events.Tensors(f"{CLOUDS}_{part}")
        assert [t.step for t in tensors] == [4, 8]
        points = SHOWN * 2 * logged.data.prepared.num_points
        assert tensor_util.make_ndarray(tensors[-1].tensor_proto).shape == (1, points, 3)
    last = events.Histograms("which_template/selected")[-1].histogram_value
    assert last.bucket_limit == [1.5, 2.5]
    assert last.bucket == pytest.approx(100 * scores.counts / len(scores.rows))


def test_logging_changes_no_weights(logged, tiny_config, tmp_path):
    plain = Session(tiny_config(*SETTINGS), tmp_path, logger=False).fit()
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
        self.images, shape = itertools.count(), (SHOWN, *bank.control_points.shape)
        self.offsets = torch.rand(shape, generator=torch.Generator().manual_seed(0))

    def features(self, images):
        assert not self.training
        return images.float()

    def predict(self, features, mask):
        which = next(self.images)
        weights = torch.tensor([[0.25, 0.75], [0.75, 0.25]])[which, None]
        return FfdPrediction(weights, weights, self.offsets[which, None], weights.log())


def test_pictures_are_of_their_model_and_give_every_part_its_mode_back(logged, monkeypatch):
    clouds, bank, network = [], logged.data.bank, Known(logged.data.bank).train()
    network.parts[1].eval()
    monkeypatch.setattr(callbacks, "write_clouds", lambda *args: clouds.extend(args[2]))
    monkeypatch.setattr(logged.module, "network", network)
    Reconstructions(EXAMPLES, SHOWN, 1, "").on_validation_end(logged.trainer, logged.module)
    assert [part.training for part in network.modules()] == [True, True, True, False]
    rows = example_rows(logged.data, EXAMPLES)[:SHOWN]
    examples = zip(rows, network.offsets, (1, 0), clouds, strict=True)
    for row, offsets, t, (deformed, truth) in examples:
        expected = bank.deformation_matrix[t] @ (bank.control_points[t] + offsets[t])
        assert deformed.numpy() == pytest.approx(expected.numpy(), abs=1e-5)
        assert (truth.numpy() == logged.data.prepared.cloud(row)).all()
