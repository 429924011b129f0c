"""Pix3D: photographs of furniture, each with a mask and the mesh of what it shows."""

import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

import ffd_lightning as ffd
from ffd_lightning.data.reading.files import files_below
from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.data.reading.orientation import Up, check_orientation, orient, turn
from ffd_lightning.data.splits import HashSplit
from ffd_lightning.errors import DataError, RejectedShapeError, is_of_machine
from ffd_lightning.geometry.mesh import bounding_box
from ffd_lightning.imaging.camera import Camera

FLAWS = ("truncated", "occluded", "slightly_occluded")
"""What a photograph can be left out for."""
OBJECT_FILL = 0.82
"""How large objects are in rendered training images: the larger side / the image's height."""

_LIST = "pix3d.json"
_TRAIN_FRACTION = 0.8


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


@ffd.component("source", "pix3d")
class Pix3dSource(ffd.Source):
    """Pix3D as downloaded: `root/pix3d.json` and the folders `img`, `mask` and `model` beside it.

    One shape is one photograph; its id is the stem of the photograph's name, `0001`, with `-2` and
    so on where a category has it more than once. The object is cut out and as large as objects are
    in rendered training images. What pix3d.json names outside `root` is not read.

    Convention:
        y up and facing -z, the project's own frame: the authors' README has +x leftward, +y
        upward, +z inward (away from the viewer) in the view from the front.

    Args:
        root: with pix3d.json beside img, mask and model.
        up: the axis of the meshes that points up.
        yaw: degrees about the vertical, anticlockwise from above, until they face -z.
        without: kinds of photographs that are passed over: truncated, occluded,
            slightly_occluded.
    """

    own_images = True

    def __init__(
        self,
        root: Path,
        up: Up = "y",
        yaw: float = 0.0,
        without: Sequence[str] = ("truncated", "occluded"),
    ) -> None:
        check_orientation(up, yaw)
        if unknown := sorted(set(without) - set(FLAWS)):
            raise ValueError(f"without={unknown[0]} must be of {', '.join(FLAWS)}")
        self.root, self.up, self.yaw = Path(root), up, yaw
        self.without = tuple(sorted(set(without)))
        self._photos: dict[str, dict[str, _Photo]] = {}

    def categories(self) -> list[str]:
        """Return the categories of which photographs are left, sorted."""
        return sorted(name for name, photos in self._read().items() if photos)

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all photographs of a category that are not left out, sorted."""
        return sorted(self._category(category))

    def load(self, category: str, shape_id: str) -> ffd.SourceShape:
        """Return a mesh and the photograph of it; see `Source.load`."""
        photo = self._category(category).get(shape_id)
        if photo is None:
            raise RejectedShapeError(f"there is no photograph {shape_id!r} of {category!r}")
        if photo.problem:
            raise RejectedShapeError(photo.problem)
        file = self.root / photo.model
        if not file.is_file():
            raise RejectedShapeError(f"it has no {photo.model}")
        image = cut_out(self.root, photo.img, photo.mask, photo.box)
        around = [file.parent / path for path in files_below(file.parent)]
        mesh, notes = read_mesh(file, around)
        mesh = orient(mesh, self.up, self.yaw)
        cameras = self._cameras(photo, mesh)
        return ffd.SourceShape(mesh, images=[image], cameras=cameras).warned(*notes)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return the settings, and a hash over all entries that are used and their files' sizes."""
        digest = hashlib.sha256()
        for shape_id, photo in sorted(self._category(category).items()):
            names = () if photo.problem else (photo.img, photo.mask)
            files = [self.root / name for name in names]
            sizes: list[Any] = [f.stat().st_size if f.is_file() else -1 for f in files]
            beside = files_below((self.root / photo.model).parent) if names else {}
            sizes += [(path.as_posix(), stat.st_size) for path, stat in beside.items()]
            digest.update(f"{json.dumps([shape_id, *astuple(photo), *sizes])}\n".encode())
        return {
            "source": "pix3d",
            "sha256": digest.hexdigest(),
            "leave_out": list(self.without),
            "fill": OBJECT_FILL,
            "up": self.up,
            "yaw": self.yaw,
        }

    def rejected(self, category: str) -> dict[str, str]:
        """Return the photographs whose entries or files are not what they must be."""
        found = {}
        for shape_id, photo in self._category(category).items():
            names = (photo.img, photo.mask, photo.model)
            missing = next((name for name in names if not (self.root / name).is_file()), None)
            if photo.problem or missing:
                found[shape_id] = photo.problem or f"it has no {missing}"
        return found

    def split(self, category: str) -> dict[str, str]:
        """Return "train" or "test" by id, 80 to 20 in expectation, by the hash of what is shown.

        So no photographs of a shape are on both sides. Pix3D itself has no split.
        """
        photos = self._category(category)
        shapes = tuple({photo.shape for photo in photos.values()})
        subsets = HashSplit(_TRAIN_FRACTION)(ffd.SplitInput(category, shapes, (), {}))
        return {shape_id: subsets[photo.shape] for shape_id, photo in photos.items()}

    def _cameras(self, photo: _Photo, mesh: ffd.Mesh) -> tuple[Camera] | None:
        """Return a camera that sees the shape from where the photographer stood.

        It frames the shape, since the photograph is cut out.
        """
        if not photo.camera:
            return None
        x, y, z = turn(photo.camera, self.up, self.yaw).tolist()
        azimuth, elevation = math.atan2(x, -z), math.atan2(y, math.hypot(x, z))
        center, diagonal = bounding_box(mesh.vertices, mesh.faces)
        camera = Camera(math.degrees(azimuth), math.degrees(elevation))
        return (camera.moved(-center / diagonal, diagonal),)

    def _category(self, category: str) -> dict[str, _Photo]:
        found = self._read().get(category)
        if not found:
            why = "has no" if found is None else f"with data.without={list(self.without)} has no"
            there = ", ".join(self.categories()) or "nothing"
            raise DataError(f"{self.root / _LIST} {why} {category}; it has: {there}")
        return found

    def _read(self) -> dict[str, dict[str, _Photo]]:
        """Return the photographs that are not left out, by category and id."""
        if not self._photos:
            counts: dict[tuple[str, str], int] = {}
            for entry in _entries(self.root / _LIST):
                photo, category = _photo(entry), entry["category"]
                stem = PurePosixPath(photo.img).stem
                counts[category, stem] = number = counts.get((category, stem), 0) + 1
                photos = self._photos.setdefault(category, {})
                if not set(photo.flaws) & set(self.without):
                    photos[stem if number == 1 else f"{stem}-{number}"] = photo
        return self._photos


