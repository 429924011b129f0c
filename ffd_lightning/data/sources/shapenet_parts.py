"""Part annotations of ShapeNet: `shapenetcore_partanno_segmentation_benchmark_v0_normal`.

`<synset>/<shape>.txt` has a line for each point: position, normal, and the number of its part among
those of all 16 categories. Points come in a frame of their own: another scale and centre, and in
some releases turned about the vertical.
"""

import hashlib
from dataclasses import dataclass, replace
from itertools import accumulate
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ffd_lightning.data.categories import SYNSETS, listed
from ffd_lightning.data.reading.files import digest_of_files, files_below
from ffd_lightning.data.source import PartCloud
from ffd_lightning.errors import DataError
from ffd_lightning.geometry.mesh import Mesh, bounding_box
from ffd_lightning.geometry.sampling import sample_surface

NAME = "shapenetcore_partanno_segmentation_benchmark_v0_normal"
"""The folder's published name."""
MAX_RMS = 0.035
"""Greatest distance between an annotation and the mesh it is used for, of the mesh's diagonal.

Symmetric root mean square. Measured on procedural shapes of 10 categories with 2,500 annotated
points: a shape's own annotation is at most 0.016 off, with noise of 1%, and 0.027 where only the
outer shell of a car is annotated. A chair's annotation is at least 0.09 from a table.
"""

_LOADER_VERSION = 2  # part of the fingerprint: raise it when the same files give other labels
_SYNSETS = (
    *("02691156", "02773838", "02954340", "02958343", "03001627", "03261776", "03467517"),
    *("03624134", "03636649", "03642806", "03790512", "03797390", "03948459", "04099429"),
    *("04225987", "04379243"),
)
_COUNTS = (4, 2, 2, 4, 4, 3, 3, 2, 4, 2, 6, 2, 3, 3, 3, 3)  # of parts, of 50 numbered in order
_PARTS = dict(zip(_SYNSETS, zip(accumulate((0, *_COUNTS[:-1])), _COUNTS, strict=True), strict=True))

_TIE = 0.03  # turns of a box, whose distances are the same, were found to differ by as much
_TURNS = np.array(
    [[[c, 0, s], [0, 1, 0], [-s, 0, c]] for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1))]
)
_SURFACE_POINTS = 16384
_PROBES = 4096  # points of either side that distances are measured at


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
        synset = SYNSETS.get(category, category)
        folder = self._folder(synset)
        if folder is None:
            there = listed(self.synsets())
            raise DataError(
                f"no part annotation of {category} ({synset}) in {self.root}, nor in {NAME} in it; "
                + (f"it has: {there}" if there else "it has none at all: set data.parts_root")
            )
        found = files_below(folder).items()
        sizes = {path.stem: stat.st_size for path, stat in found if path.suffix == ".txt"}
        digest = digest_of_files(sorted(sizes.items()))
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
            return _aligned(cloud, mesh, np.random.default_rng(list(key)))
        except ValueError as error:
            return None, f"its part annotation {synset}/{file.name} cannot be used ({error})"

    def _folder(self, synset: str) -> Path | None:
        folders = (self.root / synset, self.root / NAME / synset) if synset in _PARTS else ()
        return next((folder for folder in folders if any(folder.glob("*.txt"))), None)


def _aligned(
    parts: PartCloud, mesh: Mesh, rng: np.random.Generator
) -> tuple[PartCloud | None, str]:
    """Carry annotated points into the frame of the mesh they belong to, or say that they do not.

    Boxes are laid over each other by their centres and diagonals, for each quarter turn about the
    vertical, and the turn that fits best is taken; no turn, if it fits within 3% of the best.

    Annotated points may come in any frame that is y up.

    Raises:
        ValueError: the annotation or the mesh has no extent.
    """
    center, size = bounding_box(mesh.vertices, mesh.faces)
    own_center, own_size = bounding_box(parts.points)
    # From here on in units of the diagonal, about the middle of the box.
    surface = sample_surface((mesh.vertices - center) / size, mesh.faces, _SURFACE_POINTS, rng)[0]
    tree = cKDTree(surface)
    turned = (parts.points - own_center) / own_size @ _TURNS.transpose(0, 2, 1)
    distances = []
    for points in turned[:, :: -(-len(parts.points) // _PROBES)]:
        # One way is not enough: the annotation of a table lies close to many a chair.
        there, back = tree.query(points)[0], cKDTree(points).query(surface[:_PROBES])[0]
        distances.append(float(np.sqrt((np.mean(there**2) + np.mean(back**2)) / 2)))
    best = 0 if distances[0] <= (1 + _TIE) * min(distances) else int(np.argmin(distances))
    if not distances[best] <= MAX_RMS:
        off = f"rms distance {distances[best]:.3f} of the diagonal"
        return None, f"its part annotation does not fit the mesh ({off})"
    return replace(parts, points=turned[best] * size + center), ""
