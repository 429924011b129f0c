"""The encoder of the model that comes with the package, as first weights."""

import pytest
import torch
from ffd_lightning.registry import part

from ffd_lightning.app.build import build_network
from ffd_lightning.app.checks import validate
from ffd_lightning.app.identity import check_folder, identity, to_yaml
from ffd_lightning.checkpoint import load_model
from ffd_lightning.errors import ConfigError
from ffd_lightning.pretrained import pretrained_digest
from ffd_lightning.run_folder import RunFolder

EMBEDDED = "encoder.weights=embedded"


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


@pytest.mark.usefixtures("shipped")
def test_it_starts_there_and_is_trained_on(tiny_config):
    encoder = build_network(tiny_config(EMBEDDED)).encoder.train()
    assert all(weights.requires_grad for weights in encoder.parameters())
    before = {name: value.clone() for name, value in encoder.state_dict().items()}
    encoder(torch.randn(4, 3, 48, 64))
    after = encoder.state_dict()
    assert not torch.equal(
        after["layers.conv1_bn.running_mean"], before["layers.conv1_bn.running_mean"]
    )


def test_another_model_makes_another_run(shipped, tiny_config, tmp_path):
    cfg, run = tiny_config(EMBEDDED), RunFolder(tmp_path)
    check_folder(cfg, run)
    check_folder(tiny_config(EMBEDDED), run)
    digest = pretrained_digest()
    assert identity(cfg)["encoder.weights"] == f"embedded-{digest}"
    assert f"weights: embedded-{digest}" in to_yaml(cfg)
    with open(shipped, "ab") as file:
        file.write(b"!")
    words = f"encoder.weights was embedded-{digest}, now embedded-{pretrained_digest()}"
    with pytest.raises(ConfigError, match=words):
        check_folder(tiny_config(EMBEDDED), run)


def test_a_model_that_is_said_and_is_not_here_is_refused(shipped, tiny_config):
    said = f"embedded-{pretrained_digest()}"
    cfg = tiny_config(f"encoder.weights={said}")
    validate(cfg)
    with open(shipped, "ab") as file:
        file.write(b"!")
    words = f"encoder.weights={said}: the model here is embedded-{pretrained_digest()}"
    with pytest.raises(ConfigError, match=words):
        validate(cfg)
    assert identity(cfg)["encoder.weights"] == said


@pytest.mark.usefixtures("shipped")
@pytest.mark.parametrize(
    ("settings", "embedded"), [({}, True), ({"weights": "none"}, False), ({"width": 0.5}, False)]
)
def test_it_is_what_is_meant_where_nothing_is_said(settings, embedded):
    torch.manual_seed(0)
    encoder = part("encoder", "mobilenet", image_size=(48, 64), **settings)
    told = f"embedded-{pretrained_digest()}" if embedded else "none"
    assert encoder.part.settings["weights"] == told
    assert bool(encoder.layers.conv1_bn.running_mean.any()) == embedded, "scratch starts at 0"


@pytest.mark.usefixtures("nothing_shipped")
def test_where_nothing_is_said_and_nothing_is_there_it_starts_from_scratch():
    encoder = part("encoder", "mobilenet", image_size=(48, 64))
    assert encoder.part.settings["weights"] == "none"


@pytest.mark.usefixtures("shipped")
def test_another_width_is_refused(tiny_config):
    with pytest.raises(ConfigError, match=r"encoder=mobilenet of width 0.25, not of 0.5: leave"):
        validate(tiny_config(EMBEDDED, "encoder.width=0.5"))


@pytest.mark.usefixtures("nothing_shipped")
def test_without_a_model_it_is_refused(tiny_config):
    cfg = tiny_config(EMBEDDED)
    assert identity(cfg)["encoder.weights"] == "embedded"
    with pytest.raises(ConfigError, match="weights=embedded: this installation has no"):
        validate(cfg)
    with pytest.raises(ConfigError, match="this installation has no"):
        part("encoder", "mobilenet", image_size=(48, 64), weights="embedded")
