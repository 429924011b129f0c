"""Components are found, typed, built and known again; each kind of mistake has one message."""

import sys
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pytest
import torch
from commands import python
from torch import nn

from ffd_lightning import components
from ffd_lightning.components import Component, Range, component, find, make, settings_of, typed
from ffd_lightning.errors import ConfigError
from ffd_lightning.training.schedules import one_cycle


@pytest.fixture(autouse=True)
def _restored(monkeypatch):
    """What a test registers is gone after it."""
    monkeypatch.setattr(components, "_registered", dict(components._registered))
    monkeypatch.setattr(components, "_provider", "own 0.1")


class Base:
    """What is common.

    Args:
        depth: of the layers.
    """

    def __init__(self, depth: int = 2) -> None:
        self.depth = depth


def patches():
    @component("encoder", "patches")
    class Patches(Base, nn.Module):
        """Convolutions on patches.

        Longer.

        Args:
            size: of a patch,
                in pixels.
        """

        def __init__(
            self,
            image_size: tuple[int, int],
            size: int = 16,
            norm: Literal["batch", "layer"] = "batch",
            folder: Path | None = None,
            depth: int = 2,
        ) -> None:
            nn.Module.__init__(self)
            if size < 1:
                raise ValueError(f"size={size} must be above 0")
            self.image_size, self.size, self.norm, self.folder = image_size, size, norm, folder

    return Patches


def test_a_signature_is_the_settings():
    found = settings_of(patches(), ("image_size",))
    assert list(found) == ["size", "norm", "folder", "depth"]
    assert (found["size"].hint, found["size"].default) == (int, 16)
    assert found["size"].help == "of a patch, in pixels."
    assert found["depth"].help == "of the layers.", "settings where it is inherited from"
    assert components.summary(patches()) == "Convolutions on patches."
    assert settings_of(one_cycle)["warm_up"].help.startswith("share of the steps"), "of a function"


def test_what_was_built_is_built_again_from_plain_values():
    patches()
    built = make("encoder", "patches", size=8, folder="a/b", image_size=(48, 64))
    assert (built.size, built.folder, built.image_size) == (8, Path("a/b"), (48, 64))
    settings = {"size": 8, "norm": "batch", "folder": "a/b", "depth": 2}
    assert built.component == Component("encoder", "patches", settings, "own 0.1")
    again = built.component.build(image_size=(96, 128), batch_norm_momentum=0.1)
    assert (again.size, again.image_size) == (8, (96, 128))
    settings["depht"] = 3
    with pytest.raises(ConfigError, match=r"no setting 'encoder patches\.depht'\. Did you mean"):
        Component("encoder", "patches", settings).build(image_size=(96, 128))
    size = find("encoder", "patches")((48, 64), np.int64(4)).component.settings["size"]
    assert (size, type(size)) == (4, int)


@dataclass
class Inner:
    """Settings in settings."""

    angles: list[float] = field(default_factory=lambda: [45.0])


class Norm(Enum):
    BATCH = "batch"
    LAYER = "layer"


VALUES = [
    (int, 3, 3),
    (float, 3, 3.0),
    (str, 12, "12"),
    (Path, "a", Path("a")),
    (int | None, None, None),
    (float | str, "a", "a"),
    (tuple[int, int, int], [1, 2, 3], (1, 2, 3)),
    (list[float], (1, 2), [1.0, 2.0]),
    (dict[str, int], {"a": 1}, {"a": 1}),
    (Literal["a", "b"], "b", "b"),
    (Inner, {"angles": [1]}, Inner([1.0])),
    (torch.Tensor | float, 1, 1.0),
    (Norm, "BATCH", Norm.BATCH),
    (Norm | None, Norm.LAYER, Norm.LAYER),
    (Annotated[int, Range("(0, inf)")] | None, 1, 1),
]
REFUSED = [
    (int, True, "x=true must be a whole number"),
    (bool, 3, "x=3 must be true or false"),
    (float | None, "a", "x=a must be a number or null"),
    (Literal["val", "test"], "tset", "x=tset must be one of val, test. Did you mean test?"),
    (Norm, "batch", "x=batch must be one of BATCH, LAYER"),
    (dict[str, int] | None, {"a": 1, "b": "c"}, "x.b=c must be a whole number"),
    (tuple[int, int], [1], r"x=\[1\] must be 2 values"),
    (Annotated[int, Range("(0, inf)")] | None, 0, "x=0 must be above 0"),
    (Annotated[list[float], Range("[0, 1)")], [0, 1], r"x=\[0.0,1.0\] must lie in \[0, 1\)"),
    (Inner, {"angels": [1]}, "no setting 'x.angels'. Did you mean x.angles"),
]


