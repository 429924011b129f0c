"""What a network starts from, and whether a run is tested on shapes that trained it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ffd_lightning import components
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.checkpoint import load_weights, read_checkpoint
from ffd_lightning.components import Component
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.inference.predictor import checkpoint_of
from ffd_lightning.nn.encoders.base import ImageEncoder
from ffd_lightning.nn.network import TemplateFfdNetwork
from ffd_lightning.pretrained import pretrained_model
from ffd_lightning.terminal import counted

EMBEDDED = "embedded"


def load_first_weights(encoder: ImageEncoder, weights: str) -> None:
    """Give an encoder the weights that `encoder.weights` names; embedded are the package's."""
    if weights != EMBEDDED:
        if weights != "none":
            encoder.load_weights(weights)
        return
    content = read_checkpoint(pretrained_model())
    there, asked = Component(**content["model"]["encoder"]), encoder.component
    if asked is None or (there.name, there.settings) != (asked.name, asked.settings):
        own = " ".join(f"encoder.{key}={value}" for key, value in there.settings.items())
        raise ConfigError(
            f"encoder.weights=embedded is of encoder={there.name} {own}: leave encoder.weights out"
        )
    problem = load_weights(encoder, content, "network.encoder.")
    assert not problem, problem


def load_network_weights(network: TemplateFfdNetwork, weights: str) -> None:
    """Give a network the weights that `network.weights` names.

    Raises:
        ConfigError: there is no such run or checkpoint, or it is of another network.
    """
    if reason := load_weights(network, read_checkpoint(_network_file(weights))):
        raise ConfigError(
            f"network.weights={weights} is of another network ({reason}): encoder, heads and "
            "network.* must be as they were, and images from one side or from several, as they "
            "were (embedded: data.render.random_views=8)"
        )


def _network_file(weights: str) -> Path:
    return checkpoint_of(None if weights == EMBEDDED else weights)


def leak_warning(
    cfg: TrainConfig, tested: Sequence[str], twins: Mapping[str, Mapping[str, str]] = {}
) -> str:
    """Say how many shapes to test on the first weights were trained or validated on, "" for none.

    Where a run is scored on validation shapes, those that only validated the weights do not count.

    They are known again by their ids, where the data is of the same name and seed. Templates of a
    network that is not told them do not count: it was never shown images of them.

    Args:
        cfg: of the run that is to start.
        tested: ids of the shapes that it is scored on.
        twins: of each of its categories, see `data.twins`: copies count like the shapes themselves.
    """
    weights = cfg.network.weights
    if weights is None and cfg.encoder.first_weights != EMBEDDED:
        return ""
    model = read_checkpoint(_network_file(weights or EMBEDDED))["model"]
    before = model["record"].get("settings", {})
    ours = {"name": cfg.data.name, "seed": cfg.data.settings.get("seed")}
    if ours != {name: before.get(f"data.{name}") for name in ours}:
        return ""
    names = cfg.category.members or [cfg.category.name]
    prefix = f"{names[0]}/" if len(names) == 1 else ""  # ids of several have their own
    first = {f"{name}/{i}": f"{name}/{j}" for name in twins for i, j in twins[name].items()}
    try:
        known = {first.get(i, i) for i in _seen(cfg, model, before, twins)}
    except UserError as error:  # its data is elsewhere
        return f"whether shapes to test on trained the first weights is not known: {error}"
    seen = [i for i in tested if first.get(f"{prefix}{i}", f"{prefix}{i}") in known]
    if not seen:
        return ""
    said = "encoder.weights=embedded" if weights is None else f"network.weights={weights}"
    split = {key: value for key, value in before.items() if key.startswith("split.")}
    split["split"] = split.pop("split.name")
    return (
        f"of {counted(len(tested), 'shape')} to test on, {len(seen)} trained or validated the "
        f"weights that this run starts from ({said}), or are near copies of shapes that did: its "
        "scores will be too good. Split as they did "
        f"({' '.join(f'{key}={value}' for key, value in split.items())}), or train from scratch "
        "(encoder.weights=none)"
    )


def _seen(
    cfg: TrainConfig,
    model: Mapping[str, Any],
    settings: Mapping[str, Any],
    twins: Mapping[str, Mapping[str, str]],
) -> set[str]:
    """Return the shapes, `<category>/<id>`, that a model was trained or validated on."""
    from ffd_lightning.data.splits import SplitInput, make_split

    def made(kind: str, group: str, ours: Component) -> Any:
        name = settings[f"{group}.name"]
        given = dict(ours.settings) if ours.name == name else {}  # a record has no paths
        keys = {key: f"{group}.{key}" for key in components.settings(kind, name)}
        given |= {k: settings[v] for k, v in keys.items() if v in settings}
        return components.make(kind, name, **given)

    source, rule = made("source", "data", cfg.data), made("split", "split", cfg.split)
    seen: set[str] = set()
    for category in model["categories"]:
        ids, alike = tuple(source.shape_ids(category)), twins.get(category, {})
        subsets = rule(SplitInput(category, ids, (), source.split(category), alike))
        split = make_split(ids, subsets, settings["split.val_fraction"], alike)
        chosen = split.val if cfg.evaluation.subset == "test" else ()  # by the validation
        seen |= {f"{category}/{shape_id}" for shape_id in (*split.train, *chosen)}
    own = f"{model['categories'][0]}/" if len(model["categories"]) == 1 else ""
    templates = {f"{own}{i}" for i in model["templates"]["ids"]}
    return seen if "template_codes" in model else seen - templates
