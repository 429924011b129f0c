"""ModelNet40 and ModelNet10, in folders or in the archives that are published."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ffd_lightning.data.reading.files import File, ZipMember, ZipTree, is_hidden
from ffd_lightning.data.reading.frame import Up, check_turn, into_frame
from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.data.sources.base import SourceShape, Survey
from ffd_lightning.errors import DataError, RejectedShapeError

_LOADER_VERSION = 1  # part of the fingerprint: raise it when the same files give another mesh
_NAMES = ("ModelNet40", "ModelNet10")
_SIDES = ("train", "test")
_THEIRS = {"plane": "airplane"}  # the project's names that ModelNet has other words for


@dataclass(frozen=True)
class _Model:
    """A shape's file and the side of the split it is on."""

    file: File
    side: str

    def size(self) -> int:
        """Return the file's size in bytes, unpacked; -1 for a file that is gone."""
        if isinstance(self.file, ZipMember):
            return self.file.info.file_size
        try:
            return Path(*self.file.parts).stat().st_size
        except FileNotFoundError:
            return -1


@dataclass
class ModelNetSource:
    """ModelNet as downloaded: `<category>/{train,test}/<category>_0001.off`.

    `root` is the folder of categories, a folder that holds it, or an archive that does, or a
    folder with such an archive in it; nothing is unpacked. What is found first is taken: `root`
    itself, `ModelNet40`, `ModelNet40.zip`, `ModelNet10`, `ModelNet10.zip`, and else the only
    folder or archive (named modelnet...) that has the layout. Categories have ModelNet's names;
    "plane" means "airplane".

    Convention:
        z up, as published, hence the default of `up`. ModelNet10's models face one way,
        ModelNet40's do not unless it is an aligned edition; `yaw` turns all of them alike.

    Attributes:
        root: what `data.root` names.
        up: the axis that points up in the files.
        yaw: degrees to turn shapes by about the vertical after that, see `frame.turn`.
    """

    root: Path
    up: Up = "z"
    yaw: float = 0.0
    _models: dict[str, list[tuple[str, _Model]]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        self.root = Path(self.root)
        check_turn(self.up, self.yaw)

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_models": {}}  # listed again where it is needed: 12,311 files

    def categories(self) -> list[str]:
        """Return all categories, sorted; "airplane" as "plane".

        Raises:
            DataError: `root` is not ModelNet.
        """
        ours = {theirs: name for name, theirs in _THEIRS.items()}
        return sorted(ours.get(name, name) for name in self._listed())

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of `category`, sorted: names of files, `chair_0001`.

        Raises:
            DataError: no such category; the message lists those that are there.
        """
        return sorted(self._category(category))

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return one shape.

        Raises:
            RejectedShapeError: the model cannot be used; the message is the reason.
            DataError: no such category.
        """
        model = self._category(category).get(shape_id)
        if model is None:
            raise RejectedShapeError(f"there is no shape {shape_id!r} of category {category!r}")
        return SourceShape(into_frame(read_mesh(model.file), self.up, self.yaw))

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return how shapes are turned and a hash over their ids and their files' sizes.

        The same in folders and in archives: the data set is published and does not change.
        """
        digest = hashlib.sha256()
        for shape_id, model in sorted(self._category(category).items()):
            digest.update(f"{shape_id}\0{model.size()}\n".encode())
        return {
            "source": "modelnet",
            "loader": _LOADER_VERSION,
            "sha256": digest.hexdigest(),
            "up": self.up,
            "yaw": self.yaw,
        }

    def survey(self, category: str) -> Survey:
        """Tell form and split, and which files are empty.

        Raises:
            DataError: as `shape_ids`.
        """
        models = self._category(category)
        packed = any(isinstance(model.file, ZipMember) for model in models.values())
        sides = [model.side for model in models.values()]
        return Survey(
            "zip archive" if packed else "folders",
            {i: "its file is empty" for i, model in models.items() if model.size() == 0},
            (f"{sides.count('train')} to train on, {sides.count('test')} to test on",),
        )

    def split(self, category: str) -> dict[str, str]:
        """Return the folder, "train" or "test", that each shape is in, by id."""
        return {shape_id: model.side for shape_id, model in self._category(category).items()}

    def _category(self, category: str) -> dict[str, _Model]:
        """Return the shapes of a category by id."""
        listed = self._listed()
        name = category if category in listed else _THEIRS.get(category, category)
        if name not in listed:
            raise DataError(f"{self.root} has no {name}; it has: {', '.join(self.categories())}")
        models: dict[str, _Model] = {}
        for shape_id, model in listed[name]:
            if shape_id in models:
                raise DataError(
                    f"{self.root} has {shape_id} of {name} twice, in {models[shape_id].side} and "
                    f"in {model.side}: rename one"
                )
            models[shape_id] = model
        return models

    def _listed(self) -> dict[str, list[tuple[str, _Model]]]:
        """Return the ids and shapes that are there, by category."""
        if not self._models:
            place = _find(self.root)
            for path, file in _off_files(place):
                category, side, _ = path[-3:]
                self._models.setdefault(category, []).append((file.stem, _Model(file, side)))
            if not self._models:
                raise DataError(f"{place} holds no <category>/train/*.off or <category>/test/*.off")
        return self._models


def _off_files(place: Path) -> Iterator[tuple[tuple[str, ...], File]]:
    """Yield the shapes' files in a folder or an archive, each with its path in there."""
    files: Iterator[tuple[tuple[str, ...], File]]
    if place.is_file():
        files = ((member.parts, member) for member in ZipTree(place).members())
    else:
        found = (path for side in _SIDES for path in sorted(place.glob(f"*/{side}/*")))
        files = ((path.relative_to(place).parts, path) for path in found if path.is_file())
    for path, file in files:
        wanted = len(path) > 2 and path[-2] in _SIDES and file.suffix.lower() == ".off"
        if wanted and not any(map(is_hidden, path)):
            yield path, file


def _find(root: Path) -> Path:
    """Return the folder of categories, or the archive, that `root` is or holds.

    Raises:
        DataError: there is none, or several that are not named as published.
    """
    if root.is_file() or _has_layout(root):
        return root
    for name in _NAMES:
        for place in (root / name, root / f"{name}.zip"):
            if _has_layout(place) or place.is_file():
                return place
    entries = sorted(p for p in root.iterdir() if not is_hidden(p.name)) if root.is_dir() else []
    likely = [p for p in entries if p.name.lower().startswith("modelnet")]
    found = [p for p in entries if _has_layout(p) or (p in likely and p.suffix == ".zip")]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(str(p) for p in found)
        raise DataError(f"{root} holds more than one data set: set data.root to one of {names}")
    packed = [p.name for p in likely if p.is_file()]
    raise DataError(
        f"{root} is not ModelNet: neither it nor ModelNet40, ModelNet10 or an archive of theirs in "
        "it has <category>/train/*.off; set data.root to the folder that does"
        + (f", or unpack {', '.join(packed)}" if packed else "")
    )


def _has_layout(folder: Path) -> bool:
    """Return whether a folder holds categories with a folder `train` or `test`."""
    if not folder.is_dir():
        return False
    categories = (p for p in folder.iterdir() if not is_hidden(p.name))
    return any((p / side).is_dir() for p in categories for side in _SIDES)