def cut_out(root: Path, img: str, mask: str, box: Sequence[float]) -> NDArray[np.uint8]:
    """Cut the object that a mask shows out of a photograph.

    Args:
        root: the folder that the files are in.
        img: the photograph.
        mask: what is brighter than half its brightest pixel is the object.
        box: left, top, right, bottom in pixels; what lies more than a pixel outside is not taken.

    Returns:
        (H, W, 4): the object, `OBJECT_FILL` of the height in size, and its mask.

    Raises:
        RejectedShapeError: a file is missing or damaged, the sizes differ, or the mask shows
            nothing in the box.
    """
    photo, shown = (np.array(_picture(root, name).convert("RGB")) for name in (img, mask))
    if photo.shape != shown.shape:
        sizes = f"{shown.shape[1]} x {shown.shape[0]} pixels, its photograph "
        raise RejectedShapeError(f"its mask has {sizes}{photo.shape[1]} x {photo.shape[0]}")
    left, top = (max(0, int(edge - 1)) for edge in box[:2])
    right, bottom = (max(0, int(edge + 1)) for edge in box[2:])
    grey = shown.max(axis=2)
    inside = grey[top:bottom, left:right] > int(grey.max()) / 2
    rows, columns = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        raise RejectedShapeError("its mask is empty")
    window = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    alpha = np.where(inside[window], 255, 0)[..., None]
    result = np.dstack([photo[top:bottom, left:right][window], alpha]).astype(np.uint8)
    height, width = result.shape[:2]
    margin = max(0, round(max(height, width) / OBJECT_FILL) - height)
    return np.pad(result, ((margin // 2, margin - margin // 2), (0, 0), (0, 0)))


def _picture(root: Path, name: str) -> Image.Image:
    try:
        with Image.open(root / name) as picture:
            picture.load()
        return picture
    except FileNotFoundError:
        raise RejectedShapeError(f"it has no {name}") from None
    except Exception as error:  # Pillow meets anything in a damaged file
        if is_of_machine(error):
            raise
        raise RejectedShapeError(f"{name} cannot be read ({error})") from error


def _entries(file: Path) -> list[dict[str, Any]]:
    try:
        entries = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise DataError(
            f"{file} cannot be read ({error.strerror}): set data.root to Pix3D's folder, which "
            f"holds {_LIST}, img, mask and model"
        ) from None
    except ValueError as error:
        raise DataError(f"{file} is damaged or incomplete ({error}): get it again") from None
    for number, entry in enumerate(entries):
        for key in ("category", "img"):
            if not isinstance(entry, dict) or not isinstance(entry.get(key), str):
                raise DataError(f"entry {number} (from 0) of {file} has no {key!r}")
    return entries


def _photo(entry: dict[str, Any]) -> _Photo:
    """Return one entry's photograph."""
    problem = ""
    for key in ("img", "mask", "model"):
        path = entry.get(key)
        if not isinstance(path, str) or not path:
            problem = problem or f"its entry in {_LIST} has no {key!r}"
        elif PureWindowsPath(path).anchor or ".." in PureWindowsPath(path).parts:
            problem = problem or f"its {key} {path!r} leads out of the data set"
    box, camera = (_numbers(entry.get(key)) for key in ("bbox", "cam_position"))
    if len(box) != 4:
        problem = problem or f"its entry in {_LIST} has no 'bbox' of four numbers"
    return _Photo(
        img=str(entry.get("img", "")),
        mask=str(entry.get("mask", "")),
        model=str(entry.get("model", "")),
        box=box,
        # The README has them as the words "true" and "false", the file as JSON's.
        flaws=tuple(flaw for flaw in FLAWS if str(entry.get(flaw)).lower() in ("true", "1")),
        camera=camera if len(camera) == 3 else (),
        problem=problem,
    )


def _numbers(value: Any) -> tuple[float, ...]:
    """Return a list of finite numbers as it is, and () for anything else."""
    numbers = value if isinstance(value, list) else []
    good = all(isinstance(n, int | float) and math.isfinite(n) for n in numbers)
    return tuple(float(n) for n in numbers) if good else ()
