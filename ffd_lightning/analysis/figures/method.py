"""The paper's figure 1, of any run: image, templates, lattice, deformation, mesh."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

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
    template_label,
)
from ffd_lightning.evaluation.figures import cloud_mesh
from ffd_lightning.geometry.ffd import Degrees, lattice_edges
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.sheet import Picture, Sheet, lay_out

LINE: Color = (110, 116, 132)
POINT: Color = (30, 34, 46)
OFFSET: Color = (230, 120, 0)

_LINE_RADIUS = 0.0035
_OFFSET_RADIUS = 0.004
_POINT_RADIUS = 0.011
_HIDDEN = 0.3  # how much of a line is seen through the mesh in front of it
_SMALLEST = 0.6  # of the other pictures' scale: no further do those of wide lattices shrink


def method(examples: Sequence[Example], size: int = SIZE, count: int = CANDIDATES) -> Sheet:
    """Draw a row per image: it, the templates, one in its lattice, both moved, mesh and truth.

    Source: the paper's figure 1.

    Args:
        examples: of one run, at least one.
        size: width of a cell in pixels.
        count: templates at most, those of the greatest weights.
    """
    shown = range(min(count, len(examples[0].weights)))
    cells: list[Picture] = []
    labels: list[str] = []
    for example in examples:
        view, bank = example.view(size), example.run.data.bank
        index = example.ranked()
        before = bank.control_points[index].double().numpy()
        after = before + example.offsets[index]
        still = painted(example.template().mesh(), TEMPLATE)
        moved = painted(example.deformed().mesh(), DEFORMED)
        truth = painted(example.truth.mesh(), TRUTH)
        offsets = bars(np.stack([before, after], axis=1), _OFFSET_RADIUS, OFFSET)
        first, second = (lattice_mesh(points, bank.degrees) for points in (before, after))
        first = joined([first, offsets])
        scale, wide = _scales([still, moved, truth], [first, second], view)
        templates = [painted(example.template(rank).mesh(), TEMPLATE) for rank in shown]
        cells += [example.image(view), *draw_row(templates, view)]
        cells += [with_lattice(still, first, view, wide), with_lattice(moved, second, view, wide)]
        cells += [draw(mesh, view, scale)[..., :3] for mesh in (moved, truth)]
        number = " x ".join(str(degree + 1) for degree in bank.degrees)
        labels += [example.name, *(template_label(example, rank) for rank in shown)]
        labels += [bank.ids[index], f"{number} control points", example.score, ""]
    headings = ["input image", *(f"template {rank + 1}" for rank in shown)]
    headings += ["template in its lattice", "deformed lattice", "deformed mesh", "ground truth"]
    return lay_out(cells, len(headings), labels, headings=headings, font_size=font_size(size))


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
