"""Categories and their ShapeNet v1 synsets."""

import json
from collections.abc import Iterable
from importlib.resources import files

PAPER_CATEGORIES: dict[str, str] = {
    "plane": "02691156",
    "bench": "02828884",
    "cabinet": "02933112",
    "car": "02958343",
    "cellphone": "02992529",
    "chair": "03001627",
    "monitor": "03211117",
    "lamp": "03636649",
    "speaker": "03691459",
    "firearm": "03948459",
    "sofa": "04256520",
    "table": "04379243",
    "watercraft": "04530566",
}
"""The paper's 13. Its firearms are pistols: a slip for rifles, by its authors' account."""

SYNSETS: dict[str, str] = PAPER_CATEGORIES | {"rifle": "04090263", "telephone": "04401088"}
"""The paper's, and the two that 3D-R2N2 and others have for its firearms and cellphones."""

ANY = "any"
"""Stands for the category of a template that may be of any."""

_NAMES = {synset: name for name, synset in SYNSETS.items()}


def name_of(synset: str) -> str:
    """Return the project's name of a synset; what has none, as it is."""
    return _NAMES.get(synset, synset)


def members(categories: Iterable[str], category: str) -> tuple[int, ...]:
    """Return which of some templates a category selects from: its own, and those of `ANY`.

    >>> members(["chair", "table", "any"], "chair")
    (0, 2)
    >>> members(["chair", "table", "any"], "any")
    (0, 1, 2)
    """
    return tuple(k for k, own in enumerate(categories) if ANY in (own, category) or own == category)


def listed(synsets: Iterable[str]) -> str:
    """Return synsets as text, by name where they have one: "chair (03001627), other (...)"."""
    return ", ".join(f"{_NAMES.get(s, 'other')} ({s})" for s in synsets)


def paper_templates(category: str) -> tuple[str, ...]:
    """Return the 30 ids of ShapeNet v1 that the paper's authors took as templates, () for others.

    Source: the lists released with the authors' code.
    """
    text = files("ffd_lightning.data").joinpath("paper_templates.json").read_text(encoding="utf-8")
    return tuple(json.loads(text).get(SYNSETS.get(category, category), ()))
