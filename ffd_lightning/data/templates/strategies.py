"""Choosing templates from a prepared set."""

from __future__ import annotations

import csv
import logging
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np
import torch

from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.chamfer import chamfer_distance

log = logging.getLogger(__name__)

_CANDIDATES = 1000
_SPREAD = 16
_CANDIDATE_POINTS = 256

TemplateStrategy = Callable[[PreparedSet, int], Sequence[str]]
"""From a prepared set of one category, and how many are wanted, to as many ids of it."""


def choose_templates(
    strategy: TemplateStrategy, prepared: PreparedSet, count: int
) -> tuple[str, ...]:
    """Choose template ids from a prepared set, and check what was chosen.

    Args:
        strategy: how to choose.
        prepared: the shapes to choose from.
        count: how many, T.

    Raises:
        ConfigError: the strategy cannot choose so many, or chose what the set does not hold.
        DataError: fewer shapes than templates.
    """
    if count > len(prepared):
        raise DataError(
            f"{count} templates asked for, but {prepared.path} holds only {len(prepared)} shapes: "
            "choose fewer (templates=t1 ... t30) or prepare more shapes"
        )
    chosen = strategy(prepared, count)
    if not isinstance(chosen, Iterable):
        raise ConfigError(
            f"the template strategy must choose {count} shapes of the set, and gives a "
            f"{type(chosen).__name__}"
        )
    ids = tuple(chosen)
    unknown = sorted(set(ids) - set(prepared.ids))
    if unknown or len(set(ids)) != count:
        wrong = f"{unknown[0]!r} is not in {prepared.path}" if unknown else f"{len(set(ids))} ids"
        raise ConfigError(f"the template strategy must choose {count} shapes of the set: {wrong}")
    return ids


class RandomStrategy:
    """Draws templates.

    Args:
        seed: decides which.
    """

    def __init__(self, seed: int = 0) -> None:
        self.seed = seed

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """See `TemplateStrategy`."""
        order = np.random.default_rng(self.seed).permutation(len(prepared))[:count]
        return tuple(prepared.ids[i] for i in order)


def diverse_templates(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Start at the most central shape, go on to whichever is farthest from all chosen.

    Distances are Chamfer distances. The first t of any larger choice are the choice of t.
    """
    return _farthest_points(prepared, count)


def paper_choice(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Take the first `count` of the paper's ids; for those that are absent, as `diverse` would.

    Raises:
        ConfigError: the paper has no templates for the category.
    """
    category = _category(prepared)
    known = paper_templates(category)
    if not known:
        raise ConfigError(
            f"template_strategy=paper: the paper has no templates for {category}; use diverse"
        )
    wanted, held = known[:count], set(prepared.ids)
    absent = [i for i in wanted if i not in held]
    if absent:
        log.warning(
            "%s lacks %d of the paper's %d templates, replaced by the shapes farthest from the "
            "others: %s",
            prepared.path,
            len(absent),
            len(wanted),
            ", ".join(absent),
        )
    return _farthest_points(prepared, count, [i for i in wanted if i in held])


def auto_choice(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Choose as `paper_choice` for ShapeNet's shapes, if the paper has templates, else diverse."""
    source = prepared.manifest["settings"]["source"]
    known = paper_templates(_category(prepared))
    of_shapenet = source.get("source") == "shapenet"
    return (paper_choice if known and of_shapenet else diverse_templates)(prepared, count)


class ListedStrategy:
    """Takes the first ids of a file, one a line; what follows a # is left out.

    Args:
        file: `{category}` in it stands for the set's category.
    """

    def __init__(self, file: str | Path) -> None:
        self.file = file

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """See `TemplateStrategy`.

        Raises:
            ConfigError: the file is missing, too short, or names shapes that the set lacks.
        """
        text = _read(self._path(prepared))
        return self._first(
            [line.split("#")[0].strip() for line in text.splitlines()], prepared, count
        )

    def _path(self, prepared: PreparedSet) -> Path:
        return Path(str(self.file).replace("{category}", _category(prepared))).expanduser()

    def _first(self, column: Sequence[str], prepared: PreparedSet, count: int) -> tuple[str, ...]:
        file = self._path(prepared)
        ids = list(dict.fromkeys(i for i in column if i))
        if len(ids) < count:
            raise ConfigError(
                f"template_strategy.file={file} lists {len(ids)} ids, {count} are needed"
            )
        unknown = sorted(set(ids[:count]) - set(prepared.ids))
        if unknown:
            raise ConfigError(
                f"template_strategy.file={file} names {len(unknown)} shapes that are not in "
                f"{prepared.path}, the first {unknown[0]!r}"
            )
        return tuple(ids[:count])


class RankingStrategy(ListedStrategy):
    """Takes the favourites of an earlier run: the first of its `template_ranking.csv`."""

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """See `ListedStrategy`."""
        file = self._path(prepared)
        rows = list(csv.DictReader(_read(file).splitlines()))
        if not rows or "id" not in rows[0]:
            raise ConfigError(
                f"template_strategy.file={file} has no column `id`: give a run's "
                "template_ranking.csv"
            )
        column = [(row["id"] or "").strip() for row in rows]  # None where a row is short
        return self._first(column, prepared, count)


def _read(file: Path) -> str:
    try:
        return file.read_text(
            encoding="utf-8-sig"
        )  # -sig: some editors put a byte order mark first
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"template_strategy.file={file} cannot be read: {error}") from None


def _category(prepared: PreparedSet) -> str:
    return str(prepared.manifest["settings"]["category"])


def _farthest_points(
    prepared: PreparedSet, count: int, first: Sequence[str] = ()
) -> tuple[str, ...]:
    """Farthest-point choice under Chamfer distance, among `_CANDIDATES` shapes of a larger set.

    It begins with the shapes `first`, or with the most central one.
    """
    if len(first) >= count:
        return tuple(first[:count])
    size = min(len(prepared), max(_CANDIDATES, count))
    given = [prepared.index(i) for i in first]
    candidates = np.union1d(np.linspace(0, len(prepared) - 1, size).astype(int), given).astype(int)
    points = torch.from_numpy(
        np.stack([prepared.cloud(int(i), _CANDIDATE_POINTS) for i in candidates])
    )
    chosen = np.searchsorted(candidates, given).tolist()
    if not chosen:
        # The most central shape: the least total distance to a spread of others.
        spread = points[np.linspace(0, len(points) - 1, min(len(points), _SPREAD)).astype(int)]
        chosen = [
            int(torch.stack([chamfer_distance(p, points, "mean") for p in spread]).sum(0).argmin())
        ]
    distance = torch.stack([chamfer_distance(points[c], points, "mean") for c in chosen]).amin(0)
    while len(chosen) < count:
        distance[chosen] = -1
        chosen.append(int(distance.argmax()))
        distance = torch.minimum(distance, chamfer_distance(points[chosen[-1]], points, "mean"))
    return tuple(prepared.ids[candidates[i]] for i in chosen)
