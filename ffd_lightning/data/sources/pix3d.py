"""Pix3D: photographs of furniture, each with a mask and the mesh of what it shows."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from dataclasses import astuple, dataclass, field
from functools import cache
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

from ffd_lightning.data.reading.files import files_below
from ffd_lightning.data.reading.frame import Up, check_turn, into_frame, mean_azimuth, turn
from ffd_lightning.data.reading.mesh_file import read_with_notes
from ffd_lightning.data.sources.base import SourceShape, Survey
from ffd_lightning.data.splits import HashSplit, SplitInput
from ffd_lightning.errors import ConfigError, DataError, RejectedShapeError
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.geometry.normalization import bounding_box
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.pictures import OBJECT_FILL, cut_out, fit_picture

FLAWS = ("truncated", "occluded", "slightly_occluded")
"""What a photograph can be left out for."""

_LOADER_VERSION = 3  # part of the fingerprint: raise it when the same files give something else
_LIST = "pix3d.json"
_TRAIN_FRACTION = 0.8
_FRONT = 45  # degrees within which cameras stand before an object


@dataclass(frozen=True)
class _Photo:
    """One entry of pix3d.json: its paths, box, flaws, camera, and why it cannot be used."""

    img: str
    mask: str
    model: str
    box: tuple[float, ...]
    flaws: tuple[str, ...]
    camera: tuple[float, ...]
    problem: str

    @property
    def shape(self) -> str:
        """What is photographed: the mesh's folder `model/<category>/<name>`."""
        return "/".join(PurePosixPath(self.model).parts[:3])