def test_plain_values_become_what_the_signature_says_or_are_refused():
    for hint, value, expected in VALUES:
        found = typed(hint, value, "x")
        assert (found, type(found)) == (expected, type(expected))
    for hint, value, message in REFUSED:
        with pytest.raises(ConfigError, match=message):
            typed(hint, value, "x")


def test_what_a_function_makes_is_known_again():
    @component("encoder", "made")
    def made(size: int = 4):
        module = nn.Identity()
        module.component = None
        return module

    assert make("encoder", "made", size=8).component == Component(
        "encoder", "made", {"size": 8}, "own 0.1"
    )
    component("protocol", "made")(lambda points=8: Inner())
    assert make("protocol", "made").component.settings == {"points": 8}, "not only in commands"
    component("protocol", "other")(lambda: {})
    assert make("protocol", "other") == {}, "its kind is looked at elsewhere"
    with pytest.raises(ConfigError, match="no encoder 'maed'"):
        find("encoder", "maed", "own 0.1")  # the package is here


def test_what_no_file_can_hold_is_no_setting_and_what_would_be_lost_is_refused():
    @component("encoder", "loose")
    class Loose(nn.Module):
        def __init__(self, sizes: list[int] = [8, 1], act: type = nn.ReLU, **more: int):  # noqa: B006
            super().__init__()
            sizes.pop()

    assert list(settings_of(Loose)) == ["sizes"]
    assert Loose([4, 2]).component.settings == {"sizes": [4, 2]}
    with pytest.raises(ConfigError, match=r"encoder loose: what is given by \*more"):
        Loose(width=3)


def test_a_namesake_of_another_package_is_warned_of(caplog):
    patches()
    Component("encoder", "patches", {}, "own 0.2").build(image_size=(48, 64))
    assert not caplog.records
    Component("encoder", "patches", {}, "other 1.0").build(image_size=(48, 64))
    assert "came from other 1.0; that of own 0.1 is taken" in caplog.text


def test_mistakes_are_named_with_the_way_out():
    patches()
    zero = Component("encoder", "patches", {"size": 0}, where="encoder")
    for call, message in (
        (lambda: find("encoder", "patchs"), r"no encoder 'patchs'\. Did you mean patches\?"),
        (lambda: zero.build(image_size=(48, 64)), r"encoder\.size=0 must be above 0"),
        (lambda: find("encoder", "tiny", "other 1.0"), r"comes from other 1\.0, which is not here"),
        (lambda: component("encoder", "mobilenet")(Base), "'mobilenet' of .* is taken by ffd_l"),
        (lambda: component("encoders", "x")(Base), "no kind 'encoders'"),
    ):
        with pytest.raises(ConfigError, match=message):
            call()


def test_ours_stay_ours_where_a_plugin_imports_them_first(tmp_path):
    (tmp_path / "early.py").write_text("from ffd_lightning.evaluation.protocols import paper\n")
    code = """from ffd_lightning import components
components.load_plugins(["early"])
assert components.provider("protocol", "paper") == "ffd_lightning"
"""
    done = python("-c", code, folder=tmp_path)
    assert done.returncode == 0, done.stderr


def test_what_a_script_registers_is_its_own(monkeypatch):
    monkeypatch.setattr(components, "_provider", "")
    patches()
    assert components.provider("encoder", "patches") == f"module {__name__}"


def test_an_error_in_a_module_of_ones_own_names_file_and_line(tmp_path, monkeypatch):
    (tmp_path / "broken_module.py").write_text("import math\n\nmath.nothing\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ConfigError, match=r"AttributeError: .*\(.*broken_module\.py:3\)"):
        components.load_plugins(["broken_module"])
    sys.modules.pop("broken_module", None)
