"""Parts of a user's own: what is kept of their settings, and what is said of mistakes in them."""

import io
import subprocess
import sys
from dataclasses import MISSING, dataclass, field, fields
from enum import Enum
from pathlib import Path
from types import SimpleNamespace

import cloudpickle
import numpy as np
import pytest
import torch
import yaml
from omegaconf import MISSING as OMITTED
from torch import nn

import ffd_lightning as ffd
from ffd_lightning import registry
from ffd_lightning.app.build import (
    build_data,
    build_network,
    build_objective,
    build_protocol,
    build_source,
)
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import compose_config, config_folder, node_type, typed_config
from ffd_lightning.app.help import command_help
from ffd_lightning.app.identity import to_yaml
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.splits import make_split
from ffd_lightning.data.templates.strategies import choose_templates
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.evaluation.samples import score_sample
from ffd_lightning.imaging.render_settings import RenderSettings


class Padding(Enum):
    ZERO = "zeros"
    SAME = "replicate"


@dataclass
class Tiny:
    """A convolution."""

    padding: Padding = Padding.ZERO
    notes: Path = Path("notes")
    sizes: tuple[int, int] = (8, 8)


class TinyEncoder(ffd.ImageEncoder):
    def __init__(self, settings):
        super().__init__()
        self.out_channels = 4
        self.layer = nn.Conv2d(3, 4, 8, 8, padding_mode=settings.padding.value)
        self.notes = settings.notes

    def output_size(self, image_size):
        return image_size[0] // 8, image_size[1] // 8

    def forward(self, images):
        return self.layer(images)


@pytest.fixture
def register(monkeypatch):
    """Register parts for one test alone."""
    registry.load_plugins()
    monkeypatch.setattr(registry, "_entries", dict(registry._entries))

    def add(kind, name, settings, factory):
        registry.register(kind, name, settings)(factory)

    return add


@pytest.fixture
def tiny(register):
    register("encoder", "tiny", Tiny, lambda s, image_size, batch_norm_momentum: TinyEncoder(s))


def typed(*overrides):
    return typed_config(compose_config("train", TrainConfig, overrides), TrainConfig)


def small(*overrides):
    return typed("data.render.height=48", "data.render.width=64", "templates=t2", *overrides)


def test_settings_of_all_types_are_read_back_from_a_runs_config(tiny):
    cfg = typed("encoder=tiny", "encoder.padding=SAME", "encoder.notes=a/b", "encoder.sizes=[1,2]")
    text = to_yaml(cfg)
    assert "padding: SAME" in text
    again = typed_config(yaml.safe_load(text), TrainConfig).encoder
    assert (again.padding, again.notes, list(again.sizes)) == (Padding.SAME, Path("a/b"), [1, 2])


def test_help_shows_what_is_written_on_the_command_line(tiny):
    text = command_help("train", TrainConfig, config_folder())
    assert "padding=ZERO|SAME" in text


def test_a_checkpoints_part_holds_plain_values_and_is_built_again(tiny):
    settings = {"padding": Padding.SAME, "notes": Path("a/b")}
    encoder = ffd.part("encoder", "tiny", **settings, image_size=(48, 64), batch_norm_momentum=0.1)
    file = io.BytesIO()
    torch.save(encoder.part.settings, file)
    file.seek(0)
    loaded = torch.load(file, weights_only=True)
    assert loaded == {"padding": "SAME", "notes": "a/b", "sizes": [8, 8]}
    part = registry.Part("encoder", "tiny", loaded, "here")
    again = part.build(image_size=(48, 64), batch_norm_momentum=0.1)
    assert again.layer.padding_mode == "replicate"
    assert again.notes == Path("a/b")


@dataclass
class Rich:
    """Settings of all types."""

    file: Path | None = None
    none: Path | None = None
    paddings: list[Padding] = field(default_factory=list)
    pair: tuple[Padding, Path] = (Padding.ZERO, Path())
    paths: dict[str, Path | None] = field(default_factory=dict)
    tiny: Tiny = field(default_factory=Tiny)


def test_settings_of_a_checkpoint_come_back_as_they_were(register):
    given = []
    register("encoder", "rich", Rich, lambda s, image_size, padding: given.append(s) or Kept())
    same = [Padding.SAME, Padding.ZERO]
    tiny = Tiny(Padding.SAME, Path("x"), [1, 2])
    settings = {"file": Path("a"), "paddings": same, "pair": [Padding.SAME, Path("b")]}
    settings |= {"paths": {"c": Path("d"), "e": None}, "tiny": tiny}
    made = ffd.part("encoder", "rich", **settings, image_size=(48, 64), padding=1)
    made.part.build(image_size=(48, 64), padding=1)
    assert given[0] == given[1]


