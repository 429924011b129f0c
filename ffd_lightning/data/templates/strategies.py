"""Choosing templates from a prepared set."""

from __future__ import annotations

import csv
import logging
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from ffd_lightning.components import check_ranges
from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates.coverage import (
    CANDIDATES,
    POINTS,
    ShapeDistances,
    medoids,
    shape_distances,
    spread_rows,
)
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.chamfer import chamfer_distance

log = logging.getLogger(__name__)

_SPREAD = 16

TemplateStrategy = Callable[[PreparedSet, int], Sequence[str]]
"""From the shapes of a category to choose from, and how many are wanted, to as many ids."""


def choose_templates(
    strategy: TemplateStrategy, prepared: PreparedSet, count: int, exclude: Collection[str] = ()
) -> tuple[str, ...]:
    """Choose template ids from a prepared set, and check what was chosen.

    The strategy is given the shapes that are not excluded as a set. Lists, the paper's and a
    user's, may name any shape of the set.

    Args:
        strategy: how to choose.
        prepared: the shapes of a category.
        count: how many, T.
        exclude: ids not to choose from: those to test on.

    Raises:
        ConfigError: the strategy cannot choose so many, chose a shape twice, or chose what the set
            does not hold.
        DataError: fewer shapes to choose from than templates.
    """
    candidates = prepared.without(exclude) if exclude else prepared
    if count > len(candidates):
        raise DataError(
            f"{count} templates asked for, but {prepared.path} holds only {len(candidates)} shapes "
            f"to choose from, and {len(prepared) - len(candidates)} that are tested on or left "
            "out: choose fewer (templates=t1 ... t30), prepare more shapes or change the split"
        )
    chosen = strategy(candidates, count)
    if not isinstance(chosen, Iterable):
        raise ConfigError(
            f"the template strategy must choose {count} shapes of the set, and gives a "
            f"{type(chosen).__name__}"
        )
    templates = tuple(chosen)
    unknown = sorted(set(templates) - set(prepared.ids))
    if unknown or not len(templates) == len(set(templates)) == count:
        wrong = f"it gives {len(templates)} ids, {len(set(templates))} different ones"
        if unknown:
            wrong = f"{unknown[0]!r} is not in {prepared.path}"
        raise ConfigError(f"the template strategy must choose {count} shapes of the set: {wrong}")
    return templates


class RandomStrategy:
    """Draws templates.

    Args:
        seed: decides which.
    """

    def __init__(self, seed: int = 0) -> None:
        check_ranges(locals(), seed="[0, inf)")
        self.seed = seed

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """See `TemplateStrategy`."""
        order = np.random.default_rng(self.seed).permutation(len(prepared))[:count]
        return tuple(prepared.ids[i] for i in order)


