"""ModelNet40 and ModelNet10, in folders or in the archives that are published."""

import hashlib
from pathlib import Path, PurePath
from typing import NamedTuple

import ffd_lightning as ffd
from ffd_lightning.data.reading.files import Tree
from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.data.reading.orientation import Up, check_orientation, orient
from ffd_lightning.errors import DataError, RejectedShapeError

_NAMES = ("", "ModelNet40", "ModelNet40.zip", "ModelNet10", "ModelNet10.zip")
_SIDES = ("train", "test")
_THEIRS = {"plane": "airplane"}  # the project's names that ModelNet has other words for


class _File(NamedTuple):
    """A shape's file, and its size in bytes."""

    path: PurePath
    size: int

    @property
    def side(self) -> str:
        """The side of the split that it is on."""
        return self.path.parts[-2]


@ffd.component("source", "modelnet")
class ModelNetSource(ffd.Source):
    """ModelNet40 or ModelNet10 as downloaded: `<category>/{train,test}/<category>_0001.off`.

    `root` is the folder of categories, one that holds `ModelNet40` or `ModelNet10` or their zip
    archives, or such an archive; nothing is unpacked. "plane" means "airplane".

    Convention:
        z up, as published. ModelNet10's shapes face one way, ModelNet40's do not unless it is an
        aligned edition; `yaw` turns all of them alike.

    Args:
        root: with <category>/{train,test}/*.off, or an archive.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
    """

    def __init__(self, root: Path, up: Up = "z", yaw: float = 0.0) -> None:
        check_orientation(up, yaw)
        self.root, self.up, self.yaw = Path(root), up, yaw
        self._found: tuple[Tree, dict[str, dict[str, _File]]] | None = None

    def categories(self) -> list[str]:
        """Return all categories, sorted; "airplane" as "plane"."""
        ours = {theirs: name for name, theirs in _THEIRS.items()}
        return sorted(ours.get(name, name) for name in self._listed()[1])

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of a category, sorted: names of files, `chair_0001`."""
        return sorted(self._category(category))

    def load(self, category: str, shape_id: str) -> ffd.SourceShape:
        """Return one shape; see `Source.load`."""
        file = self._category(category).get(shape_id)
        if file is None:
            raise RejectedShapeError(f"there is no shape {shape_id!r} of category {category!r}")
        mesh, notes = read_mesh(file.path, (), self._listed()[0].read)
        return ffd.SourceShape(orient(mesh, self.up, self.yaw)).warned(*notes)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return how shapes are turned and a hash over their ids and their files' sizes."""
        self._found = None
        sizes = sorted((i, file.size) for i, file in self._category(category).items())
        digest = hashlib.sha256(repr(sizes).encode()).hexdigest()
        return {"source": "modelnet", "sha256": digest, "up": self.up, "yaw": self.yaw}

    def rejected(self, category: str) -> dict[str, str]:
        """Return the shapes whose files are empty."""
        files = self._category(category)
        return {i: "its file is empty" for i, file in files.items() if not file.size}

    def split(self, category: str) -> dict[str, str]:
        """Return the folder, "train" or "test", that each shape is in, by id."""
        return {shape_id: file.side for shape_id, file in self._category(category).items()}

    def _category(self, category: str) -> dict[str, _File]:
        listed = self._listed()[1]
        name = category if category in listed else _THEIRS.get(category, category)
        if name not in listed:
            raise DataError(f"{self.root} has no {name}; it has: {', '.join(self.categories())}")
        return listed[name]

    def _listed(self) -> tuple[Tree, dict[str, dict[str, _File]]]:
        """Return where the files are, and the shapes that are there by category and id."""
        if self._found is None:
            for name in _NAMES:
                place = self.root / name if name else self.root
                if place.is_dir() or place.is_file():
                    tree = Tree(place)
                    if found := _shapes(tree):
                        self._found = tree, found
                        break
            else:
                raise DataError(
                    f"{self.root} is not ModelNet: neither it nor ModelNet40, ModelNet10 or an "
                    "archive of theirs in it has <category>/train/*.off: set data.root"
                )
        return self._found


def _shapes(tree: Tree) -> dict[str, dict[str, _File]]:
    found: dict[str, dict[str, _File]] = {}
    for path, size in tree.sizes().items():
        if len(path.parts) > 2 and path.parts[-2] in _SIDES and path.suffix.lower() == ".off":
            shapes, file = found.setdefault(path.parts[-3], {}), _File(path, size)
            if path.stem in shapes:
                raise DataError(f"{tree.place} has {path.stem} in train and in test: rename one")
            shapes[path.stem] = file
    return found
