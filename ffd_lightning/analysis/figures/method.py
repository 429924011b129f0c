"""The paper's figure 1, of any run: image, templates, lattice, deformation, mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from ffd_lightning.analysis.figures.drawing import (
    Color,
    View,
    bars,
    draw,
    draw_row,
    fitting_scale,
    joined,
    painted,
    rgba,
)
from ffd_lightning.analysis.figures.examples import Example
from ffd_lightning.analysis.figures.sheets import (
    CANDIDATES,
    DEFORMED,
    SIZE,
    TEMPLATE,
    TRUTH,
    font_size,
)
from ffd_lightning.evaluation.figures import cloud_mesh
from ffd_lightning.geometry.lattice import Degrees, lattice_edges
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.sheet import Line, Picture, Sheet, lay_out, side_by_side, text_width

LINE: Color = (110, 116, 132)
POINT: Color = (30, 34, 46)
OFFSET: Color = (230, 120, 0)
_ARROW: Color = (70, 74, 84)
_TRACK: Color = (226, 228, 232)

_LINE_RADIUS = 0.0035
_OFFSET_RADIUS = 0.004
_POINT_RADIUS = 0.011
_HIDDEN = 0.3  # how much of a line is seen through the mesh in front of it
_SMALLEST = 0.6  # of the other pictures' scale: no further do those of wide lattices shrink
_FINE = 4  # pixels drawn for each pixel of an arrow


def method(examples: Sequence[Example], size: int = SIZE, count: int = CANDIDATES) -> Sheet:
    """Draw a row per image: it, the templates, one in its lattice, both moved, mesh and truth.

    Source: the paper's figure 1.

    Args:
        examples: of one run, at least one.
        size: width of a cell in pixels; that of the templates' is half of it for four of them.
        count: templates at most, those of the greatest weights; fewer where they would be tiny.
    """
    rows = [_row(example, size, count) for example in examples]
    headings = ["input image", "template weights", "template in its lattice", "deformed lattice"]
    headings += ["deformed mesh", "ground truth"]
    # Columns are made one by one: the lines of their labels must be as many, to be in line.
    lines = max(label.count("\n") for row in rows for _, label in row)
    columns = []
    for k, heading in enumerate(headings):
        pictures, labels = zip(*(row[k] for row in rows), strict=True)
        columns.append(_column(pictures, [_of_lines(x, lines) for x in labels], heading, size))
        if k < len(headings) - 2:
            arrow = _arrow(size // 10, examples[0].view(size).height)
            blank = ["\n" * lines] * len(examples)
            columns.append(_column([arrow] * len(examples), blank, "", size))
    return side_by_side(columns)


def _column(
    cells: Sequence[Picture | Sheet], labels: Sequence[str], heading: str, size: int
) -> Sheet:
    return lay_out(cells, 1, labels, headings=[heading], font_size=font_size(size))


def _of_lines(label: str, breaks: int) -> str:
    return label + "\n" * (breaks - label.count("\n"))


def _row(example: Example, size: int, count: int) -> list[tuple[Picture | Sheet, str]]:
    """Return the cells of an image, with what is said below them: two lines at most."""
    view, bank = example.view(size), example.run.data.bank
    index = example.ranked()
    before = bank.control_points[index].double().numpy()
    after = before + example.offsets[index]
    still = painted(example.template().mesh(), TEMPLATE)
    moved = painted(example.deformed().mesh(), DEFORMED)
    truth = painted(example.truth.mesh(), TRUTH)
    offsets = bars(np.stack([before, after], axis=1), _OFFSET_RADIUS, OFFSET)
    frames = [lattice_mesh(points, bank.degrees) for points in (before, after)]
    frames[0] = joined([frames[0], offsets])
    scale, wide = _scales([still, moved, truth], frames, view)
    shown = min(count, len(bank), _most(view, size))
    number = " x ".join(str(degree + 1) for degree in bank.degrees)
    return [
        (example.image(view), example.name),
        (_weights(example, view, shown, size), _shown(example.weights, shown)),
        (with_lattice(still, frames[0], view, wide), bank.ids[index]),
        (with_lattice(moved, frames[1], view, wide), f"{number} control points"),
        (draw(moved, view, scale)[..., :3], example.score),
        (draw(truth, view, scale)[..., :3], ""),
    ]


def lattice_mesh(points: NDArray[np.float64], degrees: Degrees) -> Mesh:
    """Return control points, (M, 3), as dots, and lines between neighbours."""
    dots = cloud_mesh(points, _POINT_RADIUS, rgba([POINT] * len(points)))
    return joined([dots, bars(points[lattice_edges(degrees)], _LINE_RADIUS, LINE)])


def with_lattice(mesh: Mesh, lattice: Mesh, view: View, scale: float) -> Picture:
    """Draw a mesh in its lattice: what of this is behind the mesh is seen faintly through it."""
    whole = draw(joined([mesh, lattice]), view, scale)[..., :3].astype(float)
    alone = draw(lattice, view, scale).astype(float)
    # Where the lattice is in front the two are the same, and the mixture is, too.
    share = alone[..., 3:] / 255
    mixed = (1 - _HIDDEN * share) * whole + _HIDDEN * (alone[..., :3] - 255 * (1 - share))
    return np.round(mixed).clip(0, 255).astype(np.uint8)


def _scales(meshes: Sequence[Mesh], lattices: Sequence[Mesh], view: View) -> tuple[float, float]:
    """Return the scales at which meshes are seen whole, and lattices that are not too wide."""
    own, wide = (
        min(fitting_scale(mesh.used_vertices(), view) for mesh in group)
        for group in (meshes, [*meshes, *lattices])
    )
    return own, max(wide, _SMALLEST * own)


def _shown(weights: NDArray[np.float32], count: int) -> str:
    """Return how many templates are shown, and what the others weigh."""
    if count == len(weights):
        return f"all {count} templates" if count > 1 else "the only template"
    rest = float(np.sort(weights)[: len(weights) - count].sum())
    return f"{count} of {len(weights)} templates, the rest: {rest:.2f}"


def _line(size: int) -> int:
    """Return the height of a bar and its number, pixels."""
    return round(1.3 * _number_size(size))


def _number_size(size: int) -> int:
    return max(9, round(0.9 * font_size(size)))


def _most(view: View, size: int) -> int:
    """Return how many templates can be told in a cell: each at least twice as high as its bar."""
    return max(1, view.height // (3 * _line(size))) ** 2


def _weights(example: Example, view: View, count: int, size: int) -> Sheet:
    """Draw the templates of the greatest weights, each over a bar of its weight."""
    across = math.ceil(math.sqrt(count))
    width, height = view.width // across, view.height // math.ceil(count / across)
    panel = Image.new("RGB", (view.width, view.height), "white")
    pen, numbers = ImageDraw.Draw(panel), []
    line, pad = _line(size), max(2, size // 100)
    small = View(view.camera, height - line - 3 * pad, width - 2 * pad)
    for rank in range(count):
        x, y = rank % across * width, rank // across * height
        (picture,) = draw_row([painted(example.template(rank).mesh(), TEMPLATE)], small)
        panel.paste(Image.fromarray(picture), (x + pad, y + 2 * pad))
        weight = float(example.weights[example.ranked(rank)])
        number = round(text_width("0.00", _number_size(size)))
        left, right = x + 2 * pad, x + width - 4 * pad - number
        top = y + height - line - pad
        bar = (top + line // 4, top + 3 * line // 4)
        pen.rectangle((left, bar[0], right, bar[1]), fill=_TRACK)
        pen.rectangle((left, bar[0], left + weight * (right - left), bar[1]), fill=DEFORMED)
        numbers.append(Line(f"{weight:.2f}", right + pad, top + line / 2, _number_size(size)))
    pen.rectangle((1, pad, width - 2, height - 1), outline=DEFORMED, width=max(1, size // 128))
    return Sheet(view.height, view.width, ((np.asarray(panel), 0, 0),), tuple(numbers))


def _arrow(width: int, height: int) -> Picture:
    """Draw an arrow to the right in the middle of a strip."""
    sheet = Image.new("RGB", (_FINE * width, _FINE * height), "white")
    pen, unit, middle = ImageDraw.Draw(sheet), _FINE * width / 10, _FINE * height / 2
    shaft = (unit, middle - 0.7 * unit, 6 * unit, middle + 0.7 * unit)
    pen.rectangle(shaft, fill=_ARROW)
    head = [(5.5 * unit, middle - 2.5 * unit), (9.5 * unit, middle)]
    pen.polygon([*head, (5.5 * unit, middle + 2.5 * unit)], fill=_ARROW)
    return np.asarray(sheet.resize((width, height), Image.Resampling.LANCZOS))
