"""Which shapes are trained on, validated on and tested on.

A rule assigns each shape to a subset; `make_split` sets a part of the training shapes aside to
validate on where the rule names none, and `Split.without` leaves the templates out.
"""

from __future__ import annotations

import csv
import hashlib
import logging
import re
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from ffd_lightning.components import check_ranges
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.terminal import counted

log = logging.getLogger(__name__)

SUBSETS = ("train", "val", "test")
_R2N2_FRACTION = 0.8
_FEW = 10  # shapes: the mean of fewer varies by a third of one shape's deviation, or more
_SHOWN = 80  # characters of a line in a message: a file may be one line
_ID_COLUMNS = ("modelId", "shape_id", "model_id", "id")


class Split(NamedTuple):
    """Sorted ids of the three subsets; `val` may be empty.

    Curves, searches, rankings and every choice use `val`; `test` is for a run's end.
    """

    train: tuple[str, ...]
    val: tuple[str, ...]
    test: tuple[str, ...]

    @property
    def selection_ids(self) -> tuple[str, ...]:
        """The shapes that choices are made on: those to validate on, else those to train on."""
        return self.val or self.train

    def without(self, templates: Collection[str]) -> Split:
        """Return the subsets without templates; a DataError if there are no others to use."""
        chosen = set(templates)
        left = Split(*(tuple(i for i in ids if i not in chosen) for ids in self))
        if not left.train or not left.test:
            beside = f" beside {counted(len(templates), 'template')}" if templates else ""
            fewer = ", take fewer templates (templates=t1 ... t30)" if templates else ""
            raise DataError(
                f"{counted(sum(map(len, left)), 'shape')}{beside}: {_counts(left)}; add "
                f"shapes{fewer} or change the split (split=hash split.train_fraction=..., say)"
            )
        return left

    def warning(self) -> str:
        """Return in words that a subset has too few shapes for its numbers, "" if none has."""
        if not any(0 < len(ids) < _FEW for ids in self):
            return ""
        return (
            f"there are only {_counts(self)}: what is measured on fewer than {_FEW} shapes says "
            "little. Add shapes, take fewer templates or change the split (split.val_fraction, or "
            "split.train_fraction of split=hash)"
        )


class SplitInput(NamedTuple):
    """What a rule may look at.

    Attributes:
        category: whose shapes they are.
        ids: of the shapes that are there.
        rejected: ids of those that could not be prepared.
        published: the data set's own subset by id, {} where it has none.
        twins: the shapes that have near copies, each with the id of the copy whose subset all of
            them should be in; see `data.twins`.
    """

    category: str
    ids: tuple[str, ...]
    rejected: tuple[str, ...]
    published: Mapping[str, str]
    twins: Mapping[str, str] = {}


SplitRule = Callable[[SplitInput], Mapping[str, str]]
"""Assigns shapes to subsets: "train", "val" or "test" by id, "*" for all ids that are not named.

It raises `ConfigError` where it does not apply to the shapes.
"""


class HashSplit:
    """Assigns each id by its hash alone, so that added shapes never move others.

    Near copies go where the one of the least id goes.

    Args:
        train_fraction: share of the training subset, met in expectation; the rest is tested on.

    >>> HashSplit()(SplitInput("table", ("a", "b", "c"), (), {}))
    {'a': 'train', 'b': 'train', 'c': 'train'}
    """

    def __init__(self, train_fraction: float = 0.8) -> None:
        check_ranges(locals(), train_fraction="(0, 1)")
        self.train_fraction = train_fraction

    def __call__(self, shapes: SplitInput) -> Mapping[str, str]:
        """See `SplitRule`."""
        deciding = {i: shapes.twins.get(i, i) for i in shapes.ids}
        below = self.train_fraction
        return {i: "train" if _position(k) < below else "test" for i, k in deciding.items()}


class AutoSplit(HashSplit):
    """The data set's own split where it has one, else by the hash of the id."""

    def __call__(self, shapes: SplitInput) -> Mapping[str, str]:
        """See `SplitRule`."""
        return shapes.published or super().__call__(shapes)


class R2n2Split:
    """Assigns the first 80% of the sorted ids to train, the others to test.

    Ids that could not be prepared count too. 3D-R2N2 (Choy et al. 2016) splits so, and most later
    work on its renderings with it.
    """

    def __call__(self, shapes: SplitInput) -> Mapping[str, str]:
        """See `SplitRule`."""
        ids = sorted({*shapes.ids, *shapes.rejected})
        cut = int(_R2N2_FRACTION * len(ids))
        return {i: "train" if k < cut else "test" for k, i in enumerate(ids)}


