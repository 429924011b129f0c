"""Choosing templates from a prepared set: the strategies, and the check of what they choose."""

import csv
import logging
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ffd_lightning.components import check_ranges
from ffd_lightning.data.categories import paper_templates
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.templates.distances import greedy_medoids, shape_distances
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.terminal import counted

log = logging.getLogger(__name__)

TemplateStrategy = Callable[[PreparedSet, int], Sequence[str]]
"""From the shapes of a category to choose from, and how many are wanted, to as many ids."""


def choose_templates(
    strategy: TemplateStrategy, prepared: PreparedSet, count: int, exclude: Collection[str] = ()
) -> tuple[str, ...]:
    """Choose template ids from a prepared set, and check what was chosen.

    The strategy is given the shapes of a category that are not excluded, as those to test on are.
    Lists, the paper's and a user's, may name any shape of the set.

    Raises:
        ConfigError: the strategy did not choose so many different shapes of the set.
        DataError: fewer shapes to choose from than templates.
    """
    candidates = prepared.without(exclude) if exclude else prepared
    if count > len(candidates):
        raise DataError(
            f"{counted(count, 'template')} asked for, but {prepared.path} holds only "
            f"{counted(len(candidates), 'shape')} to choose from, and "
            f"{len(prepared) - len(candidates)} that are tested on or left "
            "out: choose fewer (templates=t1 ... t30), prepare more shapes or change the split"
        )
    chosen: Any = strategy(candidates, count)
    # NumPy's strings would make a checkpoint that cannot be opened.
    templates = tuple(map(str, chosen)) if isinstance(chosen, Iterable) else ()
    unknown = sorted(set(templates) - set(prepared.ids))
    if unknown or not len(templates) == len(set(templates)) == count:
        wrong = f"it gives {len(templates)} ids, {len(set(templates))} different ones"
        if unknown:
            wrong = f"{unknown[0]!r} is not in {prepared.path}"
        raise ConfigError(f"the template strategy must choose {count} ids of the set: {wrong}")
    return templates


class MedoidTemplates:
    """Shapes that all others are near to, never one that is like nothing else in the set."""

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """See `distances.greedy_medoids`; the first t of a larger choice are the choice of t."""
        found = shape_distances(prepared, count)
        return tuple(prepared.ids[found.rows[place]] for place in greedy_medoids(found, count))


class RandomTemplates:
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


class PaperTemplates:
    """The authors' own templates, of ShapeNet v1; `medoids` of the others for those absent."""

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """Return those of the paper's ids that there are, in their order, then `medoids`.

        The first t of a larger choice are the choice of t.
        """
        category, held = prepared.category(0), set(prepared.whole.ids)
        known = paper_templates(category)
        if not known:
            raise ConfigError(
                f"template_strategy=paper: the paper has no templates for {category}; use medoids"
            )
        if absent := [i for i in known[:count] if i not in held]:
            log.warning(
                "%s lacks %d of the paper's first %d templates, others take their places: %s",
                *(prepared.path, len(absent), count, ", ".join(absent)),
            )
        chosen = tuple(i for i in known if i in held)[:count]
        left = count - len(chosen)
        return chosen + MedoidTemplates()(prepared.without(chosen), left) if left else chosen


class AutoTemplates:
    """The paper's own templates for ShapeNet's shapes, else `medoids`."""

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """See `PaperTemplates` and `MedoidTemplates`."""
        source = prepared.manifests[0]["settings"]["source"].get("source")
        of_paper = source == "shapenet" and paper_templates(prepared.category(0))
        return (PaperTemplates() if of_paper else MedoidTemplates())(prepared, count)


class ListedTemplates:
    """Takes the first ids of a file: one a line, or the column `id` of a table.

    Of an earlier run's `template_ranking.csv` these are its favourites. In a list, what follows a #
    is left out.

    Args:
        file: `{category}` in it stands for the set's category.
    """

    def __init__(self, file: str | Path) -> None:
        self.file = file

    def __call__(self, prepared: PreparedSet, count: int) -> tuple[str, ...]:
        """See `TemplateStrategy`."""
        file = Path(str(self.file).replace("{category}", prepared.category(0))).expanduser()
        try:  # -sig: some editors put a byte order mark first
            lines = file.read_text(encoding="utf-8-sig").splitlines()
        except (OSError, UnicodeDecodeError) as error:
            raise ConfigError(f"template_strategy.file={file} cannot be read: {error}") from None
        if lines and "id" in lines[0].split(","):  # None in a short row
            listed = [(row["id"] or "").strip() for row in csv.DictReader(lines)]
        else:
            listed = [line.split("#")[0].strip() for line in lines]
        ids = tuple(dict.fromkeys(filter(None, listed)))[:count]
        if len(ids) < count:
            raise ConfigError(
                f"template_strategy.file={file} lists {counted(len(ids), 'id')}, {count} are needed"
            )
        return ids
