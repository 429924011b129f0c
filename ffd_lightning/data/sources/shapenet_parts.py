"""Part annotations of ShapeNet: `shapenetcore_partanno_segmentation_benchmark_v0_normal`.

`<synset>/<shape>.txt` has a line for each point: position, normal, and the number of its part among
those of all 16 categories.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path

import numpy as np

from ffd_lightning.data.categories import SYNSETS, listed
from ffd_lightning.data.reading.files import digest_of_files, files_below
from ffd_lightning.data.reading.part_alignment import align
from ffd_lightning.data.source import PartCloud
from ffd_lightning.errors import DataError, RejectedShapeError
from ffd_lightning.geometry.mesh import Mesh

NAME = "shapenetcore_partanno_segmentation_benchmark_v0_normal"
"""The folder's published name."""

_LOADER_VERSION = 2  # part of the fingerprint: raise it when the same files give other labels
_SYNSETS = (
    *("02691156", "02773838", "02954340", "02958343", "03001627", "03261776", "03467517"),
    *("03624134", "03636649", "03642806", "03790512", "03797390", "03948459", "04099429"),
    *("04225987", "04379243"),
)
_COUNTS = (4, 2, 2, 4, 4, 3, 3, 2, 4, 2, 6, 2, 3, 3, 3, 3)  # of parts, of 50 numbered in order
_PARTS = dict(zip(_SYNSETS, zip(accumulate((0, *_COUNTS[:-1])), _COUNTS, strict=True), strict=True))


@dataclass(frozen=True)
class PartAnnotations:
    """Part annotations as downloaded and unpacked; parts are named "part 1", "part 2" and so on.

    Attributes:
        root: the folder that holds `<synset>`, or one that holds it under its published name.
    """

    root: Path

    def synsets(self) -> list[str]:
        """Return the categories that are annotated, sorted."""
        return [synset for synset in _PARTS if self._folder(synset) is not None]

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return a hash over names and sizes of files; a DataError without any."""
        digest = digest_of_files(sorted(self._sizes(category).items()))
        return {"layout": NAME, "loader": _LOADER_VERSION, "sha256": digest}

    def read(self, category: str, shape_id: str, mesh: Mesh) -> tuple[PartCloud | None, str]:
        """Return a shape's annotation in its mesh's frame, and what is wrong with it or "".

        What cannot be used gives no parts and the reason, never an error.
        """
        synset = SYNSETS.get(category, category)
        first, count = _PARTS[synset]
        file = (self._folder(synset) or self.root) / f"{shape_id}.txt"
        if not file.is_file():
            return None, "it has no part annotation"
        try:
            table = np.loadtxt(file, np.float64, comments=None, ndmin=2)
            labels = table[:, 6] - first if table.shape[1] == 7 else np.array([np.nan])
            if not (np.isfinite(table).all() and np.isin(labels, range(count)).all()):
                raise ValueError(f"not seven numbers a line, parts from {first} on")
            names = tuple(f"part {k + 1}" for k in range(count))
            cloud = PartCloud(table[:, :3], labels.astype(np.uint8), names)
            key = hashlib.sha256(f"parts/{shape_id}".encode()).digest()
            return align(cloud, mesh, np.random.default_rng(list(key))), ""
        except ValueError as error:
            return None, f"its part annotation {synset}/{file.name} cannot be used ({error})"
        except RejectedShapeError as error:
            return None, str(error)

    def _folder(self, synset: str) -> Path | None:
        folders = (self.root / synset, self.root / NAME / synset) if synset in _PARTS else ()
        return next((folder for folder in folders if any(folder.glob("*.txt"))), None)

    def _sizes(self, category: str) -> dict[str, int]:
        """Return the size of each shape's file, by id."""
        synset = SYNSETS.get(category, category)
        folder = self._folder(synset)
        if folder is not None:
            found = files_below(folder).items()
            return {path.stem: stat.st_size for path, stat in found if path.suffix == ".txt"}
        there = listed(self.synsets())
        raise DataError(
            f"no part annotation of {category} ({synset}) in {self.root}, nor in {NAME} in it; "
            + (f"it has: {there}" if there else "it has none at all: set data.parts_root")
        )