class ListedSplit:
    """A split that is read from a file.

    Args:
        file: a text file of ids to test on, one a line (all others are trained on), or of lines
            `<id> <subset>`; a CSV with columns `split` and `id`, `modelId` or `shape_id`, of which
            `synsetId` may choose the rows (ShapeNet's `all.csv`); or a folder of `train.lst`,
            `val.lst`, `test.lst` (or .txt), where `<synset>/` in it is taken first (occupancy
            networks'); a longer name must have one of the three as a word, as `train_split.lst`
            has. A subset is train, val or test. Of an id with slashes the last name counts, and
            categories before it choose the rows.
    """

    def __init__(self, file: str | Path) -> None:
        self.file = Path(file).expanduser()

    def __call__(self, shapes: SplitInput) -> Mapping[str, str]:
        """See `SplitRule`."""
        synset = SYNSETS.get(shapes.category, shapes.category)
        try:
            if self.file.is_dir():
                listed = _read_folder(self.file, synset)
            else:
                text = self.file.read_text(encoding="utf-8-sig")
                columns = re.sub(r'[\s"]', "", text.partition("\n")[0]).split(",")
                listed = _read_table(text, synset) if "split" in columns else _read_lines(text)
        except (OSError, ValueError, KeyError, AttributeError) as error:
            raise ConfigError(f"split.file={self.file} cannot be read: {error}") from None
        found: dict[str, str] = {}
        foreign = {*SYNSETS, *SYNSETS.values()} - {shapes.category, synset}
        for name, subset in listed:
            *folders, shape_id = name.strip().rstrip("/").split("/")
            if foreign.intersection(folders):  # categories share ids
                continue
            if found.setdefault(shape_id, subset) != subset:
                both = f"{found[shape_id]} and {subset}"
                raise ConfigError(f"split.file={self.file} has {shape_id!r} twice: in {both}")
        if not found.keys() & {*shapes.ids, *shapes.rejected}:
            others = f"it has {next(iter(found))!r}, say, where " if found else ""
            raise ConfigError(
                f"split.file={self.file} lists no shapes of {shapes.category}: {others}these are "
                f"called {shapes.ids[0]!r} and so on"
            )
        return found


def make_split(
    ids: Iterable[str],
    subsets: Mapping[str, str],
    val_fraction: float = 0.0,
    twins: Mapping[str, str] = {},
) -> Split:
    """Return the three subsets of the shapes that there are.

    Args:
        ids: of the shapes.
        subsets: as a `SplitRule` gives them; shapes that are in none are left out.
        val_fraction: share of the training shapes to validate on instead, by the hash of the id,
            where the rule has named none.
        twins: see `SplitInput`.

    Raises:
        ConfigError: a subset that there is not.
        DataError: nothing to train on, or nothing to test on.
    """
    if not isinstance(subsets, Mapping):
        raise ConfigError(f"the split gives a {type(subsets).__name__}, not a subset by id")
    wrong = sorted(set(subsets.values()) - set(SUBSETS))
    if wrong:
        raise ConfigError(f"the split has {wrong[0]!r} for one of {', '.join(SUBSETS)}")
    rest = subsets.get("*", "")
    found = {i: subsets.get(i, rest) for i in sorted(set(ids))}
    if "val" not in subsets.values():
        own = {i for i, subset in found.items() if subset == "train"}
        found |= {i: "val" for i in own if _position(f"val/{twins.get(i, i)}") < val_fraction}
    unnamed = sum(not subset for subset in found.values())
    if unnamed:
        log.info("left out, as the split does not name them: %s", counted(unnamed, "shape"))
    return Split(*(tuple(i for i in found if found[i] == name) for name in SUBSETS)).without(())


def _counts(split: Split) -> str:
    train, val, test = map(len, split)
    return f"{train} to train on, {val} to validate on and {test} to test on"


def _position(shape_id: str) -> float:
    """Return a fixed number in [0, 1) for an id."""
    return int(hashlib.sha256(shape_id.encode()).hexdigest()[:13], 16) / 16**13


def _read_lines(text: str) -> list[tuple[str, str]]:
    rows = [row for line in text.splitlines() if (row := re.split(r"[,\s]+", line.strip())) != [""]]
    if rows and all(len(row) == 1 for row in rows):
        return [(row[0], "test") for row in rows] + [("*", "train")]
    for row in rows:
        if len(row) != 2:
            raise ValueError(f"{' '.join(row)[:_SHOWN]!r} is not `<id> <subset>`")
    return [(name, subset) for name, subset in rows]


def _read_table(text: str, synset: str) -> list[tuple[str, str]]:
    rows = list(csv.DictReader(text.splitlines(), skipinitialspace=True))
    key = next((k for k in _ID_COLUMNS if rows and k in rows[0]), None)
    if key is None:
        raise ValueError(f"it needs the columns `split` and one of {', '.join(_ID_COLUMNS)}")
    # Numbers lose their leading zeros in many a table.
    own = [row for row in rows if row.get("synsetId", synset).zfill(8) == synset.zfill(8)]
    return [(row[key], row["split"].strip()) for row in own]


def _read_folder(folder: Path, synset: str) -> list[tuple[str, str]]:
    found: list[tuple[str, str]] = []
    for top in (folder / synset, folder):
        files = [file for file in sorted(top.glob("*.*")) if file.suffix in (".lst", ".txt")]
        for subset, file in ((subset, file) for subset in SUBSETS for file in files):
            stem = re.split("[^a-z]+", file.stem.lower())
            words = {"val" if word in ("valid", "validation") else word for word in stem}
            if words & set(SUBSETS) == {subset}:  # not trainval.lst, say
                found += [(name, subset) for name in file.read_text("utf-8-sig").split()]
        if found:
            break
    return found
