"""What encoders start from; shapes that trained it are not tested on unnoticed."""

import hashlib
import re

import pytest
import torch

from ffd_lightning import shapes
from ffd_lightning.app import training_run
from ffd_lightning.app.build import build_network, build_source
from ffd_lightning.app.checks import validate
from ffd_lightning.app.first_weights import leak_warning
from ffd_lightning.app.identity import identity
from ffd_lightning.checkpoint import load_model
from ffd_lightning.data.splits import SplitInput, make_split
from ffd_lightning.errors import ConfigError
from ffd_lightning.pretrained import pretrained_model
from ffd_lightning.run_folder import RunFolder

EMBEDDED = "encoder.weights=embedded"
FEWER = ("category=table", "split.train_fraction=0.6")


@pytest.fixture(scope="module")
def warned(tiny_config):
    """Return a function from overrides to the warning and the ids that are tested on."""

    def make(*overrides, twins=None):
        cfg = tiny_config("data.num_models=500", EMBEDDED, *overrides)
        ids = tuple(build_source(cfg).shape_ids(cfg.category.name))
        subsets = cfg.split.build()(SplitInput(cfg.category.name, ids, (), {}))
        tested = make_split(ids, subsets, cfg.split.val_fraction).test
        return leak_warning(cfg, tested, twins or {}), tested

    return make


def test_by_default_nothing_leaks(warned):
    for category in shapes.categories():
        assert warned(f"category={category}", "data.num_models=500")[0] == ""


def test_shapes_that_trained_the_first_weights_are_counted(warned):
    text, tested = warned(*FEWER)

    def position(text):
        return int(hashlib.sha256(text.encode()).hexdigest(), 16) / 2**256

    counts = len(tested), sum(position(shape_id) < 0.8 for shape_id in tested)
    assert [int(n) for n in re.findall(r"(?:of|on,) (\d+) ", text)] == list(counts)
    assert min(counts) > 0
    assert "split.train_fraction=0.8" in text
    assert "encoder.weights=none" in text


def test_copies_of_shapes_that_trained_the_first_weights_are_counted(warned):
    _, tested = warned("category=table")
    known = {*tested, *(i[6:] for i in load_model(pretrained_model()).bank.ids)}
    trained = next(i for i in (f"table-{k:06}" for k in range(99)) if i not in known)
    text, _ = warned("category=table", twins={"table": {tested[-1]: trained, trained: trained}})
    assert text.startswith(f"of {len(tested)} shapes to test on, 1 trained")


@pytest.mark.parametrize("other", ["encoder.weights=none", "data.seed=1"])
def test_nothing_leaks_where_the_shapes_or_the_weights_are_others(warned, other):
    assert warned(*FEWER, other)[0] == ""


def test_a_run_says_so_before_it_trains(tiny_config, tmp_path, caplog, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(training_run, "_trainer", stop)
    with pytest.raises(KeyboardInterrupt):
        training_run.train(tiny_config(EMBEDDED, *FEWER), RunFolder(tmp_path))
    assert "too good" in caplog.text
    assert "what is measured on fewer than 10 shapes says little" in caplog.text


def test_the_encoder_sees_what_the_models_encoder_sees(shipped, tiny_config):
    cfg = tiny_config(EMBEDDED, "network.batch_norm_momentum=0.3")
    validate(cfg)
    encoder = build_network(cfg).encoder.eval()
    images = torch.randn(2, 3, 48, 64, generator=torch.Generator().manual_seed(0))
    with torch.no_grad():
        features = encoder(images)
        expected = load_model(shipped).network.encoder(images)
    torch.testing.assert_close(features, expected, rtol=0, atol=0)
    assert features.std() > 0, "else nothing was compared"
    norms = [m for m in encoder.modules() if isinstance(m, torch.nn.BatchNorm2d)]
    assert {norm.momentum for norm in norms} == {0.3}
    assert all(weights.requires_grad for weights in encoder.parameters())


@pytest.mark.usefixtures("shipped")
@pytest.mark.parametrize(
    ("overrides", "embedded"),
    [([], True), (["encoder.weights=none"], False), (["encoder.width=0.5"], False)],
)
def test_it_is_what_is_meant_where_nothing_is_said(tiny_config, overrides, embedded):
    cfg = tiny_config("encoder.weights=null", *overrides)
    assert identity(cfg)["encoder.weights"] == ("embedded" if embedded else "none")
    statistics = build_network(cfg).encoder.layers.conv1_bn.running_mean
    assert bool(statistics.any()) == embedded, "scratch starts at 0"


CONDITIONED = ("category=table", "heads=conditioned", "heads.draw=3", "templates=t2")


def test_a_network_starts_from_a_trained_one(conditioned_checkpoint, tiny_config):
    cfg = tiny_config(*CONDITIONED, f"network.weights={conditioned_checkpoint}")
    validate(cfg)
    expected = load_model(conditioned_checkpoint).network.state_dict()
    assert all(torch.equal(v, expected[k]) for k, v in build_network(cfg).state_dict().items())
    wider = tiny_config(*CONDITIONED, "heads.width=8", f"network.weights={conditioned_checkpoint}")
    with pytest.raises(ConfigError, match=r"another network \(size mismatch for heads.of_image"):
        validate(wider)
    said = tiny_config(*CONDITIONED, "network.weights=x", "encoder.weights=embedded")
    with pytest.raises(ConfigError, match=r"leave encoder.weights out"):
        validate(said)
