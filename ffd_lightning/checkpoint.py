"""Checkpoints: one file that works alone, whoever trained it.

Beside Lightning's own entries it holds `model`: what its network was built from, by name and
settings, the templates, and how its training images were rendered. It loads with `weights_only`, so
no code of its own is ever run.
"""

from __future__ import annotations

import copy
import io
import pickle
import re
import warnings
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from jaxtyping import Float
from torch import Tensor, nn

from ffd_lightning.components import Component
from ffd_lightning.data.categories import ANY, members
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError, is_of_machine
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.nn import consensus
from ffd_lightning.nn.network import TemplateFfdNetwork, shrunk_size

if TYPE_CHECKING:  # Lightning takes a second to load: inference does without
    from ffd_lightning.data.datamodule import FfdDataModule

_ENTRY = "model"


@dataclass(frozen=True)
class TrainedModel:
    """What a checkpoint holds.

    Attributes:
        network: with the checkpoint's weights, in evaluation mode, on the CPU.
        bank: its templates.
        object_fill: how large objects are in its training images, see `object_fill` of
            `imaging.framing`.
        render: size and cameras of those.
        categories: that it was trained on.
        record: what its training says of itself: plain values by name.
        step: of the training.
        own_images: whether its training images came with the data, so `render` says nothing of
            their cameras.
    """

    network: TemplateFfdNetwork
    bank: TemplateBank
    object_fill: float
    render: RenderSettings
    categories: tuple[str, ...]
    record: dict[str, Any]
    step: int
    own_images: bool = False

    @property
    def only_camera(self) -> Camera | None:
        """The camera of all training images; None where there are several, or nobody knows."""
        return None if self.own_images else self.render.only_camera

    @property
    def views(self) -> str:
        """From where the training images were taken, in words."""
        return "the data's own" if self.own_images else self.render.views

    @property
    def template_categories(self) -> tuple[str, ...]:
        """The category of each of the T templates: `<category>/<id>` where there are several.

        Templates of which that is not known are of `ANY`.
        """
        if len(self.categories) == 1:
            return self.categories * len(self.bank)
        own = (shape_id.rpartition("/")[0].partition("/")[0] for shape_id in self.bank.ids)
        return tuple(name if name in self.categories else ANY for name in own)

    def with_codes(
        self, bank: TemplateBank, codes: Float[Tensor, "templates code"], beside: bool = False
    ) -> TrainedModel:
        """Return the same network with other templates, which conditioned heads are told.

        Args:
            bank: the templates.
            codes: of each, as the network makes them (`TemplateFfdNetwork.codes`).
            beside: the network's own templates stay, but for those of the same ids.

        Raises:
            ConfigError: the heads know no other templates than those of their training; or the
                templates have lattices of other degrees.
            ValueError: the codes are of another number of templates.
        """
        self.check_conditioned()
        if bank.degrees != self.bank.degrees:
            raise ConfigError(f"templates of degrees {bank.degrees}: use {self.bank.degrees}")
        if len(codes) != len(bank):
            raise ValueError(f"{len(codes)} codes of {len(bank)} templates")
        if beside:
            kept = [k for k, name in enumerate(self.bank.ids) if name not in bank.ids]
            own = self.network.template_codes[kept]
            codes = torch.cat([own, codes.to(own)])
            bank = self.bank.joined(kept, bank)
        network = copy.deepcopy(self.network)
        strangers = network.strangers if beside else True
        network.use_templates(codes, bank.sample(consensus.POINTS), strangers)
        return replace(self, network=network, bank=bank)

    def check_conditioned(self) -> None:
        """Make sure that the network can be told templates.

        Raises:
            ConfigError: it knows no other templates than those of its training.
        """
        if not self.network.heads.conditioned:
            raise ConfigError(
                "this network knows the templates of its training only (heads=per_template): "
                "train one with heads=conditioned to give it others"
            )

    def templates_of(self, category: str) -> tuple[int, ...]:
        """Return the indices of a category's templates, and of those of `ANY`.

        Raises:
            ConfigError: the model does not know the category, or has no templates of it.
        """
        if category not in {*self.categories, *self.template_categories}:
            known = ", ".join(self.categories)
            raise ConfigError(f"category={category}: the model was trained on {known}")
        categories = self.template_categories
        if category not in categories:
            raise ConfigError(
                f"category={category}: none of these templates is known to be of it; leave "
                "category= out"
            )
        return members(categories, category)


def model_entry(
    network: TemplateFfdNetwork, data: FfdDataModule, record: Mapping[str, Any]
) -> dict[str, dict[str, Any]]:
    """Return what a checkpoint needs beside the weights, for `load_model`."""
    content: dict[str, Any] = {
        "network": network.description(),
        "encoder": storable("the encoder", _named(network.encoder.component)),
        "heads": _named(network.made_of),
        "templates": data.bank.state(),
        "object_fill": data.object_fill,
        "render": asdict(data.render),
        "own_images": any(p.source.own_images for p in data.preparations),
        "categories": list(data.categories),
        "record": storable("the module's record", dict(record)),
    }
    if network.heads.conditioned:
        data.give_templates(network)
        content["template_codes"] = network.template_codes
        content["one_camera"] = network.projection is not None
    return {_ENTRY: content}