@dataclass
class Pix3dSource:
    """Pix3D as downloaded: `root/pix3d.json` and the folders `img`, `mask` and `model` beside it.

    One shape is one photograph; its id is the stem of the photograph's name, `0001`, with `-2` and
    so on where a category has it more than once. The object is cut out, laid on white and made as
    large as objects are in rendered training images. What pix3d.json names outside `root` is not
    read.

    Convention:
        y up and facing -z, the project's own frame: the authors' README has +x leftward, +y
        upward, +z inward (away from the viewer) in the view from the front; and of one bed's
        cameras almost all were found at negative z (github.com/xingyuansun/pix3d issue 24).
        `facing` tells for the files at hand.

    Attributes:
        root: what `data.root` names.
        height, width: of the images, in pixels.
        leave_out: photographs with any of these of `FLAWS` are passed over.
        up: the axis that points up in the meshes.
        yaw: degrees to turn meshes by about the vertical after that, see `frame.turn`.
    """

    root: Path
    height: int = 192
    width: int = 256
    leave_out: tuple[str, ...] = ("truncated", "occluded")
    up: Up = "y"
    yaw: float = 0.0
    _photos: dict[str, dict[str, _Photo]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        self.root, self.leave_out = Path(self.root), tuple(self.leave_out)
        unknown = sorted(set(self.leave_out) - set(FLAWS))
        if unknown:
            raise ConfigError(f"data.leave_out has {unknown[0]!r}: choose from {', '.join(FLAWS)}")
        check_turn(self.up, self.yaw)

    def __getstate__(self) -> dict[str, object]:
        return {**self.__dict__, "_photos": {}}  # read again where it is needed

    def categories(self) -> list[str]:
        """Return the categories of which photographs are left, sorted.

        Raises:
            DataError: pix3d.json is missing or broken.
        """
        return sorted(name for name, photos in self._read().items() if self._usable(photos))

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all photographs of `category` that are not left out, sorted.

        Raises:
            DataError: none are left, or there are none; the message lists what there is.
        """
        return sorted(self._category(category))

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return a mesh and the photograph of it, (1, height, width, 4).

        Raises:
            RejectedShapeError: it cannot be used; the message is the reason.
            DataError: there is no such category.
        """
        photo = self._category(category).get(shape_id)
        if photo is None:
            raise RejectedShapeError(f"there is no photograph {shape_id!r} of {category!r}")
        if photo.problem:
            raise RejectedShapeError(photo.problem)
        file = self.root / photo.model
        if not file.is_file():
            raise RejectedShapeError(f"it has no {photo.model}")
        cut = cut_out(self.root, photo.img, photo.mask, photo.box)
        image = fit_picture(cut, self.height, self.width, OBJECT_FILL)
        around = [file.parent.joinpath(*path) for path in files_below(file.parent)]
        mesh, notes = read_with_notes(file, around)
        mesh = into_frame(mesh, self.up, self.yaw)
        shape = SourceShape(mesh, images=image[None], cameras=self._cameras(photo, mesh))
        return shape.warned(*notes)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return the settings, and a hash over all entries that are used and their files' sizes.

        Those beside the mesh count too: its materials and textures.
        """

        @cache
        def beside(folder: Path) -> list[tuple[tuple[str, ...], int]]:
            return [(path, stat.st_size) for path, stat in files_below(folder).items()]

        digest = hashlib.sha256()
        for shape_id, photo in sorted(self._category(category).items()):
            names = () if photo.problem else (photo.img, photo.mask, photo.model)
            files = [self.root / name for name in names]
            sizes = [file.stat().st_size if file.is_file() else -1 for file in files]
            around = beside((self.root / photo.model).parent) if names else []
            entry = [shape_id, *astuple(photo), *sizes, around]
            digest.update(f"{json.dumps(entry)}\n".encode())
        return {
            "source": "pix3d",
            "loader": _LOADER_VERSION,
            "sha256": digest.hexdigest(),
            "leave_out": sorted(set(self.leave_out)),
            "height": self.height,
            "width": self.width,
            "fill": OBJECT_FILL,
            "up": self.up,
            "yaw": self.yaw,
        }

    def survey(self, category: str) -> Survey:
        """Tell how many photographs of how many shapes there are, what is missing, and the front.

        Raises:
            DataError: as `shape_ids`.
        """
        photos = self._category(category)
        faults = {i: photo.problem for i, photo in photos.items() if photo.problem}
        for shape_id, photo in photos.items():
            for name in (photo.img, photo.mask, photo.model):
                if shape_id not in faults and not (self.root / name).is_file():
                    faults[shape_id] = f"it has no {name}"
        shapes = len({photo.shape for photo in photos.values()})
        left_out = len(self._read()[category]) - len(photos)
        notes = [f"photographs of {shapes} shapes; {left_out} more are left out"]
        azimuth = self.facing(category)
        if azimuth is not None:
            meant = f": is data.yaw={(self.yaw + azimuth) % 360:.0f} meant?"
            notes.append(
                f"cameras stand at {azimuth:.0f} degrees from the front in the mean"
                + (meant if abs(azimuth) > _FRONT else "")
            )
        return Survey("photographs", faults, tuple(notes))

    def split(self, category: str) -> dict[str, str]:
        """Return "train" or "test" by id, 80 to 20 in expectation, by the hash of what is shown.

        So no photographs of a shape are on both sides. Pix3D itself has no split.
        """
        photos = self._category(category)
        shapes = tuple({photo.shape for photo in photos.values()})
        subsets = HashSplit(_TRAIN_FRACTION)(SplitInput(category, shapes, (), {}))
        return {shape_id: subsets[photo.shape] for shape_id, photo in photos.items()}

    def facing(self, category: str) -> float | None:
        """Return the mean azimuth of the cameras, see `frame.mean_azimuth`; None if unknown.

        People photograph furniture from the front, so this is about 0 where the meshes, turned by
        `up` and `yaw`, face -z.

        Raises:
            DataError: there is no such category.
        """
        cameras = [photo.camera for photo in self._category(category).values() if photo.camera]
        return mean_azimuth(turn(cameras, self.up, self.yaw)) if cameras else None

    def _cameras(self, photo: _Photo, mesh: Mesh) -> tuple[Camera] | None:
        """Return a camera that sees the shape from where the photographer stood.

        It frames the shape, since the photograph is cut out and scaled to.
        """
        if not photo.camera:
            return None
        x, y, z = turn(photo.camera, self.up, self.yaw).tolist()
        azimuth, elevation = math.atan2(x, -z), math.atan2(y, math.hypot(x, z))
        center, diagonal = bounding_box(mesh.vertices, mesh.faces)
        camera = Camera(math.degrees(azimuth), math.degrees(elevation))
        return (camera.moved(-center / diagonal, diagonal),)

    def _usable(self, photos: dict[str, _Photo]) -> dict[str, _Photo]:
        """Return the photographs that are not left out."""
        return {i: p for i, p in photos.items() if not set(p.flaws) & set(self.leave_out)}

    def _category(self, category: str) -> dict[str, _Photo]:
        photos = self._read().get(category)
        if photos is None:
            there = ", ".join(self.categories()) or "nothing"
            raise DataError(f"{self.root / _LIST} has no {category}; it has: {there}")
        usable = self._usable(photos)
        if not usable:
            raise DataError(
                f"all {len(photos)} photographs of {category} are left out: shorten "
                f"data.leave_out=[{','.join(self.leave_out)}]"
            )
        return usable

    def _read(self) -> dict[str, dict[str, _Photo]]:
        """Return all photographs by category and id, those that are left out too."""
        if not self._photos:
            found: dict[str, dict[str, _Photo]] = {}
            for category, photo in _entries(self.root / _LIST):
                photos = found.setdefault(category, {})
                stem = PurePosixPath(photo.img).stem
                names = (stem if k == 1 else f"{stem}-{k}" for k in range(1, len(photos) + 2))
                photos[next(name for name in names if name not in photos)] = photo
            self._photos = found
        return self._photos


def _entries(file: Path) -> Iterator[tuple[str, _Photo]]:
    """Yield the category and the photograph of each entry of pix3d.json.

    Raises:
        DataError: it is missing or broken, or an entry does not say what it is of.
    """
    try:
        entries = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(
            f"{file} cannot be read ({error.strerror}): set data.root to Pix3D's folder, which "
            f"holds {_LIST}, img, mask and model"
        ) from None
    except (ValueError, RecursionError) as error:
        raise DataError(f"{file} is damaged or incomplete ({error}): get it again") from None
    if not isinstance(entries, list) or not entries:
        raise DataError(f"{file} is not Pix3D's: it must be a list of photographs")
    for number, entry in enumerate(entries):
        fields: dict[str, Any] = entry if isinstance(entry, dict) else {}
        for key in ("category", "img"):
            if not isinstance(fields.get(key), str) or not fields[key]:
                raise DataError(f"entry {number} (from 0) of {file} has no {key!r}")
        yield fields["category"], _photo(fields)


def _photo(fields: dict[str, Any]) -> _Photo:
    """Return one entry's photograph."""
    problem = ""
    for key in ("img", "mask", "model"):
        path = fields.get(key)
        if not isinstance(path, str) or not path:
            problem = problem or f"its entry in {_LIST} has no {key!r}"
        elif PureWindowsPath(path).anchor or ".." in PureWindowsPath(path).parts:
            problem = problem or f"its {key} {path!r} leads out of the data set"
    box, camera = (_numbers(fields.get(key)) for key in ("bbox", "cam_position"))
    if len(box) != 4:
        problem = problem or f"its entry in {_LIST} has no 'bbox' of four numbers"
    return _Photo(
        img=str(fields.get("img", "")),
        mask=str(fields.get("mask", "")),
        model=str(fields.get("model", "")),
        box=box,
        # The README has them as the words "true" and "false", the file as JSON's.
        flaws=tuple(flaw for flaw in FLAWS if str(fields.get(flaw)).lower() in ("true", "1")),
        camera=camera if len(camera) == 3 else (),
        problem=problem,
    )


def _numbers(value: Any) -> tuple[float, ...]:
    """Return a list of finite numbers as it is, and () for anything else."""
    numbers = value if isinstance(value, list) else []
    good = all(isinstance(n, int | float) and math.isfinite(n) for n in numbers)
    return tuple(float(n) for n in numbers) if good else ()


def pix3d(
    root: Path,
    image_size: tuple[int, int],
    up: Up = "y",
    yaw: float = 0.0,
    leave_out: tuple[str, ...] = ("truncated", "occluded"),
) -> Pix3dSource:
    """Pix3D's photographs, cut out by their masks.

    Args:
        root: with pix3d.json beside img, mask and model.
        image_size: (height, width) of the images in pixels.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
        leave_out: kinds of photographs that are passed over.
    """
    return Pix3dSource(root, *image_size, leave_out, up, yaw)
