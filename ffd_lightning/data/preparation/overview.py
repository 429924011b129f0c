"""What a user should know of a set that has just been prepared: in lines, and in a picture.

Below what the network sees, embedded shapes and some of the set are drawn from the same
sides, so that a wrong `up` or `yaw` is seen at a glance.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np
from PIL import Image

from ffd_lightning import shapes
from ffd_lightning.data.categories import name_of
from ffd_lightning.data.preparation.prepared import MANIFEST, PreparedSet, spread_rows
from ffd_lightning.data.reading.orientation import ORIENTATIONS
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.geometry.mesh import Mesh, normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.framing import fit_picture
from ffd_lightning.imaging.grid import grid, joined, png, write
from ffd_lightning.imaging.rendering import render
from ffd_lightning.terminal import counted

SHOWN = 32
"""Shapes of which an image is shown."""

_NAMED = 3  # kinds of reasons for which shapes were rejected
_KINDS = 6  # of warnings in one line; a source of one's own may word each its own way
_COLUMNS = 8
_HEIGHT, _WIDTH = 144, 192  # pixels, of a cell
_POSED = 3  # shapes that are drawn from all sides
_FONT = 12
_GREY = (228, 233, 239)  # behind shapes, so that white ones are seen
_SIDES = {
    "front": Camera(azimuth=0, elevation=10),
    "right side": Camera(azimuth=90, elevation=10),
    "top, front below": Camera(azimuth=0, elevation=90),
}
_EXAMPLES = ("chair", "car", "plane")  # for categories without embedded shapes
_LOOKED_AT = 20  # embedded shapes, to find different ones


def sheet_of(folder: Path) -> Path:
    """Return where a prepared set's contact sheet is: not in its folder, which never changes."""
    return folder.parents[1] / "sheets" / f"{folder.name}.png"


def describe(prepared: PreparedSet) -> list[str]:
    """Return what was prepared and rejected, and in a line of its own the warnings by kind."""
    size = sum(prepared.file(row).stat().st_size for row in range(len(prepared)))
    shapes = len(prepared.originals)
    made = f" and {counted(len(prepared) - shapes, 'variant')}" if prepared.origins else ""
    line = f"prepared {counted(shapes, 'shape')}{made} in {prepared.path} ({size / 1e6:.0f} MB)"
    if rejected := prepared.rejected:
        why = some_reasons(rejected)
        line += f"; rejected {len(rejected)} ({why}), see {prepared.path / MANIFEST}"
    lines = [line]
    if kinds := count_warnings(prepared):
        lines.append(f"warnings: {kinds}; see {prepared.path / MANIFEST}")
    return lines


def some_reasons(reasons: Mapping[str, str]) -> str:
    """Return an example of each of the commonest reasons, by id, as text.

    As with warnings, what comes before the first colon of a reason is its kind.
    """
    alike: dict[str, list[str]] = {}
    for shape_id, why in reasons.items():
        alike.setdefault(why.partition(": ")[0], []).append(shape_id)
    kinds = sorted(alike.values(), key=len, reverse=True)
    parts = [
        f"{shape_id}{f' and {len(others)} more' if others else ''}: {reasons[shape_id]}"
        for shape_id, *others in kinds[:_NAMED]
    ]
    return "; ".join([*parts, *(["..."] if len(kinds) > _NAMED else [])])


def count_warnings(prepared: PreparedSet) -> str:
    """Return how many shapes have each of the commonest kinds of warning, as text."""
    counts: Counter[str] = Counter()
    for lines in prepared.warnings.values():
        counts.update(dict.fromkeys(line.partition(": ")[0] for line in lines).keys())
    shapes = len(prepared.originals)
    parts = [f"{kind} ({count} of {shapes})" for kind, count in counts.most_common(_KINDS)]
    more = [counted(len(counts) - _KINDS, "more kind")] if len(counts) > _KINDS else []
    return "; ".join(parts + more)


def write_sheet(prepared: PreparedSet, file: Path) -> str:
    """Write a set's contact sheet, a PNG, and say where it is, or why it could not be written."""
    try:
        write_bytes_atomic(file, png(draw_set(prepared)))
    except OSError as error:  # the set itself is there
        return f"the contact sheet cannot be written: {error.strerror or error}: {file}"
    return f"contact sheet: {file}"