def _named(made_of: Component | None) -> dict[str, Any] | None:
    names = ("kind", "name", "settings", "provider")
    return None if made_of is None else {name: getattr(made_of, name) for name in names}


def storable(name: str, entry: Any) -> Any:
    """Return an entry of a checkpoint that can be read again, NumPy's numbers as Python's.

    Raises:
        ConfigError: it holds other things than tensors and plain values.
    """
    entry, file = _plain_numbers(entry), io.BytesIO()
    try:
        torch.save(entry, file)
        file.seek(0)
        torch.load(file, weights_only=True)
    except (TypeError, AttributeError, RuntimeError, pickle.PickleError) as error:
        found = re.search(r"GLOBAL (\S+)", str(error))
        what = f"an object of {found[1]}" if found else str(error).split("\n")[0]
        raise ConfigError(
            f"the state of {name} cannot be kept in a checkpoint, which holds tensors and plain "
            f"values only: {what}"
        ) from None
    return entry


def _plain_numbers(entry: Any) -> Any:
    if isinstance(entry, np.generic):
        return entry.item()
    if type(entry) is dict:
        return {key: _plain_numbers(value) for key, value in entry.items()}
    return type(entry)(map(_plain_numbers, entry)) if type(entry) in (list, tuple) else entry


def load_model(checkpoint: Path) -> TrainedModel:
    """Load a checkpoint, which needs nothing else.

    Raises:
        ConfigError: there is no such file, it is of another version, or its encoder is no component
            or of a package that is not here.
        DataError: it is damaged.
    """
    state = read_checkpoint(checkpoint)
    if _ENTRY not in state or "network" not in state[_ENTRY]:
        raise ConfigError(
            f"the checkpoint {checkpoint} holds no templates: an earlier version made it, or "
            "it was trained without FfdDataModule. The command of its training, with restart=true, "
            "trains it again"
        )
    content = state[_ENTRY]
    try:
        bank = TemplateBank.from_state(content["templates"])
        fill = float(content["object_fill"])
        render = RenderSettings(**content["render"])
        categories, record = tuple(content["categories"]), dict(content["record"])
        encoder = None if content["encoder"] is None else Component(**content["encoder"])
        sizes = {**content["network"], "heads": Component(**content["heads"])}
        sizes["image_size"] = tuple(sizes["image_size"])
    except Exception as error:  # whatever a file of another version lacks
        reason = str(error).split("\n")[0]
        raise ConfigError(
            f"the checkpoint {checkpoint} is of another version or damaged ({reason})"
        ) from None
    if encoder is None:
        raise ConfigError(
            f"the encoder of {checkpoint} is no component, so nobody can build it again: put "
            "@component('encoder', NAME) above its class, and train again"
        )
    seen = shrunk_size(sizes["image_size"], sizes.get("shrink", 1))
    with torch.random.fork_rng(devices=[]):  # first weights draw, and are replaced
        built = encoder.build(image_size=seen, batch_norm_momentum=0.1)
        network = TemplateFfdNetwork(built, **sizes)
    if reason := load_weights(network, state):
        raise ConfigError(f"the checkpoint {checkpoint} is of another network ({reason})")
    if "template_codes" in content:
        codes, strangers = content["template_codes"], content.get("strangers", False)
        network.use_templates(codes, bank.sample(consensus.POINTS), strangers)
        camera = render.only_camera if content.get("one_camera") else None
        network.projection = None if camera is None else camera.projection
    step = int(state["global_step"])
    own = content.get("own_images", False)
    return TrainedModel(network.eval(), bank, fill, render, categories, record, step, own)


def load_weights(module: nn.Module, state: Mapping[str, Any], part: str = "network.") -> str:
    """Give a module its weights of a checkpoint's content; return what does not fit, or ""."""
    weights = state["state_dict"].items()
    try:
        module.load_state_dict({k.removeprefix(part): v for k, v in weights if k.startswith(part)})
    except RuntimeError as error:
        return str(error).split("\n\t")[1 if "\n\t" in str(error) else 0]
    return ""


def read_checkpoint(checkpoint: Path) -> dict[str, Any]:
    """Return what a checkpoint file holds, tensors on the CPU; no code in it is run.

    Raises:
        ConfigError: there is no such file.
        DataError: it is damaged.
    """
    try:
        with warnings.catch_warnings():
            # Of what may be wrong with a file that is no checkpoint.
            warnings.simplefilter("ignore")
            state: dict[str, Any] = torch.load(checkpoint, map_location="cpu", weights_only=True)
        int(state["global_step"]), dict(state["state_dict"])
        return state
    except FileNotFoundError:
        raise ConfigError(
            f"there is no checkpoint {checkpoint}: name another, or train its run (with "
            "restart=true if that is finished)"
        ) from None
    except Exception as error:  # unpickling meets anything in a damaged file
        if is_of_machine(error):
            raise ConfigError(f"the checkpoint {checkpoint} cannot be read: {error}") from None
        raise DataError(
            f"the checkpoint {checkpoint} is damaged or no checkpoint: take another, or train its "
            "run with restart=true"
        ) from None
