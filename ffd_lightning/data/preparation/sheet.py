"""A picture of a prepared set: what the network sees, and how shapes stand beside how they should.

Below the images, embedded shapes of the category and some of the set's own are drawn from the same
sides, so that a wrong `up` or `yaw` is seen at a glance.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from ffd_lightning import shapes
from ffd_lightning.data.preparation.pose import embedded_category
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render

SHOWN = 32
"""Shapes of which an image is shown."""

Ink = tuple[int, int, int]

_COLUMNS = 8
_CELL = (192, 144)  # pixels: width, height
_GAP, _MARGIN, _LABEL = 8, 28, 20
_LINE, _TOP = _CELL[1] + _LABEL + _GAP, 96  # from a row to the next; above the first
_POSED = 3  # shapes that are drawn from all sides
_HEAD = 116  # above their pictures: a title, three lines, and what side is seen
_WIDTH = 2 * _MARGIN + _COLUMNS * _CELL[0] + (_COLUMNS - 1) * _GAP
_INK, _SOFT, _WARM = (28, 32, 38), (110, 118, 128), (176, 58, 20)
_PAPER, _GROUND, _EXPECTED = (255, 255, 255), (228, 233, 239), (228, 237, 226)
_SIDES = (
    ("front", Camera(azimuth=0, elevation=10)),
    ("right side", Camera(azimuth=90, elevation=10)),
    ("top, front below", Camera(azimuth=0, elevation=90)),
)
_EXAMPLES = ("chair", "car", "plane")  # for categories without embedded shapes
_ANY_TITLE = "how shapes should stand, of whatever category"
_LOOKED_AT = 20  # embedded shapes, to find different ones


def draw_set(prepared: PreparedSet, guess: str = "") -> Image.Image:
    """Draw up to 32 shapes of a set, spread over it, and what pose they are in.

    Args:
        prepared: the set.
        guess: what seems wrong with the pose, in words.
    """
    rows, category = _spread(prepared, SHOWN), prepared.category(0)
    poses = _TOP + -(-len(rows) // _COLUMNS) * _LINE + 28
    sheet = Image.new("RGB", (_WIDTH, poses + _HEAD + _POSED * _LINE + _MARGIN), _PAPER)
    draw = ImageDraw.Draw(sheet)
    _write(draw, (_MARGIN, 22), f"{category}: what the network sees", 26)
    which = f"{len(rows)} of {len(prepared)} shapes, the first image of each"
    _write(draw, (_MARGIN, 60), f"{which}   |   {prepared.path.name}", 14, _SOFT)
    for k, row in enumerate(rows):
        x, y = place = _place(k % _COLUMNS, k // _COLUMNS, _TOP)
        _paste(sheet, place, prepared.image(row)[..., :3])
        draw.rectangle((x, y, x + _CELL[0] - 1, y + _CELL[1] - 1), outline=_GROUND)
        _label(draw, place, prepared.ids[row])
    title = f"how a {category} should stand" if embedded_category(category) else _ANY_TITLE
    said = "embedded shapes: front to -z, y up"
    own = _spread(prepared, _POSED)
    cameras = [prepared.camera(row) for row in own]
    expected = _expected(category)
    seen_alike = [cameras[min(k, len(own) - 1)] for k in range(len(expected))]
    _draw_poses(sheet, (0, poses), (title, said, _SOFT), expected, seen_alike)
    said, ink = (guess, _WARM) if guess else ("the same sides of shapes of the set", _SOFT)
    meshes = [(prepared.ids[row], prepared.mesh(row)) for row in own]
    _draw_poses(sheet, (_COLUMNS // 2, poses), ("how these stand", said, ink), meshes, cameras)
    return sheet


def _spread(prepared: PreparedSet, count: int) -> list[int]:
    """Return at most `count` rows, evenly spread over a set."""
    places = np.linspace(0, len(prepared) - 1, min(len(prepared), count))
    return [int(place) for place in np.unique(places.astype(int))]


def _expected(category: str) -> list[tuple[str, Mesh]]:
    """Return embedded shapes that stand right, by name, their boxes' diagonals 1.

    They are of as many families of the category, or of other categories where it has none.
    """
    known = embedded_category(category)
    names = (known,) if known else _EXAMPLES
    found: dict[str, Mesh] = {}
    for index, name in product(range(_LOOKED_AT), names):
        mesh, family = shapes.build(name, index)
        mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
        found.setdefault(f"{name}, {family}", mesh)
        if len(found) == _POSED:
            break
    return list(found.items())


def _draw_poses(
    sheet: Image.Image,
    corner: tuple[int, int],
    heading: tuple[str, str, Ink],
    meshes: Sequence[tuple[str, Mesh]],
    cameras: Sequence[Camera],
) -> None:
    """Draw meshes from some sides, a row each, under a heading.

    Args:
        sheet: what to draw on.
        corner: the column of cells, and the height in pixels, where to begin.
        heading: a title, what is said below it, and in which colour.
        meshes: with their names.
        cameras: of the last column, one for each mesh.
    """
    draw, (column, top) = ImageDraw.Draw(sheet), corner
    title, said, ink = heading
    left, cells = _place(column, 0, top)[0], top + _HEAD
    _write(draw, (left, top), title, 20)
    views = [(name, [camera] * len(meshes)) for name, camera in _SIDES]
    views.append(("as its first image", list(cameras)))
    width = len(views) * (_CELL[0] + _GAP) - 2 * _GAP
    _write(draw, (left, top + 29), _wrapped(said, width, 14), 14, ink)
    ground = _GROUND if column else _EXPECTED
    for k, (name, sides) in enumerate(views):
        _write(draw, (_place(column + k, 0, top)[0], cells - 24), name, 14, _SOFT)
        for line, (_, mesh) in enumerate(meshes):
            image = render(mesh, sides[line], height=_CELL[1], width=_CELL[0], samples=2)
            _paste(sheet, _place(column + k, line, cells), _laid_over(image, ground))
    for line, (name, _) in enumerate(meshes):
        _label(draw, _place(column, line, cells), name)


def _laid_over(image: NDArray[np.uint8], ground: Ink) -> NDArray[np.uint8]:
    """Lay an image over white, (h, w, 4), over a colour instead: white shapes are seen there."""
    uncovered = 1 - image[..., 3:] / 255
    result = image[..., :3] - uncovered * (255 - np.array(ground))
    return np.clip(np.round(result), 0, 255).astype(np.uint8)


def _place(column: int, line: int, top: int) -> tuple[int, int]:
    """Return the upper left corner of a cell."""
    x = _MARGIN + column * (_CELL[0] + _GAP)
    return x, top + line * _LINE


def _paste(sheet: Image.Image, place: tuple[int, int], image: NDArray[np.uint8]) -> None:
    """Put an image into the middle of a cell, as large as it fits."""
    picture = Image.fromarray(image)
    scale = min(_CELL[0] / picture.width, _CELL[1] / picture.height)
    size = max(1, round(picture.width * scale)), max(1, round(picture.height * scale))
    if size != picture.size:
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    x, y = (place[i] + (_CELL[i] - size[i]) // 2 for i in (0, 1))
    sheet.paste(picture, (x, y))


def _label(draw: ImageDraw.ImageDraw, place: tuple[int, int], text: str) -> None:
    """Write a name below a cell; of a long one the middle is left out."""
    font = ImageFont.load_default(12)
    short, kept = text, len(text)
    while draw.textlength(short, font) > _CELL[0] and kept > 2:
        kept -= 1
        short = f"{text[: -(-kept // 2)]}...{text[len(text) - kept // 2 :]}"
    _write(draw, (place[0], place[1] + _CELL[1] + 2), short, 12, _SOFT)


def _wrapped(text: str, width: int, size: int) -> str:
    """Break a text into lines of at most this many pixels."""
    font, lines = ImageFont.load_default(size), [""]
    for word in text.split():
        longer = f"{lines[-1]} {word}".strip()
        if font.getlength(longer) <= width:
            lines[-1] = longer
        else:
            lines.append(word)
    return "\n".join(lines)


def _write(
    draw: ImageDraw.ImageDraw,
    place: tuple[int, int],
    text: str,
    size: int,
    ink: Ink = _INK,
) -> None:
    draw.text(place, text, ink, ImageFont.load_default(size))