def medoid_templates(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Choose shapes that all others are near to, and none that is like nothing else.

    See `coverage.medoids`. The first t of any larger choice are the choice of t.
    """
    return _medoids(prepared, count)


def diverse_templates(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Start at the most central shape, go on to whichever is farthest from all chosen.

    Distances are Chamfer distances. The first t of any larger choice are the choice of t. What is
    like nothing else in the set is chosen early.
    """
    return _farthest_points(prepared, count)


def paper_choice(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Take the paper's ids in their order; where one is absent, whatever `medoids` would add there.

    What is added depends on the templates before it, so the first t of any larger choice are the
    choice of t.

    Raises:
        ConfigError: the paper has no templates for the category.
    """
    category = _category(prepared)
    known = paper_templates(category)
    if not known:
        raise ConfigError(
            f"template_strategy=paper: the paper has no templates for {category}; use medoids"
        )
    whole = prepared.whole
    wanted, held = known[:count], set(whole.ids)
    absent = [i for i in wanted if i not in held]
    if absent:
        log.warning(
            "%s lacks %d of the paper's %d templates, `medoids` chooses others in their places: %s",
            prepared.path,
            len(absent),
            len(wanted),
            ", ".join(absent),
        )
    # The paper's further templates are not used up, unless there is hardly anything else.
    enough = len(set(prepared.ids).difference(known)) >= count - len(wanted) + len(absent)
    spared = known if enough else wanted
    chosen: list[str] = []
    for k in range(count):
        there = k < len(known) and known[k] in held
        chosen += [known[k]] if there else _medoids(prepared, 1, chosen, spared)
    return tuple(chosen)


def auto_choice(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Choose as `paper_choice` for ShapeNet's shapes, if the paper has templates, else medoids."""
    source = prepared.manifests[0]["settings"]["source"]
    known = paper_templates(_category(prepared))
    of_shapenet = source.get("source") == "shapenet"
    return (paper_choice if known and of_shapenet else medoid_templates)(prepared, count)


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
        file = Path(str(self.file).replace("{category}", _category(prepared))).expanduser()
        ids = list(dict.fromkeys(i for i in self._column(_read(file), file) if i))
        if len(ids) < count:
            raise ConfigError(
                f"template_strategy.file={file} lists {len(ids)} ids, {count} are needed"
            )
        whole = prepared.whole
        unknown = sorted(set(ids[:count]) - set(whole.ids))
        if unknown:
            raise ConfigError(
                f"template_strategy.file={file} names {len(unknown)} shapes that are not in "
                f"{whole.path}, the first {unknown[0]!r}"
            )
        return tuple(ids[:count])

    def _column(self, text: str, file: Path) -> list[str]:
        return [line.split("#")[0].strip() for line in text.splitlines()]


class RankingStrategy(ListedStrategy):
    """Takes the favourites of an earlier run: the first of its `template_ranking.csv`."""

    def _column(self, text: str, file: Path) -> list[str]:
        rows = list(csv.DictReader(text.splitlines()))
        if not rows or "id" not in rows[0]:
            raise ConfigError(
                f"template_strategy.file={file} has no column `id`: give a run's "
                "template_ranking.csv"
            )
        return [(row["id"] or "").strip() for row in rows]  # None where a row is short


def _read(file: Path) -> str:
    try:
        return file.read_text(
            encoding="utf-8-sig"
        )  # -sig: some editors put a byte order mark first
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"template_strategy.file={file} cannot be read: {error}") from None


def _category(prepared: PreparedSet) -> str:
    return "+".join(prepared.categories)


def _medoids(
    prepared: PreparedSet, count: int, first: Sequence[str] = (), spared: Sequence[str] = ()
) -> tuple[str, ...]:
    """Choose so many more after the shapes `first` as `coverage.medoids` does, none of `spared`."""
    found = shape_distances(prepared, count + len(first))
    ids = [prepared.ids[row] for row in found.rows]
    taken = [
        found.table[ids.index(i)] if i in ids else _distances(prepared, found, i) for i in first
    ]
    barred = {*first, *spared}
    chosen = medoids(
        found,
        count,
        [place for place, shape_id in enumerate(ids) if shape_id in barred],
        np.min(taken, axis=0) if taken else None,
    )
    return tuple(ids[place] for place in chosen)


def _distances(
    prepared: PreparedSet, found: ShapeDistances, shape_id: str
) -> Float[np.ndarray, " candidates"]:
    """Return how far any shape of the whole set is from those that were looked at."""
    whole = prepared.whole
    cloud = torch.from_numpy(whole.cloud(whole.index(shape_id), POINTS))
    return chamfer_distance(cloud, found.points, "mean").numpy()


def _farthest_points(prepared: PreparedSet, count: int) -> tuple[str, ...]:
    """Farthest-point choice under Chamfer distance, among `CANDIDATES` shapes of a larger set.

    It begins with the most central one.
    """
    rows = spread_rows(len(prepared), max(CANDIDATES, count))
    points = torch.from_numpy(np.stack([prepared.cloud(int(row), POINTS) for row in rows]))
    # The most central shape: the least total distance to a spread of others.
    spread = points[spread_rows(len(points), _SPREAD)]
    total = torch.stack([chamfer_distance(p, points, "mean") for p in spread]).sum(0)
    chosen = [int(total.argmin())]
    distance = chamfer_distance(points[chosen[0]], points, "mean")
    while len(chosen) < count:
        distance[chosen] = -1
        chosen.append(int(distance.argmax()))
        distance = torch.minimum(distance, chamfer_distance(points[chosen[-1]], points, "mean"))
    return tuple(prepared.ids[rows[place]] for place in chosen)


class AutoStrategy:
    """The paper's own templates for ShapeNet's shapes, else `medoids`."""

    __call__ = staticmethod(auto_choice)


class PaperStrategy:
    """The authors' own templates, of ShapeNet v1; `medoids` for those that are absent."""

    __call__ = staticmethod(paper_choice)


class MedoidStrategy:
    """Shapes that all others are near to, never one that is like nothing else in the set."""

    __call__ = staticmethod(medoid_templates)


class DiverseStrategy:
    """The most central shape, then whichever is farthest from all chosen: outliers come early."""

    __call__ = staticmethod(diverse_templates)
