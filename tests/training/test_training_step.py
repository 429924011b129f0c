"""Trainings with a Trainer of one's own, on batches that are made up."""

import math
import warnings
from functools import partial

import numpy as np
import pytest
import torch
from lightning import Callback, Trainer
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import nn
from torch.optim.lr_scheduler import LambdaLR
from torch.utils.data import DataLoader

from ffd_lightning.app.build import build_data, build_module, build_network, regime
from ffd_lightning.checkpoint import load_model
from ffd_lightning.data.batches import Batch
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.ffd import TemplateSample
from ffd_lightning.losses.objective import Objective, WeightedTerm
from ffd_lightning.losses.selection import Teaching, WeightedCosts
from ffd_lightning.losses.terms import Chamfer
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.training.module import FfdModule

T, N, M = 3, 6, 8
SGD = partial(torch.optim.SGD, lr=1e-3)


def tiny_network():
    torch.manual_seed(0)
    return TemplateFfdNetwork(MobileNetV1(0.05), (32, 32), T, M, 4, 8, offset_std=0.1)


def make_batch(seed, queries=2):
    """A batch of made-up queries, and of the same templates whatever the seed."""
    g, same = torch.Generator().manual_seed(seed), torch.Generator().manual_seed(99)
    images = torch.randint(0, 256, (queries, 3, 32, 32), generator=g, dtype=torch.uint8)
    matrix = torch.rand(T, N, M, generator=same).softmax(-1)
    templates = TemplateSample(matrix, torch.rand(T, M, 3, generator=same), (1, 1, 1))
    return Batch(torch.arange(queries), images, torch.rand(queries, N, 3, generator=g), templates)


def joined(*batches):
    fields = [torch.cat(parts) for parts in zip(*(batch[:3] for batch in batches), strict=True)]
    return Batch(*fields, batches[0].templates)


