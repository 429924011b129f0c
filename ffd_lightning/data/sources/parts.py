"""Published part annotations of ShapeNet: labelled points by shape, in three layouts."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.preparation.part_labels import align
from ffd_lightning.data.reading.part_files import (
    BENCHMARK,
    NORMAL,
    RELEASE,
    AnnotatedCategory,
    files_in,
)
from ffd_lightning.data.sources.base import PartCloud
from ffd_lightning.errors import DataError, RejectedShapeError
from ffd_lightning.geometry.mesh import Mesh

_LOADER_VERSION = 1  # part of the fingerprint: raise it when the same files give other labels


@dataclass
class PartAnnotations:
    """Part annotations as downloaded and unpacked; which layout they have is seen.

    `PartAnnotation/<synset>` (2016): `points/<model>.pts`, a mask for each part in
    `points_label/<part>/<model>.seg`, and for some shapes numbers in `expert_verified/points_label`
    that are taken before the masks; `metadata.json` says which part a number stands for, and
    without it the masks alone are read. Where masks overlap, the first part has the point.
    The benchmarks name no parts: theirs are "part 1", "part 2" and so on.

    Attributes:
        root: the folder that holds `<synset>`, or one that holds it under its published name.
    """

    root: Path
    _found: dict[str, AnnotatedCategory] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def categories(self) -> list[str]:
        """Return the synsets that are annotated, sorted."""
        names = {name for top in self._tops() for name in os.listdir(top)}
        return sorted(name for name in names if len(name) == 8 and self._find(name) is not None)

    def layout(self, category: str) -> str:
        """Return the published name of the layout that a category is in.

        Raises:
            DataError: the category has no annotation; the message lists those that have.
        """
        return self._category(category).layout

    def ids(self, category: str) -> list[str]:
        """Return the ids of the shapes that are annotated, sorted.

        Raises:
            DataError: the category has no annotation.
        """
        return self._category(category).ids()

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return layout, names of parts, and a hash over names and sizes of files.

        Raises:
            DataError: the category has no annotation.
        """
        found = self._category(category)
        digest = hashlib.sha256()
        for folder in found.folders():
            for stem, size in sorted(files_in(found.path / folder, found.suffix(folder)).items()):
                digest.update(f"{folder}/{stem}\0{size}\n".encode())
        return {
            "layout": found.layout,
            "loader": _LOADER_VERSION,
            "names": list(found.names),
            "numbered": found.numbered,
            "sha256": digest.hexdigest(),
        }

    def read(self, category: str, shape_id: str, mesh: Mesh) -> tuple[PartCloud | None, str]:
        """Return a shape's annotation in its mesh's frame, and what is wrong with it or "".

        The same shape gives the same result in any process. What cannot be used gives no parts and
        the reason, never an error.
        """
        try:
            parts = self._category(category).read(shape_id)
            key = hashlib.sha256(f"parts/{shape_id}".encode()).digest()
            return align(parts, mesh, np.random.default_rng(list(key)))
        except RejectedShapeError as error:
            return None, str(error)

    def _tops(self) -> list[Path]:
        below = ("", RELEASE, BENCHMARK, NORMAL)
        return [top for name in below if (top := Path(self.root) / name).is_dir()]

    def _find(self, synset: str) -> AnnotatedCategory | None:
        for top in self._tops():
            found = AnnotatedCategory.at(top / synset)
            if found is not None:
                return found
        return None

    def _category(self, name: str) -> AnnotatedCategory:
        if name not in self._found:
            synset = SYNSETS.get(name, name)
            found = self._find(synset)
            if found is None:
                raise DataError(self._missing(name, synset))
            self._found[name] = found
        return self._found[name]

    def _missing(self, name: str, synset: str) -> str:
        named = {s: n for n, s in SYNSETS.items()}
        there = ", ".join(f"{named.get(s, 'other')} ({s})" for s in self.categories())
        return (
            f"no part annotation of {name} ({synset}) in {self.root}, nor in {RELEASE}, "
            f"{BENCHMARK} or {NORMAL} in it; "
            + (f"it has: {there}" if there else "it has none at all: set data.parts_root")
        )