class Kept:
    part = None


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"depth": 3}, "'tiny' was built with depth=3, which ffd_lightning does not know"),
        ({"padding": "MIRROR"}, "was built with padding=MIRROR, which .* not know"),
    ],
)
def test_what_a_checkpoint_has_and_this_version_does_not_is_refused(tiny, settings, words):
    part = registry.Part("encoder", "tiny", settings, "own-parts 9")
    with pytest.raises(ConfigError, match=rf"{words}.*own-parts 9"):
        part.build(image_size=(48, 64), batch_norm_momentum=0.1)


def test_nodes_stay_as_they_are_when_a_job_in_another_process_sends_them_back():
    node = node_type(registry.get("source", "procedural"))
    there = (
        "import sys, cloudpickle; import ffd_lightning.app.configuration; "
        "sys.stdout.buffer.write(cloudpickle.dumps(cloudpickle.load(sys.stdin.buffer)))"
    )
    command = [sys.executable, "-c", there]
    sent = subprocess.run(command, input=cloudpickle.dumps(node), capture_output=True, check=True)
    assert cloudpickle.loads(sent.stdout) is node
    assert all(f.default is MISSING or f.default_factory is MISSING for f in fields(node))
    typed("data=procedural")


@dataclass
class Odd:
    a: np.ndarray | None = None


def test_settings_of_other_types_are_named(register):
    register("term", "odd", Odd, lambda s: None)
    with pytest.raises(ConfigError, match=r"term 'odd' of ffd_lightning: .*'a' has a type"):
        node_type(registry.get("term", "odd"))


def test_a_name_is_taken_once_in_a_module_too(register):
    def first(settings): ...
    def second(settings): ...

    register("term", "mine", Tiny, first)
    register("term", "mine", Tiny, first)
    with pytest.raises(ConfigError, match=r"term 'mine' of .* is taken"):
        register("term", "mine", Tiny, second)


