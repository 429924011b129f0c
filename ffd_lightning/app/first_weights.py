"""What an encoder starts from, and whether a run is tested on shapes that trained it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ffd_lightning import components
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.errors import ConfigError
from ffd_lightning.pretrained import pretrained_model

if TYPE_CHECKING:
    from ffd_lightning.nn.encoders.base import ImageEncoder

KERAS_FILES: dict[float, str] = {
    0.25: "mobilenet_2_5_192_tf_no_top.h5",
    0.5: "mobilenet_5_0_192_tf_no_top.h5",
    0.75: "mobilenet_7_5_192_tf_no_top.h5",
    1.0: "mobilenet_1_0_192_tf_no_top.h5",
}
"""Keras' published ImageNet weights by width, of images of 192 x 192; the paper's is the first."""

KERAS_ADDRESS = "https://github.com/fchollet/deep-learning-models/releases/download/v0.6/"
"""Where they are; a file's name follows."""


def load_first_weights(encoder: ImageEncoder, weights: str) -> None:
    """Give an encoder the weights that `encoder.weights` names."""
    if weights == "embedded":
        encoder.load_state_dict(_embedded(encoder))
    elif weights != "none":
        encoder.load_weights(weights)


def _embedded(encoder: ImageEncoder) -> dict[str, Any]:
    """Return the weights of the encoder of the trained model that comes with the package."""
    from ffd_lightning.checkpoint import encoder_component, read_checkpoint

    try:
        content = read_checkpoint(pretrained_model())
    except ConfigError:
        raise ConfigError(
            "encoder.weights=embedded: this installation has no trained model: leave it out"
        ) from None
    there, asked = encoder_component(content["model"]), encoder.component
    recorded = (there.name, dict(there.settings)) if there else ("", {})
    if asked is None or recorded != (asked.name, dict(asked.settings)):
        own = " ".join(f"encoder.{key}={value}" for key, value in recorded[1].items())
        raise ConfigError(
            f"encoder.weights=embedded is of encoder={recorded[0]} {own}: leave encoder.weights out"
        )
    weights, prefix = content["state_dict"], "network.encoder."
    return {k.removeprefix(prefix): v for k, v in weights.items() if k.startswith(prefix)}


def unsaid_problem(cfg: Any) -> str:
    """Return what the paper's schedule lacks: first weights, or the word that none are meant.

    The paper's networks start from ImageNet weights, which this package does not bring.
    """
    encoder = cfg.encoder
    if cfg.schedule.name != "paper" or encoder.name != "mobilenet" or encoder.weights is not None:
        return ""
    width = encoder.settings["width"]
    if width in KERAS_FILES:
        file = KERAS_FILES[width]
        ask = f"give Keras' file, encoder.weights={file} ({KERAS_ADDRESS}{file})"
    else:
        ask = f"Keras publishes none of width {width:g}: encoder.weights=FILE takes yours"
    return (
        f"schedule=paper starts from ImageNet weights, as the paper does: {ask}, or train from "
        "scratch with encoder.weights=none"
    )


def leak_warning(cfg: TrainConfig, tested: Sequence[str]) -> str:
    """Say how many test shapes the first weights were trained or validated on, "" for none.

    They are known again by their ids, where the data is of the same name and seed. Templates of the
    network that the weights are from do not count: it was never shown images of them.
    """
    from ffd_lightning.checkpoint import read_checkpoint

    if cfg.encoder.first_weights != "embedded":
        return ""
    model = read_checkpoint(pretrained_model())["model"]
    before = model["record"]["settings"]
    ours = {"name": cfg.data.name, "seed": cfg.data.settings.get("seed")}
    if ours != {name: before.get(f"data.{name}") for name in ours}:
        return ""
    prefix = "" if cfg.category.members else f"{cfg.category.name}/"
    seen = {f"{prefix}{shape_id}" for shape_id in tested} & _seen(model, before)
    if not seen:
        return ""
    split = {key: value for key, value in before.items() if key.startswith("split.")}
    split["split"] = split.pop("split.name")
    return (
        f"of {len(tested)} shapes to test on, {len(seen)} trained or validated the weights that "
        "this run starts from (encoder.weights=embedded): its scores will be too good. Split as "
        f"they did ({' '.join(f'{key}={value}' for key, value in split.items())}), or train from "
        "scratch (encoder.weights=none)"
    )


def _seen(model: Mapping[str, Any], settings: Mapping[str, Any]) -> set[str]:
    """Return the shapes, `<category>/<id>`, that a model was trained or validated on."""
    from ffd_lightning.data.splits import SplitInput, make_split

    def made(kind: str, group: str) -> Any:
        name = settings[f"{group}.name"]
        keys = {key: f"{group}.{key}" for key in components.settings(kind, name)}
        own = {k: settings[v] for k, v in keys.items() if v in settings}
        return components.make(kind, name, **own)

    source, rule, seen = made("source", "data"), made("split", "split"), set()
    for category in model["categories"]:
        ids = tuple(source.shape_ids(category))
        subsets = rule(SplitInput(category, ids, (), source.split(category)))
        split = make_split(ids, subsets, settings["split.val_fraction"])
        seen |= {f"{category}/{shape_id}" for shape_id in (*split.train, *split.val)}
    return seen - set(model["templates"]["ids"])
