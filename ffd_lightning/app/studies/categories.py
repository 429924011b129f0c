"""Whether the categories of a study are there, before anything of it runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ffd_lightning.app.build import build_source, category_names
from ffd_lightning.app.checks import validate
from ffd_lightning.app.config import PrepareConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.studies.study import swept_values
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.source import Source
from ffd_lightning.errors import DataError

_ASKED = ("data", "category", "plugins", "paths")
_INSTEAD = {"cellphone": "telephone", "firearm": "rifle"}  # what 3D-R2N2's 13 have


def absent_categories(source: Source, names: Iterable[str]) -> list[str]:
    """Return the categories that a source does not have, in their order.

    Args:
        source: where shapes come from.
        names: the project's names, a data set's own, or synsets.

    Raises:
        DataError: the source is not what it should be.
    """
    there = set(source.categories())
    there |= {SYNSETS[name] for name in there & set(SYNSETS)}
    return [name for name in dict.fromkeys(names) if not {name, SYNSETS.get(name, name)} & there]


def say_absent(source: Source, absent: Sequence[str]) -> str:
    """Return absent categories with their synsets, and what the source has in their place."""
    listed = ", ".join(f"{n} ({SYNSETS[n]})" if n in SYNSETS else n for n in absent)
    there = source.categories()
    others = [_INSTEAD[n] for n in absent if _INSTEAD.get(n) in there]
    return listed + (f"; it has {' and '.join(others)} instead" if others else "")


def check_categories(sweeps: Iterable[Sequence[str]], config_dir: str | None = None) -> None:
    """Refuse a study of categories that its data does not have.

    Args:
        sweeps: what each of its stages gives to `train -m`.
        config_dir: a folder with options of the user's own.

    Raises:
        ConfigError: settings of the data that cannot work.
        DataError: some categories are not there; the message names them and the way out.
    """
    names: dict[str, None] = {}
    cfg, joint = None, False
    for sweep in sweeps:
        # Only what decides which categories of which data are wanted. Where data is swept too, jobs
        # speak for themselves.
        asked = [x for x in sweep if x.lstrip("+~").split("=")[0].split(".")[0] in _ASKED]
        if any(not x.startswith("category=") and len(swept_values(x)) > 1 for x in asked):
            continue
        rest = [x for x in asked if not x.startswith("category=")]
        chosen = [swept_values(x) for x in asked if x.startswith("category=")]
        for name in chosen[-1] if chosen else [None]:
            if cfg is None or name not in SYNSETS:  # composing takes most of a second
                own = [] if name is None else [f"category={name}"]
                cfg = _composed([*rest, *own], config_dir)
                names.update(dict.fromkeys(category_names(cfg)))
                joint |= bool(cfg.category.members)
            elif name is not None:
                names[name] = None
    if cfg is not None:
        _refuse_absent(build_source(cfg), cfg.data.name, list(names), joint)


def _composed(overrides: Sequence[str], config_dir: str | None) -> PrepareConfig:
    composed = compose_config("prepare", PrepareConfig, overrides, config_dir)
    cfg = typed_config(composed, PrepareConfig)
    validate(cfg)
    return cfg


def _refuse_absent(source: Source, data: str, names: Sequence[str], joint: bool) -> None:
    """Raise DataError where a source lacks some of these categories."""
    absent = absent_categories(source, names)
    if not absent:
        return
    left = [name for name in names if name not in absent]
    if not left:
        source.shape_ids(absent[0])  # raises, and says what there is
    way = f"leave them out with category={','.join(left)}" if left else "choose others"
    if joint and left:  # a category of the user's would take the place of the joint one too
        way = (
            "give a copy of the study's file that leaves them out, in category, category.members "
            "and the numbers of templates"
        )
    raise DataError(
        f"data={data} lacks {len(absent)} of the study's {len(names)} categories: "
        f"{say_absent(source, absent)}. Nothing has run yet: {way}"
    )
