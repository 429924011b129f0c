"""Whether a run is tested on shapes that trained the weights it starts from."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from ffd_lightning import registry
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.checkpoint import read_checkpoint
from ffd_lightning.data.splits import SplitInput, make_split


def leak_warning(cfg: TrainConfig, tested: Sequence[str]) -> str:
    """Say how many test shapes the first weights were trained or validated on, "" for none.

    They are known again by their ids, where the data is of the same name and seed. Templates of the
    network that the weights are from do not count: it was never shown images of them.

    Args:
        cfg: of the run.
        tested: ids of the shapes that it is tested on, as its data module names them.
    """
    encoder = registry.get("encoder", cfg.encoder.name).own_settings(cfg.encoder)
    checkpoint = getattr(encoder, "checkpoint", lambda: None)()
    if checkpoint is None:
        return ""
    model = read_checkpoint(checkpoint)["model"]
    before = model["record"]["settings"]
    ours = {name: getattr(cfg.data, name, None) for name in ("name", "seed")}
    if ours != {name: before.get(f"data.{name}") for name in ours}:
        return ""
    prefix = "" if cfg.category.members else f"{cfg.category.name}/"
    ids = {f"{prefix}{shape_id}" for shape_id in tested}
    trained, validated = (len(ids & seen) for seen in _seen(model, before))
    if not trained + validated:
        return ""
    split = [f"split={before['split.name']}"]
    split += [f"split.{name}={value}" for name, value in _own("split", before).items()]
    return (
        f"of {len(ids)} shapes to test on, the weights that this run starts from "
        f"(encoder.weights={encoder.weights}) were trained on {trained} and validated on "
        f"{validated}: its scores will be too good. Split as they did ({' '.join(split)}), or "
        "train from scratch (encoder.weights=none)"
    )


def _seen(model: Mapping[str, Any], settings: Mapping[str, Any]) -> tuple[set[str], set[str]]:
    """Return the shapes that a model was trained and validated on: `<category>/<id>`.

    Both follow from the settings that it records, as any run's do.
    """
    source = registry.part("source", settings["data.name"], **_own("source", settings))
    rule = registry.part("split", settings["split.name"], **_own("split", settings))
    train, val = set(), set()
    for category in model["categories"]:
        ids = tuple(source.shape_ids(category))
        subsets = rule(SplitInput(category, ids, (), source.split(category)))
        split = make_split(ids, subsets, settings["split.val_fraction"])
        train |= {f"{category}/{shape_id}" for shape_id in split.train}
        val |= {f"{category}/{shape_id}" for shape_id in split.val}
    templates = set(model["templates"]["ids"])
    return train - templates, val - templates


def _own(kind: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    """Return a part's own settings out of all."""
    group = {"source": "data"}.get(kind, kind)
    fields = dataclasses.fields(registry.get(kind, settings[f"{group}.name"]).settings)
    return {f.name: settings[f"{group}.{f.name}"] for f in fields}
