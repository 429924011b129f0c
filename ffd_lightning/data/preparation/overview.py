"""What a user should know of a set that has just been prepared: in lines, and in a picture.

Below what the network sees, embedded shapes and some of the set are drawn from the same
sides, so that a wrong `up` or `yaw` is seen at a glance; and below those, what probably stands
otherwise than the rest.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import product, starmap
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning import shapes
from ffd_lightning.data.categories import name_of
from ffd_lightning.data.preparation.prepared import MANIFEST, PreparedSet
from ffd_lightning.data.reading.orientation import ORIENTATIONS, Orientation, turn_anew
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.geometry.mesh import Mesh, normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.framing import fit_picture
from ffd_lightning.imaging.grid import grid, joined, png, write
from ffd_lightning.imaging.rendering import render

SHOWN = 32
"""Shapes of which an image is shown."""

_NAMED = 3  # kinds of reasons for which shapes were rejected
_KINDS = 6  # of warnings in one line; a source of one's own may word each its own way
_SUGGESTED = 20  # shapes with a line for the table
_HEAD = "id,yaw,up"  # of the table
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


def suggested_of(folder: Path) -> Path:
    """Return where the table is of a prepared set's shapes that probably stand wrongly, if any."""
    return sheet_of(folder).with_suffix(".csv")


def describe(prepared: PreparedSet) -> list[str]:
    """Return what was prepared and rejected, and in a line of its own the warnings by kind."""
    size = sum(prepared.file(row).stat().st_size for row in range(len(prepared)))
    shapes = len(prepared.originals)
    made = f" and {len(prepared) - shapes} variants of them" if prepared.origins else ""
    line = f"prepared {shapes} shapes{made} in {prepared.path} ({size / 1e6:.0f} MB)"
    if rejected := prepared.rejected:
        why = some_reasons(rejected)
        line += f"; rejected {len(rejected)} ({why}), see {prepared.path / MANIFEST}"
    lines = [line]
    if counted := count_warnings(prepared):
        lines.append(f"warnings: {counted}; see {prepared.path / MANIFEST}")
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


def present_pose(prepared: PreparedSet, shape_id: str) -> Orientation | None:
    """Return how a shape of one category was turned; None if its source has no table of that."""
    source = prepared.manifests[0]["settings"]["source"]
    if source.get("source") != "folder":
        return None
    own = source.get("orientations", {})
    return Orientation(*own.get(shape_id, (source["up"], source["yaw"])))


def suggestion(prepared: PreparedSet, likely: Mapping[str, Orientation]) -> list[str]:
    """Return what to say of shapes that probably stand wrongly, and lines for their table."""
    if not likely:
        return []
    named = list(likely.items())[:_SUGGESTED]
    left = len(likely) - len(named)
    more = [f"and {left} more, see {suggested_of(prepared.path)}"] if left else []
    return [
        f"{len(likely)} of {len(prepared)} shapes probably stand otherwise than the rest: see the "
        f"contact sheet; these lines in {ORIENTATIONS} beside the meshes turn them:",
        *(_HEAD, *starmap(_line, named), *more),
    ]


def _line(shape_id: str, pose: Orientation) -> str:
    """Return a line of the table of orientations.

    >>> _line("chair, red", Orientation("z", 90.0))
    '"chair, red",90,z'
    """
    if set(shape_id) & set(',"'):
        shape_id = '"' + shape_id.replace('"', '""') + '"'
    return f"{shape_id},{pose.yaw:g},{pose.up}"


def count_warnings(prepared: PreparedSet) -> str:
    """Return how many shapes have each of the commonest kinds of warning, as text."""
    counts: Counter[str] = Counter()
    for lines in prepared.warnings.values():
        counts.update(dict.fromkeys(line.partition(": ")[0] for line in lines).keys())
    shapes = len(prepared.originals)
    parts = [f"{kind} ({count} of {shapes})" for kind, count in counts.most_common(_KINDS)]
    more = [f"{len(counts) - _KINDS} more kinds"] if len(counts) > _KINDS else []
    return "; ".join(parts + more)