def fit(module, data, resume=None, **settings):
    trainer = Trainer(
        **{"enable_checkpointing": "callbacks" in settings, **settings},
        accelerator="cpu",
        devices=1,
        logger=False,
        enable_progress_bar=False,
        enable_model_summary=False,
        num_sanity_val_steps=0,
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of workers, and of data from elsewhere
        if isinstance(data, list):
            data = DataLoader(data, batch_size=None)
        trainer.fit(module, data, ckpt_path=resume)


def updates(objective, batches, **settings):
    """Return what training adds to the weights of a network without batch norm."""
    network = tiny_network()
    for part in list(network.modules()):
        for name, child in part.named_children():
            if isinstance(child, nn.BatchNorm1d | nn.BatchNorm2d):
                setattr(part, name, nn.Identity())
            elif isinstance(child, nn.Conv2d | nn.Linear):
                nn.init.kaiming_normal_(child.weight)  # else images vanish without batch norm
    before = nn.utils.parameters_to_vector(network.parameters()).double()
    fit(FfdModule(network, objective, optimizer=SGD), batches, precision="64-true", **settings)
    return nn.utils.parameters_to_vector(network.parameters()) - before


@pytest.mark.parametrize(
    ("name", "overrides", "second"),
    [
        ("r", (), 1),
        ("posterior", ("terms.sliced_wasserstein.weight=0",), 1),
        ("e", (), 0),  # entropies are of each batch: equal where both have the same mean weights
    ],
)
def test_accumulated_batches_train_as_one_batch_of_all_queries(name, overrides, second):
    first, other, last = make_batch(0), make_batch(second), make_batch(2)
    objective = regime(name, *overrides)
    expected = updates(objective, [joined(first, other), last], max_epochs=1)
    found = updates(objective, [first, other, last], max_epochs=1, accumulate_grad_batches=2)
    plain = updates(regime("b"), [joined(first, other), last], max_epochs=1)
    assert (expected - plain).norm() > 0.01 * plain.norm(), "it is not the Chamfer distance alone"
    torch.testing.assert_close(found, expected, rtol=1e-6, atol=1e-9)


BROKEN_AT = 2  # the third step, which two good ones come before


def broken_term(inputs):
    return inputs.prediction.offsets.sum() * (math.nan if inputs.step == BROKEN_AT else 0)


def broken_selection(inputs, costs):
    taught = WeightedCosts()(inputs, costs)
    return Teaching(taught.cost_weights * (math.inf if inputs.step == BROKEN_AT else 1))


def broken_gradient(inputs):
    """A root of 0: finite, and its gradient is not."""
    zero = inputs.prediction.offsets.sum() * 0
    return zero.sqrt() if inputs.step == BROKEN_AT else zero


def own(term, selection=None):
    return Objective({"chamfer": WeightedTerm(Chamfer()), "mine": WeightedTerm(term)}, selection)


BROKEN = {
    "term": (own(broken_term), "the loss of step 3 .* because of the term mine"),
    "selection": (
        own(Chamfer(), broken_selection),
        "the loss of step 3 .* because of the selection",
    ),
    "gradient": (own(broken_gradient), r"network\.\S+ is not finite after step 3, because"),
}


@pytest.mark.parametrize("every", [1, 2])
@pytest.mark.parametrize(("objective", "words"), BROKEN.values(), ids=BROKEN)
def test_training_ends_before_a_checkpoint_of_what_is_not_finite(tmp_path, objective, words, every):
    keep = ModelCheckpoint(tmp_path, "{step}", every_n_train_steps=1, save_top_k=-1)
    batches = [make_batch(k) for k in range(6 * every)]
    settings = {"accumulate_grad_batches": every, "callbacks": [keep]}
    with pytest.raises(ConfigError, match=words):
        fit(FfdModule(tiny_network(), objective), batches, **settings)
    kept = [torch.load(path, weights_only=True) for path in tmp_path.iterdir()]
    assert {checkpoint["global_step"] for checkpoint in kept} == {1, 2}
    assert all(w.isfinite().all() for c in kept for w in c["state_dict"].values())


def test_without_checkpoints_losses_are_read_now_and_then_and_weights_at_the_end():
    with pytest.raises(ConfigError, match="is not finite after step 3"):
        fit(
            FfdModule(tiny_network(), own(broken_gradient)),
            [make_batch(k) for k in range(3)],
            max_epochs=1,
        )
    for steps, trained in ((6, 6), (60, 50)):
        module = FfdModule(tiny_network(), own(broken_term))
        with pytest.raises(ConfigError, match=r"step 3 .* the term mine"):
            fit(module, [make_batch(k) for k in range(steps)], max_epochs=1)
        assert module.trainer.fit_loop.epoch_loop.batch_progress.total.ready == trained


class Counts(Callback):
    """A callback with a state."""

    def __init__(self, count):
        self.count = count

    def state_dict(self):
        return {"counts": [self.count]}


def test_numbers_of_numpy_are_kept_as_plain_ones_and_objects_are_refused(tmp_path):
    def train(count):
        def halved(optimizer, steps):
            return LambdaLR(optimizer, lambda step: np.float64(0.5) ** step)

        network, terms = tiny_network(), {"chamfer": WeightedTerm(Chamfer())}
        module = FfdModule(network, Objective(terms), optimizer=SGD, scheduler=halved)
        keep = ModelCheckpoint(tmp_path, "kept", every_n_train_steps=2)
        data = [make_batch(0), make_batch(1)]
        fit(module, data, max_steps=2, callbacks=[Counts(count), keep])

    train(np.int64(3))
    found = torch.load(tmp_path / "kept.ckpt", weights_only=True)
    assert found["optimizer_states"][0]["param_groups"][0]["lr"] == 1e-3 / 4
    assert found["callbacks"]["Counts"] == {"counts": [3]}
    with pytest.raises(ConfigError, match=r"callback Counts cannot be kept .* test_training_step"):
        train(Counts(0))


class Level(nn.Module):
    """A term that learns, and counts."""

    def __init__(self):
        super().__init__()
        self.level = nn.Parameter(torch.zeros(()))
        self.register_buffer("calls", torch.zeros(()))

    def forward(self, inputs):
        self.calls += 1
        return (self.level - 1).square()


class Gumbel(nn.Module):
    """A selection that draws templates, more and more sharply."""

    def __init__(self):
        super().__init__()
        self.register_buffer("temperature", torch.ones(()))

    def forward(self, inputs, costs):
        assert math.isclose(self.temperature, 0.5 ** max(0, inputs.step - 1)), "kept from before"
        self.temperature.fill_(0.5**inputs.step)
        return Teaching(nn.functional.gumbel_softmax(inputs.prediction.template_logits, 0.5))


def test_terms_and_selections_that_are_modules_are_trained_and_kept(
    tiny_config, prepared, tmp_path
):
    def train(resume=None):
        cfg = tiny_config()
        module = FfdModule(build_network(cfg), own(Level(), Gumbel()))
        keep = ModelCheckpoint(tmp_path, "{step}", every_n_train_steps=2, save_top_k=-1)
        fit(module, build_data(cfg), resume, max_steps=4, callbacks=[keep])
        return module.state_dict()

    whole, last = train(), tmp_path / "step=4.ckpt"
    assert 0.003 < whole["objective.term_mine.level"] < 0.005, "four steps of Adam, 0.001 each"
    assert whole["objective.term_mine.calls"] == 4
    assert whole["objective.selection.temperature"] == 0.5**3
    network = load_model(last).network.state_dict()
    assert all(torch.equal(value, whole[f"network.{name}"]) for name, value in network.items())
    last.unlink()
    resumed = train(tmp_path / "step=2.ckpt")
    assert all(torch.equal(value, whole[name]) for name, value in resumed.items())


def test_terms_are_told_the_degrees_of_the_data(tiny_config, prepared):
    cfg = tiny_config("regime=posterior", "network.degrees=[1,3,7]")
    data, network, told = build_data(cfg), build_network(cfg), []

    def watch(inputs):
        told.append(inputs.templates.degrees)
        return Chamfer()(inputs)

    fit(FfdModule(network, own(watch)), data, max_steps=1)
    assert told == [(1, 3, 7)]
    network.mirror_degrees = (3, 3, 3)
    with pytest.raises(ConfigError, match=r"mirror_degrees is \(3, 3, 3\)"):
        fit(FfdModule(network, own(watch)), data, max_steps=1)


def test_networks_that_see_objects_from_several_sides_learn_from_which(tiny_config):
    """Its loss leaves all other weights as they are without it."""
    several = ("data.render.random_views=2", "heads=conditioned", "regime=posterior")
    cfg = tiny_config(*several)
    data, found = build_data(cfg), []
    data.prepare_data()
    for taught in (True, False):
        torch.manual_seed(0)
        network = build_network(cfg)
        assert network.viewpoint is not None
        network.viewpoint = network.viewpoint if taught else None
        module = build_module(cfg, network, {})
        fit(module, data, max_steps=2)
        found.append({name: w.clone() for name, w in network.state_dict().items()})
    taught, plain = found
    assert {name for name in taught if name not in plain} == {
        f"viewpoint.layers.{k}" for k in ("0.weight", "0.bias", "2.weight", "2.bias")
    }
    assert all(torch.equal(taught[name], plain[name]) for name in plain)
