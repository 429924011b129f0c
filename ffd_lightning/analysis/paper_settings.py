"""What the paper trained with, and in which settings runs of ours are not as it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import PurePath
from typing import Any

import yaml

from ffd_lightning.analysis.runs import select
from ffd_lightning.imaging.render_settings import CameraModel, RenderSettings

_PARTS = ("data", "split", "encoder", "selection")  # groups whose options have their own settings
_CAMERA = tuple(f"data.render.{name}" for name in ("camera", "elevation", "azimuths", "samples"))
_NOT_SET = "not set"
_NOT_THERE = "has no such setting"


@dataclass(frozen=True)
class PaperSettings:
    """What the paper trained with, by our names.

    Attributes:
        settings: of all runs, flat.
        regimes: of each regime, by its name, flat, without `regime.`.
        exempt: what is not compared, and all within it; a name with a dot at its end is a group's.
        always: in what all runs of ours differ.
    """

    settings: dict[str, Any]
    regimes: dict[str, dict[str, Any]]
    exempt: tuple[str, ...]
    always: tuple[str, ...]

    def is_exempt(self, key: str) -> bool:
        """Tell whether a setting is not compared."""
        return any(f"{key}.".startswith(f"{x.removesuffix('.')}.") for x in self.exempt)


@cache
def paper_settings() -> PaperSettings:
    """Return what the paper trained with."""
    file = files("ffd_lightning.analysis").joinpath("paper_settings.yaml")
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    exempt, always = (tuple(content[key]) for key in ("exempt", "always"))
    return PaperSettings(content["settings"], content["regimes"], exempt, always)


@dataclass(frozen=True)
class Comparison:
    """Runs beside the paper.

    Attributes:
        differences: a clause for each.
        compared: how many settings and facts were compared.
        equal: in how many of those all runs are as the paper.
    """

    differences: tuple[str, ...]
    compared: int
    equal: int


def compare(runs: Iterable[Mapping[str, tuple[str, str]]]) -> Comparison:
    """Merge what was compared of each run: by its name, our value and the paper's."""
    values: dict[str, dict[str, None]] = {}
    papers: dict[str, str] = {}
    for run in runs:
        for name, (ours, paper) in run.items():
            values.setdefault(name, {})[ours] = None
            papers[name] = paper
    differences = tuple(
        f"{name} is {' or '.join(ours)} (paper: {papers[name]})"
        for name, ours in values.items()
        if list(ours) != [papers[name]]
    )
    return Comparison(differences, len(values), len(values) - len(differences))


def compared_settings(settings: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Return all settings of a run that decide it, each with our value and the paper's, as text.

    Args:
        settings: as `config.yaml` has them, groups as dictionaries.
    """
    paper = paper_settings()
    own = {k: v for k, v in _flat(settings) if not paper.is_exempt(k)}
    regime = {k.removeprefix("regime."): own.pop(k) for k in list(own) if k.startswith("regime.")}
    name = str((settings.get("regime") or {}).get("name"))
    theirs = dict(paper.settings)
    if images_of_source(settings):  # then these do nothing
        for key in _CAMERA:
            own.pop(key, None)
            del theirs[key]
    elif own.get("data.render.elevation", 0) is None:
        own["data.render.elevation"] = _elevation(str(own["data.render.camera"]))
    if own.get("encoder.weights") is not None:
        own["encoder.weights"] = PurePath(str(own["encoder.weights"])).name
    compared = _compared(own, theirs)
    if name not in paper.regimes:
        return compared | {f"regime {name}": (_list(_in_effect(regime)), "none of this name")}
    of_regime = _compared(_in_effect(regime), paper.regimes[name])
    return compared | {f"regime {name}: {key}": pair for key, pair in of_regime.items()}


def images_of_source(settings: Mapping[str, Any]) -> str:
    """Return whose images a run has that were not rendered here, "" where they were."""
    images = select(settings, "data.images")
    return "" if images in (None, "render") else str(images)


def _elevation(camera: str) -> float:
    """Return the elevation that a camera has unless told otherwise, in degrees."""
    (usual,) = RenderSettings(camera=CameraModel(camera)).cameras()
    return round(usual.elevation, 2)


def _compared(own: Mapping[str, Any], paper: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Return our value and the paper's of all settings that either has.

    What only one option of a group can be told goes without a line where the paper has another
    option: the line about the options tells our settings.
    """
    foreign = [g for g in _PARTS if own.get(f"{g}.name") != paper.get(f"{g}.name")]
    result = {}
    for key in dict.fromkeys((*paper, *own)):
        group, _, last = key.partition(".")
        alone, absent = key not in paper, key not in own
        if group in foreign and last != "name" and (alone or (absent and "." not in last)):
            continue
        ours = _NOT_SET if absent else _text(own[key])
        if group in foreign and last == "name":
            further = {k: v for k, v in own.items() if k.startswith(f"{group}.")}
            told = {k.partition(".")[2]: v for k, v in further.items() if k not in paper}
            ours += f" with {_list(told)}" if told else ""
        result[key] = ours, _NOT_THERE if alone else _text(paper[key])
    return result


def _in_effect(regime: Mapping[str, Any]) -> dict[str, Any]:
    """Return a regime's settings without terms of weight 0, which are watched only."""
    unused = [key for key, value in regime.items() if key.endswith(".weight") and not value]
    watched = tuple(key.removesuffix("weight") for key in unused)
    return {key: value for key, value in regime.items() if not key.startswith(watched)}


def _flat(node: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in node.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _list(values: Mapping[str, Any]) -> str:
    return ", ".join(f"{key}={_text(value)}" for key, value in values.items())


def _text(value: Any) -> str:
    """Return a value as it is compared and shown: numbers alike, whatever type they were read as.

    >>> _text(10000.0), _text(1e-4), _text([45.0]), _text(None), _text(False)
    ('10000', '0.0001', '[45]', 'null', 'false')
    """
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return f"{value:.10g}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(_text(x) for x in value)}]"
    return str(value)
