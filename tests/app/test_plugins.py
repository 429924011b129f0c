"""Components of a user's own: what is kept of their settings, and what is said of mistakes."""

from pathlib import Path

import pytest
import torch
from commands import train_config
from torch import nn

import ffd_lightning as ffd
from ffd_lightning import components
from ffd_lightning.app.build import build_network
from ffd_lightning.errors import ConfigError


@pytest.fixture(autouse=True)
def _registered(monkeypatch):
    """What a test registers is gone after it."""
    components.load_plugins()
    monkeypatch.setattr(components, "_registered", dict(components._registered))


class TinyEncoder(ffd.ImageEncoder):
    """A convolution; it names none of the context."""

    def __init__(self, notes: Path = Path("notes"), sizes: tuple[int, int] = (8, 8)):
        super().__init__()
        self.out_channels, self.notes = 4, notes
        self.layer = nn.Conv2d(3, 4, sizes, sizes)

    def output_size(self, image_size):
        return image_size[0] // 8, image_size[1] // 8

    def forward(self, images):
        return self.layer(images)


def small(*overrides):
    given = ("data.render.height=48", "data.render.width=64", "templates=t2", *overrides)
    return train_config(*given)


def test_one_module_needs_no_brackets():
    assert small("plugins=statistics").plugins == ["statistics"]


def test_an_encoder_whose_feature_map_is_not_as_it_says():
    ffd.component("encoder", "odd")(
        type("Odd", (TinyEncoder,), {"output_size": lambda self, size: (3, 4)})
    )
    with pytest.raises(ConfigError, match=r"encoder=odd .*\(1, 4, 6, 8\).* say \(1, 4, 3, 4\)"):
        build_network(small("encoder=odd"))


class FrozenEncoder(TinyEncoder):
    """Keeps the statistics of one layer, and drops features at random in training."""

    def __init__(self):
        super().__init__()
        self.norm, self.dropout = nn.BatchNorm2d(4).eval(), nn.Dropout(0.5)

    def forward(self, images):
        return self.dropout(self.norm(super().forward(images)))


def test_trying_an_encoder_leaves_random_numbers_and_statistics_alone():
    ffd.component("encoder", "frozen")(type("Frozen", (FrozenEncoder,), {}))
    torch.manual_seed(0)
    network = build_network(small("encoder=frozen"))
    assert (network.encoder.norm.training, network.encoder.dropout.training) == (False, True)
    assert network.encoder.norm.num_batches_tracked == 0
    torch.manual_seed(0)
    untried = FrozenEncoder()
    assert torch.equal(untried.layer.weight, network.encoder.layer.weight)
    std = network.heads.logits.weight.std()
    torch.manual_seed(0)
    assert std == build_network(small("encoder=frozen")).heads.logits.weight.std()


def test_a_script_combines_a_regime_with_components_of_its_own():
    @ffd.component("term", "mine")
    class Mine:
        def __call__(self, inputs):
            return torch.ones(())

    @ffd.component("selection", "mine")
    class Teach(nn.Identity):
        pass

    overrides = ("term=[mine]", "terms.mine.weight=0.5", "selection=mine")
    objective = ffd.regime("b", *overrides)
    assert objective.weights(0)["mine"] == 0.5
    assert isinstance(objective.selection, Teach)
