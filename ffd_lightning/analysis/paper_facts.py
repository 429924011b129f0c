"""What results say of their data and of how they were measured, beside what the paper did."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from ffd_lightning.analysis.paper_settings import images_of_source
from ffd_lightning.analysis.runs import COLUMN_KEYS, described_protocols, select
from ffd_lightning.data.categories import paper_templates
from ffd_lightning.evaluation.protocols import PROTOCOLS, ProtocolDescription
from ffd_lightning.run_folder import RunFolder

PROTOCOL = "paper"
_UNKNOWN = "not recorded"
_RENDERED = ("procedural", "folder")  # sources that bring no images of their own
_SHAPENET_V1 = {
    "plane": "4,050",
    "bench": "1,820",
    "cabinet": "1,570",
    "car": "7,500",
    "cellphone": "530",
    "chair": "6,780",
    "monitor": "1,100",
    "lamp": "2,320",
    "speaker": "1,620",
    "firearm": "310",
    "sofa": "3,170",
    "table": "8,510",
    "watercraft": "1,940",
}
"""Shapes of each of the paper's categories in the authors' lists of ShapeNetCore v1, rounded."""


def compared_facts(run: RunFolder) -> dict[str, tuple[str, str]]:
    """Return image source and measuring of a run, each with our value and the paper's.

    Of ShapeNet also the version; another data set is a setting.
    """
    settings = run.settings
    facts = {
        "the image source": (_images(settings), "the authors' renderings, by Blender"),
        "the protocol": _protocol(run),
    }
    if select(settings, "data.name") == "shapenet":
        facts["ShapeNet's version"] = _version(run), "1"
    return facts


def template_differences(runs: Sequence[RunFolder]) -> list[str]:
    """Return how the templates of runs differ from the paper's lists, a clause for all categories.

    [] where all have the paper's 30 of their category.
    """
    told: dict[str, None] = {}
    for run in runs:
        ids = run.data.get("templates") or (_summary(run).get("settings") or {}).get("templates")
        category = _category(run)
        paper = set(paper_templates(category))
        if ids is None:
            told[f"{category} {_UNKNOWN}"] = None
        elif set(ids) != paper:
            told[f"{category} {len(ids)}, of which {len(paper & set(ids))} are the paper's"] = None
    return [f"the templates are not the paper's 30 ({'; '.join(told)})"] if told else []


def shape_numbers(runs: Sequence[RunFolder]) -> str:
    """Return how many shapes runs were trained, validated and tested on: a clause."""
    told: dict[str, None] = {}
    for run in runs:
        category, shapes = _category(run), run.data.get("shapes")
        if shapes is None:
            numbers = _UNKNOWN
        else:
            numbers = " + ".join(f"{shapes[name]:,}" for name in ("train", "val", "test"))
        there = _SHAPENET_V1.get(category)
        told[f"{category} {numbers}" + (f" (about {there})" if there else "")] = None
    return (
        "the paper does not print its numbers of shapes; ours, trained on + validated on + tested "
        f"on, in brackets all of ShapeNet v1: {'; '.join(told)}"
    )


def tested(run: RunFolder) -> bool:
    """Tell whether a run has results of the test shapes under the paper's protocol."""
    return PROTOCOL in described_protocols(run)


def _category(run: RunFolder) -> str:
    return str(select(run.settings, COLUMN_KEYS["category"]))


def _summary(run: RunFolder) -> dict[str, Any]:
    """Return all of a run's `summary.json`, {} where there is none or it is damaged."""
    try:
        file = run.evaluation(PROTOCOL) / "summary.json"
        return dict(json.loads(file.read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


def _version(run: RunFolder) -> str:
    """Return which ShapeNetCore a run was trained on."""
    sources = (run.data.get("sources") or {}).values()
    versions = dict.fromkeys(str(source.get("version", _UNKNOWN)) for source in sources)
    return " and ".join(versions) or _UNKNOWN


def _images(settings: Mapping[str, Any]) -> str:
    """Return where the images of a run come from."""
    if whose := images_of_source(settings):
        return f"{whose}, with cameras of its own"
    name, kind = (select(settings, f"data.{key}") for key in ("name", "images"))
    return "this package's renderer" if kind or name in _RENDERED else f"that of data={name}"


def _protocol(run: RunFolder) -> tuple[str, str]:
    """Return what a run was measured by, and what `protocol=paper` means by default."""
    found, default = described_protocols(run)[PROTOCOL], ProtocolDescription.of(PROTOCOLS[PROTOCOL])
    changed = found.note == default.note and found.measures != default.measures
    other = ", of another version" if changed else ""
    return found.note + other, default.note
