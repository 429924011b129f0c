"""The files of ShapeNet's part annotations, in three published layouts."""

from __future__ import annotations

import io
import json
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.preparation.packing import UNKNOWN_PART
from ffd_lightning.data.sources.base import PartCloud
from ffd_lightning.errors import DataError, RejectedShapeError

RELEASE = "PartAnnotation"
BENCHMARK = "shapenetcore_partanno_segmentation_benchmark_v0"
NORMAL = f"{BENCHMARK}_normal"

_EXPERT = "expert_verified/points_label"
# The benchmarks' categories: where each one's labels begin among all 50, and how many it has.
_BENCHMARK_PARTS = {
    "02691156": (0, 4),
    "02773838": (4, 2),
    "02954340": (6, 2),
    "02958343": (8, 4),
    "03001627": (12, 4),
    "03261776": (16, 3),
    "03467517": (19, 3),
    "03624134": (22, 2),
    "03636649": (24, 4),
    "03642806": (28, 2),
    "03790512": (30, 6),
    "03797390": (36, 2),
    "03948459": (38, 3),
    "04099429": (41, 3),
    "04225987": (44, 3),
    "04379243": (47, 3),
}

Labels = NDArray[np.uint8]


@dataclass(frozen=True)
class AnnotatedCategory:
    """One category's annotations: its folder, its layout, the names of its parts.

    `numbered` is how many of the names, from the first on, the numbers in files stand for, and
    `offset` is what to add to a number so that the first part has 1.
    """

    path: Path
    layout: str
    names: tuple[str, ...]
    numbered: int
    offset: int = 0

    @staticmethod
    def at(path: Path) -> AnnotatedCategory | None:
        """Look at a folder `<synset>`; None if it holds no annotation that can be read."""
        masks = _folders(path / "points_label")
        numbered = _listed_names(path)
        if masks or (numbered and files_in(path / _EXPERT, ".seg")):
            names = numbered + tuple(name for name in masks if name not in numbered)
            return AnnotatedCategory(path, RELEASE, names, len(numbered))
        start, count = _BENCHMARK_PARTS.get(path.name, (0, 0))
        names = tuple(f"part {k + 1}" for k in range(count))
        if count and files_in(path / "points_label", ".seg"):
            return AnnotatedCategory(path, BENCHMARK, names, count)
        if count and files_in(path, ".txt"):
            return AnnotatedCategory(path, NORMAL, names, count, 1 - start)
        return None

    def label_folders(self) -> list[str]:
        """Return the folders with labels, below the category's, those to look in first first."""
        if self.layout == RELEASE:
            expert = [_EXPERT] if self.numbered else []
            return expert + [f"points_label/{name}" for name in self.names]
        return ["points_label" if self.layout == BENCHMARK else ""]

    def folders(self) -> list[str]:
        """Return all folders with files that are read."""
        return self.label_folders() + ([] if self.layout == NORMAL else ["points"])

    def suffix(self, folder: str) -> str:
        """Return the extension of the files in one of `folders`."""
        return {"points": ".pts", "": ".txt"}.get(folder, ".seg")

    def ids(self) -> list[str]:
        """Return the shapes with labels, sorted."""
        found = (files_in(self.path / f, self.suffix(f)) for f in self.label_folders())
        return sorted(set().union(*found))

    def read(self, shape_id: str) -> PartCloud:
        """Return a shape's annotation in its own frame.

        Raises:
            RejectedShapeError: it has none, or files that cannot be used; the message is why.
        """
        names = [f"{f}/{shape_id}{self.suffix(f)}".lstrip("/") for f in self.label_folders()]
        names = [name for name in names if (self.path / name).exists()]
        if not names:
            raise RejectedShapeError("it has no part annotation")
        if self.layout == NORMAL:
            table = self._table(names[0], 7)
            points, labels = table[:, :3], self._numbers(names[0], table[:, 6])
        else:
            points = self._table(f"points/{shape_id}.pts", 3)
            if self.layout == RELEASE and not names[0].startswith(_EXPERT):
                labels = self._masks(names, len(points))
            else:
                labels = self._numbers(names[0], self._column(names[0], len(points)))
        if (labels == UNKNOWN_PART).all():
            raise RejectedShapeError("its part annotation gives no point a part")
        return PartCloud(points, labels, self.names)

    def _masks(self, names: list[str], count: int) -> Labels:
        labels = np.full(count, UNKNOWN_PART, np.uint8)
        for name in names:
            mask = self._column(name, count)
            if not np.isin(mask, (0, 1)).all():
                raise self._broken(name, "holds other numbers than 0 and 1")
            part = self.names.index(Path(name).parent.name)
            labels[(mask == 1) & (labels == UNKNOWN_PART)] = part
        return labels

    def _numbers(self, name: str, values: NDArray[np.float64]) -> Labels:
        lowest = 1 if self.layout == NORMAL else 0
        numbers = values + self.offset
        bad = (numbers < lowest) | (numbers > self.numbered) | (numbers != np.round(numbers))
        if bad.any():
            low, high = lowest - self.offset, self.numbered - self.offset
            value = values[bad][0]
            raise self._broken(name, f"holds the label {value:g}, not from {low} to {high}")
        return np.where(numbers == 0, UNKNOWN_PART, numbers - 1).astype(np.uint8)

    def _column(self, name: str, count: int) -> NDArray[np.float64]:
        values = self._table(name, 1)[:, 0]
        if len(values) != count:
            raise self._broken(name, f"has {len(values)} labels for {count} points")
        return values

    def _table(self, name: str, columns: int) -> NDArray[np.float64]:
        try:
            data = (self.path / name).read_bytes()
            if not data.strip():
                raise self._broken(name, "is empty")
            table = np.loadtxt(io.BytesIO(data), np.float64, comments=None, ndmin=2)
        except FileNotFoundError:
            raise self._broken(name, "is missing") from None
        except ValueError as error:
            raise self._broken(name, f"cannot be read ({error})") from error
        if table.shape[1] != columns:
            raise self._broken(name, f"has {table.shape[1]} columns, not {columns}")
        if not np.isfinite(table).all():
            raise self._broken(name, "holds numbers that are not finite")
        return table

    def _broken(self, name: str, reason: str) -> RejectedShapeError:
        return RejectedShapeError(f"its part annotation {self.path.name}/{name} {reason}")


