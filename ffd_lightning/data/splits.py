"""Which models are trained on and which are tested on."""

from __future__ import annotations

import csv
import hashlib
import json
import logging
import re
from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import NamedTuple

from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.errors import ConfigError, DataError

log = logging.getLogger(__name__)

PARTS = ("train", "val", "test")
_R2N2_FRACTION = 0.8


class Split(NamedTuple):
    """Sorted ids of the two parts."""

    train: tuple[str, ...]
    test: tuple[str, ...]


def hash_parts(ids: Iterable[str], train_fraction: float) -> dict[str, str]:
    """Assign each id to a part by its hash alone, so that added models never move others.

    Args:
        ids: model ids.
        train_fraction: share of the training part, met in expectation.

    Returns:
        "train" or "test" by id.

    >>> hash_parts(["a", "b", "c"], 0.8)
    {'a': 'train', 'b': 'train', 'c': 'train'}
    """
    return {i: "train" if _position(i) < train_fraction else "test" for i in ids}


def r2n2_parts(ids: Collection[str]) -> dict[str, str]:
    """Assign the first 80% of the sorted ids to train, the others to test.

    3D-R2N2 (Choy et al. 2016) splits so, and most later work on its renderings with it.

    Args:
        ids: ids of all models, also of those that could not be prepared.
    """
    cut = int(_R2N2_FRACTION * len(ids))
    return {i: "train" if k < cut else "test" for k, i in enumerate(sorted(ids))}


def listed_parts(place: Path, category: str) -> dict[str, str]:
    """Read a split from files.

    Args:
        place: a text file of ids to test on, one a line (all others are trained on), or of lines
            `<id> <part>`; a CSV with columns `split` and `id`, `modelId` or `model_id`, of which
            `synsetId` may choose the rows (ShapeNet's `all.csv`); a JSON object of lists by part;
            or a folder of `train.lst`, `val.lst`, `test.lst` (or .txt, or .json lists), where
            `<synset>/` in it is taken first (occupancy networks'). A part is train, val or test.
            Of an id with slashes the last name counts.
        category: chooses rows and folders by its synset.

    Returns:
        The part by id; with the key "*" that of all ids which are not listed, if there is one.

    Raises:
        ConfigError: the file cannot be read or lists nothing.
    """
    try:
        if place.is_dir():
            parts = _read_folder(place, SYNSETS.get(category, category))
        else:
            text = place.read_text(encoding="utf-8-sig")
            read = {".json": _read_json, ".csv": _read_csv}.get(place.suffix.lower(), _read_lines)
            parts = read(text, SYNSETS.get(category, category))
    except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        raise ConfigError(f"data.split_file={place} cannot be read: {error}") from None
    if not parts:
        raise ConfigError(f"data.split_file={place} lists no models of {category}")
    wrong = sorted(set(parts.values()) - set(PARTS))
    if wrong:
        raise ConfigError(f"data.split_file={place} has {wrong[0]!r} for one of {', '.join(PARTS)}")
    return parts


def make_split(
    ids: Iterable[str], parts: Mapping[str, str], exclude: Collection[str] = (), hint: str = ""
) -> Split:
    """Return the two parts of the models that there are.

    Args:
        ids: model ids.
        parts: "train", "val" or "test" by id, "*" for all others. Models of the validation part,
            and those that are not in it, are left out: nothing is chosen on validation models.
        exclude: ids in neither part (the templates).
        hint: what to say where a part is empty.

    Raises:
        DataError: one of the parts is empty.
    """
    rest = parts.get("*", "")
    found = {i: parts.get(i, rest) for i in sorted(set(ids) - set(exclude))}
    counts = Counter(found.values())
    if counts["val"] or counts[""]:
        log.info("left out: %d models to validate on, %d without part", counts["val"], counts[""])
    train, test = (tuple(i for i in found if found[i] == part) for part in ("train", "test"))
    if not train or not test:
        raise DataError(
            f"{len(found)} models besides {len(exclude)} templates leave {len(train)} to train on "
            f"and {len(test)} to test on: add models, take fewer templates (templates=t1 ... t30) "
            f"or change {hint}"
        )
    return Split(train, test)


def _position(model_id: str) -> float:
    """Return a fixed number in [0, 1) for an id."""
    return int(hashlib.sha256(model_id.encode()).hexdigest()[:13], 16) / 16**13


def _last(name: str) -> str:
    return name.strip().rstrip("/").rsplit("/", 1)[-1]


def _read_lines(text: str, _: str) -> dict[str, str]:
    rows = [row for line in text.splitlines() if (row := re.split(r"[,\s]+", line.strip())) != [""]]
    if all(len(row) == 1 for row in rows):
        return {_last(row[0]): "test" for row in rows} | ({"*": "train"} if rows else {})
    for row in rows:
        if len(row) != 2:
            raise ValueError(f"{' '.join(row)!r} is not `<id> <part>`")
    return {_last(name): part for name, part in rows}


def _read_csv(text: str, synset: str) -> dict[str, str]:
    rows = list(csv.DictReader(text.splitlines()))
    columns = set(rows[0]) if rows else set()
    key = next((k for k in ("modelId", "model_id", "id") if k in columns), None)
    if key is None or "split" not in columns:
        return _read_lines(text, synset)
    # Numbers lose their leading zeros in many a table.
    return {
        _last(row[key]): row["split"]
        for row in rows
        if row.get("synsetId", synset).zfill(8) == synset.zfill(8)
    }


def _read_json(text: str, synset: str) -> dict[str, str]:
    lists = json.loads(text)
    lists = lists.get(synset, lists)
    return {_last(name): part for part in PARTS for name in lists.get(part, ())}


def _read_folder(folder: Path, synset: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for top in (folder / synset, folder):
        for part in PARTS:
            for file in sorted(top.glob(f"*{part}*")):
                text = file.read_text(encoding="utf-8-sig")
                if file.suffix == ".json":  # shuffled_train_file_list.json of all categories
                    names = [n for n in json.loads(text) if synset in n.split("/")]
                elif file.suffix in (".lst", ".txt"):
                    names = text.split()
                else:
                    continue
                found |= {_last(name): part for name in names}
        if found:
            break
    return found