def draw_set(prepared: PreparedSet) -> Image.Image:
    """Draw the first image of up to 32 shapes of a set, some of its variants, and four sides."""
    whole, prepared = prepared, prepared.originals
    rows, category = spread_rows(len(prepared), SHOWN).tolist(), prepared.category(0)
    seen = _first_images(prepared, rows)
    known, expected = _embedded(category), _expected(category)
    own = spread_rows(len(prepared), _POSED).tolist()
    cameras = [prepared.camera(row) for row in own]
    title = f"right orientation: {category if known else 'any shape'}"
    left = _poses(expected, [cameras[min(k, len(own) - 1)] for k in range(len(expected))])
    right = _poses([(prepared.ids[row], prepared.mesh(row)) for row in own], cameras)
    source = prepared.manifests[0]["settings"]["source"]
    turning = "the same sides of shapes of the set"
    if source.get("source") == "folder":
        up, yaw = source["up"], source["yaw"]
        turning = f"data.up={up} data.yaw={yaw:g} turn all, {ORIENTATIONS} single ones"
    poses = [
        _headed(left, title, "embedded shapes: front to -z, y up"),
        _headed(right, "orientation of this set", turning),
    ]
    which = f"{len(rows)} of {len(prepared)} shapes, the first image of each, {prepared.path.name}"
    sheets = [_headed(seen, f"{category}: what the network sees", which)]
    if whole.origins:
        made = [row for row, i in enumerate(whole.ids) if i in whole.origins]
        some = [made[k] for k in spread_rows(len(made), _COLUMNS)]
        note = f"{len(some)} of {len(made)} variants of these shapes, that are only trained on"
        sheets.append(_headed(_first_images(whole, some), "deformed variants", note))
    return joined([*sheets, joined(poses, across=True)])


def _first_images(prepared: PreparedSet, rows: Sequence[int]) -> Image.Image:
    images = [
        fit_picture(Image.fromarray(prepared.image(row)), _HEIGHT, _WIDTH)[..., :3] for row in rows
    ]
    return grid(images, _COLUMNS, [prepared.ids[row] for row in rows], font_size=_FONT)


def _embedded(category: str) -> str:
    """Return the embedded category of the same objects, "" if there is none.

    >>> _embedded("03001627"), _embedded("rifle"), _embedded("mug")
    ('chair', 'firearm', '')
    """
    name = name_of(category)
    name = {"rifle": "firearm", "telephone": "cellphone"}.get(name, name)
    return name if name in shapes.categories() else ""


def _expected(category: str) -> list[tuple[str, Mesh]]:
    """Return embedded shapes by name, their boxes' diagonals 1.

    They are of as many families of the category, or of other categories where it has none.
    """
    known = _embedded(category)
    found: dict[str, Mesh] = {}
    for index, name in product(range(_LOOKED_AT), (known,) if known else _EXAMPLES):
        mesh, family = shapes.build(name, index)
        mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
        found.setdefault(f"{name}, {family}", mesh)
        if len(found) == _POSED:
            break
    return list(found.items())


def _poses(meshes: Sequence[tuple[str, Mesh]], cameras: Sequence[Camera]) -> Image.Image:
    """Draw named meshes from some sides, a row each, and last by a camera of its own."""
    cells, labels = [], []
    for (name, mesh), own in zip(meshes, cameras, strict=True):
        for camera in (*_SIDES.values(), own):
            image = render(mesh, camera, height=_HEIGHT, width=_WIDTH, samples=2)
            uncovered = 1 - image[..., 3:] / 255  # over grey
            over_grey = image[..., :3] - uncovered * (255 - np.array(_GREY))
            cells.append(np.clip(np.round(over_grey), 0, 255).astype(np.uint8))
        labels += [name, *[""] * len(_SIDES)]
    heads = [*_SIDES, "as its first image"]
    return grid(cells, len(heads), labels, heads, _FONT)


def _headed(sheet: Image.Image, title: str, note: str) -> Image.Image:
    head = Image.new("RGB", (sheet.width, 60), "white")
    write(head, title, 4, 18, 20)
    write(head, note, 4, 43, 14, color=(110, 118, 128))
    return joined([head, sheet])