def odd_encoder(**methods):
    content = {"out_channels": 4, "output_size": lambda self, size: (size[0] // 8, size[1] // 8)}
    content["forward"] = lambda self, images: images.new_zeros(len(images), 4, 6, 8)
    made = type("Odd", (ffd.ImageEncoder,), content | methods)
    return lambda settings, image_size, batch_norm_momentum: made()


@pytest.mark.parametrize(
    ("methods", "words"),
    [
        ({"output_size": lambda self, size: (3, 4)}, r"\(1, 4, 6, 8\).* say \(1, 4, 3, 4\)"),
        ({"output_size": ffd.ImageEncoder.output_size}, "has no method output_size"),
        ({"out_channels": None}, "has no out_channels"),
    ],
)
def test_an_encoder_that_says_something_else_than_it_does(register, methods, words):
    register("encoder", "odd", Tiny, odd_encoder(**methods))
    with pytest.raises(ConfigError, match=f"encoder=odd .*{words}"):
        build_network(small("encoder=odd"))


def test_trying_an_encoder_leaves_random_numbers_and_statistics_alone(register, monkeypatch):
    register("encoder", "tiny", Tiny, lambda s, image_size, batch_norm_momentum: TinyEncoder(s))
    torch.manual_seed(0)
    weights = build_network(small("encoder=tiny")).state_dict()
    monkeypatch.setattr("ffd_lightning.app.build._check_feature_map", lambda *_: None)
    torch.manual_seed(0)
    untried = build_network(small("encoder=tiny"))
    assert untried.training
    assert all(torch.equal(w, weights[key]) for key, w in untried.state_dict().items())


class FrozenEncoder(TinyEncoder):
    """Keeps the statistics of one layer, and drops features at random in training."""

    def __init__(self, settings):
        super().__init__(settings)
        self.norm, self.dropout = nn.BatchNorm2d(4).eval(), nn.Dropout(0.5)

    def forward(self, images):
        return self.dropout(self.norm(super().forward(images)))


def test_trying_an_encoder_leaves_frozen_layers_frozen(register):
    register("encoder", "tiny", Tiny, lambda s, image_size, batch_norm_momentum: FrozenEncoder(s))
    encoder = build_network(small("encoder=tiny")).encoder
    assert (encoder.norm.training, encoder.dropout.training) == (False, True)
    assert encoder.norm.num_batches_tracked == 0


@pytest.mark.parametrize(
    ("kind", "override"), [("selection", "regime/selection=odd"), ("split", "split=odd")]
)
def test_a_factory_that_gives_no_function(register, kind, override):
    register(kind, "odd", Tiny, lambda settings: None)
    cfg = small(override)
    with pytest.raises(ConfigError, match=r"odd gives a NoneType, not a function"):
        build_objective(cfg.regime, 1) if kind == "selection" else build_data(cfg)


class BareProtocol(ffd.EvaluationProtocol):
    name = "odd"
    measures = (ffd.Measure("width", "of it"),)
    note = "no unit"

    def score(self, shape, truth, rng):
        return truth

    def truth(self, shape, rng):
        return self.given


@dataclass(frozen=True)
class OddProtocol(BareProtocol):
    given: object = None


@pytest.mark.parametrize(
    ("made", "words"), [(5, "gives a int, not a"), (BareProtocol(), "is no dataclass: put @data")]
)
def test_a_factory_that_gives_no_protocol(register, made, words):
    register("protocol", "odd", Tiny, lambda settings: made)
    with pytest.raises(ConfigError, match=words):
        build_protocol(SimpleNamespace(name="odd", **vars(Tiny())))


@pytest.mark.parametrize("given", [None, {"with": 1.0}, {"width": "x"}])
def test_scores_that_lack_a_measure(given):
    prepared = SimpleNamespace(ids=("a",))
    with pytest.raises(ConfigError, match=r"protocol 'odd': .*'width'"):
        score_sample(OddProtocol(given), prepared, 0, {"": object()}, 0)
    assert score_sample(OddProtocol({"width": 2.0}), prepared, 0, {"": object()}, 0) == {"width": 2}


@dataclass(frozen=True)
class OddSource(ffd.Source):
    ids: object = field(default_factory=lambda: ["a", "b"])
    kept: object = field(default_factory=lambda: {"source": "odd"})
    held: object = None

    def categories(self):
        return ["odd"]

    def shape_ids(self, category):
        return self.ids

    def load(self, category, shape_id):
        return None

    def fingerprint(self, category):
        return self.kept


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (OddSource(ids=["a", "a"]), "shape_ids of OddSource must give a list"),
        (OddSource(kept={"root": Path("x")}), "fingerprint of OddSource .* not JSON"),
        (OddSource(held=lambda: 0), "OddSource cannot be sent to the processes"),
        (OddSource(), "its source gives a NoneType, not a SourceShape"),
    ],
)
def test_a_source_that_gives_something_else(tmp_path, source, words):
    render = RenderSettings(48, 64, samples=1)
    preparation = Preparation(source, "odd", 64, render, tmp_path, workers=1, progress=False)
    with pytest.raises(UserError, match=words) as caught:
        preparation.run()
    assert "report it" not in str(caught.value)


def test_what_is_no_source(register):
    register("source", "odd", Tiny, lambda settings, image_size: {})
    with pytest.raises(ConfigError, match="data=odd gives a dict, not a Source"):
        build_source(small("data=odd"))


def test_a_split_and_a_strategy_that_give_nothing():
    with pytest.raises(ConfigError, match="the split gives a NoneType, not a subset by id"):
        make_split(["a"], None)
    with pytest.raises(ConfigError, match=r"the template strategy must choose 1 .* NoneType"):
        choose_templates(lambda prepared, count: None, ["a"], 1)


def test_a_script_combines_a_regime_with_parts_of_its_own(register):
    register("term", "mine", Tiny, lambda settings: lambda inputs: torch.ones(()))
    teach = torch.nn.Identity()
    register("selection", "mine", Tiny, lambda settings: teach)
    objective = ffd.regime("b", "+terms.mine.weight=0.5", "selection=mine")
    assert objective.weights(0)["mine"] == 0.5
    assert objective.selection is teach


@dataclass
class Strict:
    """Must be given."""

    file: str = OMITTED
    rate: float = 0.5

    def check(self):
        if self.rate > 1:
            raise ConfigError("rate must be at most 1")


def test_scripts_are_told_what_a_part_needs(register):
    register("encoder", "strict", Strict, lambda s, image_size, batch_norm_momentum=0.1: s)
    with pytest.raises(ConfigError, match=r"must be given file=\.\.\., image_size"):
        ffd.part("encoder", "strict")
    with pytest.raises(ConfigError, match="rate must be at most 1"):
        ffd.part("encoder", "strict", file="a", rate=2, image_size=(48, 64))
    with pytest.raises(ConfigError, match="no kind 'encodr' of parts: use one of augmentation"):
        ffd.part("encodr", "strict")
    assert ffd.part("encoder", "strict", file="a", image_size=(48, 64)).file == "a"
