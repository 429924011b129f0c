"""What a user should know of a set that has just been prepared: in lines, and in a picture.

Below what the network sees, embedded shapes and some of the set are drawn from the same
sides, so that a wrong `up` or `yaw` is seen at a glance.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning import shapes
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.preparation.prepared import MANIFEST, PreparedSet
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.geometry.mesh import Mesh, normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.grid import grid, joined, png, write
from ffd_lightning.imaging.rendering import render

_NAMED = 3  # shapes, with the reason for which they were rejected
_KINDS = 6  # of warnings in one line; a source of one's own may word each its own way
SHOWN = 32
"""Shapes of which an image is shown."""

Ink = tuple[int, int, int]

_COLUMNS = 8
_CELL = (192, 144)  # pixels: width, height
_POSED = 3  # shapes that are drawn from all sides
_FONT = 12
_GROUND, _EXPECTED = (228, 233, 239), (228, 237, 226)
_SIDES = {
    "front": Camera(azimuth=0, elevation=10),
    "right side": Camera(azimuth=90, elevation=10),
    "top, front below": Camera(azimuth=0, elevation=90),
}
_EXAMPLES = ("chair", "car", "plane")  # for categories without embedded shapes
_ANY_TITLE = "how shapes should stand, of whatever category"
_LOOKED_AT = 20  # embedded shapes, to find different ones


def sheet_of(folder: Path) -> Path:
    """Return where the picture of a prepared set is: not in its folder, which never changes."""
    return folder.parents[1] / "sheets" / f"{folder.name}.png"


def describe(prepared: PreparedSet) -> list[str]:
    """Return what was prepared and rejected, and in a line of its own the warnings by kind."""
    size = sum(prepared.file(row).stat().st_size for row in range(len(prepared)))
    line = f"prepared {len(prepared)} shapes in {prepared.path} ({size / 1e6:.0f} MB)"
    if prepared.rejected:
        first = "; ".join(f"{i}: {why}" for i, why in list(prepared.rejected.items())[:_NAMED])
        more = "; ..." if len(prepared.rejected) > _NAMED else ""
        count, file = len(prepared.rejected), prepared.path / MANIFEST
        line += f"; rejected {count} ({first}{more}), see {file}"
    lines = [line]
    if counted := count_warnings(prepared):
        lines.append(f"warnings: {counted}; see {prepared.path / MANIFEST}")
    return lines


def count_warnings(prepared: PreparedSet) -> str:
    """Return how many shapes have each of the commonest kinds of warning, in words."""
    counts: Counter[str] = Counter()
    for texts in prepared.warnings.values():
        counts.update({text.partition(": ")[0] for text in texts})
    total = f" of {len(prepared)}"
    parts = []
    for kind, count in counts.most_common(_KINDS):
        parts.append(f"{kind} ({count}{total})")
        total = ""
    if len(counts) > _KINDS:
        parts.append(f"{len(counts) - _KINDS} more kinds")
    return "; ".join(parts)


def write_sheet(prepared: PreparedSet, file: Path) -> str:
    """Draw a set into a PNG file, and say where it is, or why it could not be written.

    Args:
        prepared: the set.
        file: of the picture.
    """
    try:
        write_bytes_atomic(file, png(draw_set(prepared)))
    except OSError as error:  # the set itself is there
        return f"no picture could be written: {error.strerror or error}: {file}"
    return f"what they look like, and how they stand: {file}"


def draw_set(prepared: PreparedSet) -> Image.Image:
    """Draw up to 32 shapes of a set, spread over it, and from four sides how they stand."""
    rows, category = _spread(prepared, SHOWN), prepared.category(0)
    which = f"{len(rows)} of {len(prepared)} shapes, the first image of each"
    images = [_framed(prepared.image(row)[..., :3]) for row in rows]
    seen = grid(images, _COLUMNS, [prepared.ids[row] for row in rows], font_size=_FONT)
    own = _spread(prepared, _POSED)
    cameras = [prepared.camera(row) for row in own]
    expected = _expected(category)
    alike = [cameras[min(k, len(own) - 1)] for k in range(len(expected))]
    title = f"how a {category} should stand" if _embedded(category) else _ANY_TITLE
    left = _poses(expected, alike, _EXPECTED)
    right = _poses([(prepared.ids[row], prepared.mesh(row)) for row in own], cameras, _GROUND)
    poses = [
        _headed(left, title, "embedded shapes: front to -z, y up"),
        _headed(right, "how these stand", "the same sides of shapes of the set"),
    ]
    which = f"{which}   |   {prepared.path.name}"
    above = _headed(seen, f"{category}: what the network sees", which)
    return joined([above, joined(poses, across=True)])


def _spread(prepared: PreparedSet, count: int) -> list[int]:
    """Return at most `count` rows, evenly spread over a set."""
    places = np.linspace(0, len(prepared) - 1, min(len(prepared), count))
    return [int(place) for place in np.unique(places.astype(int))]


def _embedded(category: str) -> str:
    """Return the embedded category of the same objects, "" if there is none.

    >>> _embedded("03001627"), _embedded("rifle"), _embedded("mug")
    ('chair', 'firearm', '')
    """
    names = {synset: name for name, synset in SYNSETS.items()}
    name = names.get(category, category)
    name = {"rifle": "firearm", "telephone": "cellphone"}.get(name, name)
    return name if name in shapes.categories() else ""


def _expected(category: str) -> list[tuple[str, Mesh]]:
    """Return embedded shapes that stand right, by name, their boxes' diagonals 1.

    They are of as many families of the category, or of other categories where it has none.
    """
    known = _embedded(category)
    names = (known,) if known else _EXAMPLES
    found: dict[str, Mesh] = {}
    for index, name in product(range(_LOOKED_AT), names):
        mesh, family = shapes.build(name, index)
        mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
        found.setdefault(f"{name}, {family}", mesh)
        if len(found) == _POSED:
            break
    return list(found.items())


def _poses(
    meshes: Sequence[tuple[str, Mesh]], cameras: Sequence[Camera], ground: Ink
) -> Image.Image:
    """Draw meshes from some sides, a row each.

    Args:
        meshes: with their names.
        cameras: of the last column, one for each mesh.
        ground: colour behind them.
    """
    cells, labels = [], []
    for (name, mesh), own in zip(meshes, cameras, strict=True):
        for camera in (*_SIDES.values(), own):
            image = render(mesh, camera, height=_CELL[1], width=_CELL[0], samples=2)
            cells.append(_laid_over(image, ground))
        labels += [name, *[""] * len(_SIDES)]
    heads = [*_SIDES, "as its first image"]
    return grid(cells, len(heads), labels, heads, _FONT)


def _headed(sheet: Image.Image, title: str, below: str) -> Image.Image:
    """Return a sheet below a title and a line of smaller text."""
    head = Image.new("RGB", (sheet.width, 60), "white")
    write(head, title, 4, 18, 20)
    write(head, below, 4, 43, 14, color=(110, 118, 128))
    return joined([head, sheet])


def _laid_over(image: NDArray[np.uint8], ground: Ink) -> NDArray[np.uint8]:
    """Lay an image over white, (h, w, 4), over a colour instead: white shapes are seen there."""
    uncovered = 1 - image[..., 3:] / 255
    result = image[..., :3] - uncovered * (255 - np.array(ground))
    return np.clip(np.round(result), 0, 255).astype(np.uint8)


def _framed(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Put an image into the middle of a cell with a frame, as large as it fits."""
    picture = Image.fromarray(image)
    scale = min(_CELL[0] / picture.width, _CELL[1] / picture.height)
    size = max(1, round(picture.width * scale)), max(1, round(picture.height * scale))
    if size != picture.size:
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    cell = Image.new("RGB", _CELL, "white")
    cell.paste(picture, ((_CELL[0] - size[0]) // 2, (_CELL[1] - size[1]) // 2))
    framed = np.array(cell)
    framed[[0, -1]] = framed[:, [0, -1]] = _GROUND
    return framed