def write_sheet(
    prepared: PreparedSet, file: Path, likely: Mapping[str, Orientation] | None = None
) -> str:
    """Write a set's contact sheet, a PNG, and say where it is, or why it could not be written.

    `likely` is what `poses.likely_poses` finds; a table of it is written beside the sheet.
    """
    try:
        write_bytes_atomic(file, png(draw_set(prepared, likely or {})))
        if likely:
            lines = "\n".join([_HEAD, *starmap(_line, likely.items()), ""])
            write_bytes_atomic(file.with_suffix(".csv"), lines.encode())
    except OSError as error:  # the set itself is there
        return f"the contact sheet cannot be written: {error.strerror or error}: {file}"
    return f"contact sheet: {file}"


def draw_set(prepared: PreparedSet, likely: Mapping[str, Orientation]) -> Image.Image:
    """Draw the first image of up to 32 shapes of a set, and some shapes from four sides.

    Of those that probably stand otherwise, eight are drawn as they do and as they should; of a set
    with variants, a row of these.
    """
    whole, prepared = prepared, prepared.originals
    views, category = prepared.spread_views(range(len(prepared)), SHOWN), prepared.category(0)
    rows = [row for row, _ in views]
    seen = _first_images(prepared, rows)
    known, expected = _embedded(category), _expected(category)
    own = [row for row, _ in prepared.spread_views(range(len(prepared)), _POSED)]
    cameras = [prepared.camera(row) for row in own]
    title = f"right orientation: {category if known else 'any shape'}"
    left = _poses(expected, [cameras[min(k, len(own) - 1)] for k in range(len(expected))])
    right = _poses([(prepared.ids[row], prepared.mesh(row)) for row in own], cameras)
    turning = "the same sides of shapes of the set"
    if usual := present_pose(prepared, ""):
        turning = f"data.up={usual.up} data.yaw={usual.yaw:g} turn all, {ORIENTATIONS} single ones"
    poses = [
        _headed(left, title, "embedded shapes: front to -z, y up"),
        _headed(right, "orientation of this set", turning),
    ]
    which = f"{len(rows)} of {len(prepared)} shapes, the first image of each, {prepared.path.name}"
    sheets = [_headed(seen, f"{category}: what the network sees", which)]
    if whole.origins:
        made = [row for row, i in enumerate(whole.ids) if i in whole.origins]
        some = [row for row, _ in whole.spread_views(made, _COLUMNS)]
        note = f"{len(some)} of {len(made)} variants of these shapes, that are only trained on"
        sheets.append(_headed(_first_images(whole, some), "deformed variants", note))
    return joined([*sheets, joined(poses, across=True), *_suggested(prepared, likely)])


def _suggested(prepared: PreparedSet, likely: Mapping[str, Orientation]) -> list[Image.Image]:
    """Draw some shapes as they stand, and below as they probably should; nothing of none."""
    if not likely:
        return []
    shown = list(likely.items())[:_COLUMNS]
    before, after = [], []
    for shape_id, pose in shown:
        row, present = prepared.index(shape_id), present_pose(prepared, shape_id)
        assert present is not None
        mesh, camera = prepared.mesh(row), prepared.camera(row)
        before.append(_drawn(mesh, camera))
        turned = mesh.with_vertices(turn_anew(mesh.vertices, present, pose))
        after.append(_drawn(turned, camera))
    labels = [i for i, _ in shown] + [*starmap(_line, shown)]
    pictures = grid([*before, *after], len(shown), labels, font_size=_FONT)
    note = f"{len(shown)} of {len(likely)}, and as these lines of {ORIENTATIONS} turn them"
    return [_headed(pictures, "probably standing otherwise than the rest", note)]


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
            cells.append(_drawn(mesh, camera))
        labels += [name, *[""] * len(_SIDES)]
    heads = [*_SIDES, "as its first image"]
    return grid(cells, len(heads), labels, heads, _FONT)


def _drawn(mesh: Mesh, camera: Camera) -> NDArray[np.uint8]:
    """Draw a mesh over grey."""
    image = render(mesh, camera, height=_HEIGHT, width=_WIDTH, samples=2)
    uncovered = 1 - image[..., 3:] / 255
    over_grey = image[..., :3] - uncovered * (255 - np.array(_GREY))
    return np.clip(np.round(over_grey), 0, 255).astype(np.uint8)


def _headed(sheet: Image.Image, title: str, note: str) -> Image.Image:
    """Return a sheet below a title and a note."""
    head = Image.new("RGB", (sheet.width, 60), "white")
    write(head, title, 4, 18, 20)
    write(head, note, 4, 43, 14, color=(110, 118, 128))
    return joined([head, sheet])