def _listed_names(path: Path) -> tuple[str, ...]:
    """Return the parts that `metadata.json` lists for a folder `<synset>`, () without it."""
    file = path.parent / "metadata.json"
    if not file.exists():
        return ()
    try:
        entry = json.loads(file.read_bytes()).get(path.name, {})
        names = entry.get("lables", entry.get("labels", []))  # the release spells it so
        if not all(isinstance(name, str) for name in names) or len(set(names)) < len(names):
            raise ValueError(f"the parts of {path.name} are no list of different names")
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise DataError(f"{file} cannot be read ({error}): get it again, or remove it") from None
    return tuple(names)


def _folders(path: Path) -> list[str]:
    """Return the names of the folders in a folder, sorted; [] where there is none."""
    return sorted(e.name for e in _entries(path) if e.is_dir())


def files_in(path: Path, suffix: str) -> dict[str, int]:
    """Return sizes in bytes by name without extension; {} where there is no such folder."""
    found = (e for e in _entries(path) if e.name.endswith(suffix) and e.is_file())
    return {e.name.removesuffix(suffix): e.stat().st_size for e in found}


def _entries(path: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(path) as entries:
            return [entry for entry in entries if not entry.name.startswith(".")]
    except (FileNotFoundError, NotADirectoryError):
        return []
    except OSError as error:
        raise DataError(f"{path} cannot be read ({error})") from None
