"""Parts of a user's own: what is kept of their settings, and what is said of mistakes in them."""

import io
import subprocess
import sys
from dataclasses import MISSING, dataclass, fields
from enum import Enum
from pathlib import Path

import cloudpickle
import numpy as np
import pytest
import torch
import yaml
from torch import nn

import ffd_lightning as ffd
from ffd_lightning import registry
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.help import command_help
from ffd_lightning.app.hydra_app import compose_config, config_folder
from ffd_lightning.app.identity import to_yaml
from ffd_lightning.app.schema import node_type, typed_config
from ffd_lightning.errors import ConfigError


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


def test_nodes_stay_as_they_are_when_a_job_in_another_process_sends_them_back():
    node = node_type(registry.get("source", "procedural"))
    there = (
        "import sys, cloudpickle; import ffd_lightning.app.schema; "
        "sys.stdout.buffer.write(cloudpickle.dumps(cloudpickle.load(sys.stdin.buffer)))"
    )
    command = [sys.executable, "-c", there]
    sent = subprocess.run(command, input=cloudpickle.dumps(node), capture_output=True, check=True)
    assert cloudpickle.loads(sent.stdout) is node
    assert all(f.default is MISSING or f.default_factory is MISSING for f in fields(node))
    typed("data=procedural")


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"a": (np.ndarray, None)}, "setting 'a' has a type that is not known"),
        ({"a": (int, "x")}, "a default of another type"),
        ({"a": ("Nope", 1)}, "'Nope' is not defined"),
    ],
)
def test_settings_of_other_types_are_named(register, settings, words):
    body = {key: default for key, (_, default) in settings.items()}
    types = {key: kind for key, (kind, _) in settings.items()}
    made = dataclass(type("Odd", (), body | {"__annotations__": types, "__module__": __name__}))
    register("term", "odd", made, lambda s: None)
    with pytest.raises(ConfigError, match=f"term 'odd' of ffd_lightning: .*{words}"):
        node_type(registry.get("term", "odd"))


def test_a_name_is_taken_once_in_a_module_too(register):
    def first(settings): ...
    def second(settings): ...

    register("term", "mine", Tiny, first)
    register("term", "mine", Tiny, first)
    with pytest.raises(ConfigError, match=r"term 'mine' of .* is taken"):
        register("term", "mine", Tiny, second)
