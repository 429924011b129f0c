"""The paper's qualitative figures, of any run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os.path import relpath
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.analysis.figures.drawing import voxel_mesh, with_bars, with_rims
from ffd_lightning.analysis.figures.examples import Example, score_text
from ffd_lightning.analysis.naming import run_labels
from ffd_lightning.analysis.results import Results
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.figures import (
    View,
    bars,
    cloud_mesh,
    draw,
    fitting_scale,
    lattice_mesh,
    painted,
    reconstruction_row,
    rgba,
    united,
)
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.grid import Color, Picture, grid, joined, legend
from ffd_lightning.metrics.iou import voxel_iou
from ffd_lightning.palette import part_colors

TEMPLATE: Color = (172, 172, 172)
DEFORMED: Color = (92, 142, 200)
CLOUD: Color = (40, 88, 152)
TRUTH: Color = (216, 172, 104)
FACE: Color = (222, 230, 240)
EDGE: Color = (24, 28, 40)
OFFSET: Color = (230, 120, 0)
AGREEMENT: dict[str, Color] = {
    "in both": (170, 170, 170),
    "only in the truth (false negative)": (230, 120, 0),
    "only in the prediction (false positive)": (0, 114, 178),
}

_EDGE_RADIUS, _OFFSET_RADIUS = 0.0025, 0.004
_RIM, _RIM_SHADE = 0.05, 0.11
_HIDDEN = 0.3  # how much of a line is seen through the mesh in front of it
_SMALLEST = 0.6  # of the other pictures' scale: no further do those of wide lattices shrink
_CLOUD_POINTS = 4096
_PAPER = PaperProtocol()


class Cell(NamedTuple):
    """A picture, or a shape to draw by a camera, the input's by default; its label is below it."""

    heading: str
    content: Mesh | Picture
    label: str = ""
    camera: Camera | None = None


def method(example: Example, view: View, count: int) -> list[Cell]:
    """Draw the templates, the first in its lattice, both moved, the mesh and the truth.

    Source: the paper's figure 1.
    """
    bank, index = example.run.data.bank, example.ranked()
    before = bank.control_points[index].double().numpy()
    after = before + example.offsets[index]
    still = painted(example.template().mesh(), TEMPLATE)
    moved = painted(example.deformed().mesh(), DEFORMED)
    offsets = bars(np.stack([before, after], axis=1), _OFFSET_RADIUS, OFFSET)
    first, second = (lattice_mesh(points, bank.degrees) for points in (before, after))
    first = united([first, offsets])
    own = _scale([still, moved], view)
    scale = max(_scale([still, moved, first, second], view), _SMALLEST * own)
    number = " x ".join(str(degree + 1) for degree in bank.degrees) + " control points"
    return [
        *(_template(example, rank, f"template {rank + 1}") for rank in range(count)),
        Cell("template in its lattice", with_lattice(still, first, view, scale), bank.ids[index]),
        Cell("deformed lattice", with_lattice(moved, second, view, scale), number),
        Cell("deformed mesh", moved, example.score),
        _truth(example),
    ]


def with_lattice(mesh: Mesh, lattice: Mesh, view: View, scale: float) -> Picture:
    """Draw a mesh in its lattice: what of this is behind the mesh is seen faintly through it."""
    whole = draw(united([mesh, lattice]), view, scale)[..., :3].astype(float)
    alone = draw(lattice, view, scale).astype(float)
    # Where the lattice is in front the two are the same, and the mixture is, too.
    share = alone[..., 3:] / 255
    mixed = (1 - _HIDDEN * share) * whole + _HIDDEN * (alone[..., :3] - 255 * (1 - share))
    return np.round(mixed).clip(0, 255).astype(np.uint8)


def _scale(meshes: Sequence[Mesh], view: View) -> float:
    return min(fitting_scale(mesh.used_vertices(), view) for mesh in meshes)


def overview(example: Example, view: View, count: int) -> list[Cell]:
    """Draw the template, that deformed as cloud, voxels and mesh, and the truth.

    Source: the paper's figure 3.
    """
    shape = example.deformed()
    points = shape.labelled_points().points[:_CLOUD_POINTS]
    return [
        _template(example),
        Cell("deformed cloud", cloud_mesh(points, colors=rgba([CLOUD] * len(points)))),
        Cell("deformed voxels", voxel_mesh(_PAPER.voxels(shape).astype(int), [DEFORMED])),
        Cell("deformed mesh", painted(shape.mesh(), DEFORMED), example.score),
        _truth(example),
    ]


def subdivision(example: Example, view: View, count: int) -> list[Cell]:
    """Draw the template's mesh as it is and with short edges, both also deformed, and the truth.

    A mesh bends only at its vertices: long edges stay straight, whatever the deformation.

    Source: the paper's figure 2.
    """
    bank, index = example.run.data.bank, example.ranked()
    coarse, fine = bank.meshes[index], bank.subdivided(index)[0]
    shape = example.deformed()

    def barred(vertices: NDArray[np.float64]) -> Mesh:
        return with_bars(painted((vertices, coarse.faces), FACE), _EDGE_RADIUS, EDGE)

    def rimmed(surface: tuple[NDArray[np.float64], NDArray[np.int64]]) -> Mesh:
        return with_rims(painted(surface, FACE), _RIM, _RIM_SHADE)

    counts = [f"{len(m.vertices):,} vertices\n{len(m.faces):,} faces" for m in (coarse, fine)]
    edges = f"edges ≤ {bank.max_edge:g}\n{counts[1]}"
    return [
        Cell("template", barred(coarse.vertices), f"{bank.ids[index]}\n{counts[0]}"),
        Cell("deformed", barred(shape.carried(coarse.vertices))),
        Cell("subdivided", rimmed((fine.vertices, fine.faces)), edges),
        Cell("subdivided, deformed", rimmed(shape.mesh())),
        _truth(example),
    ]


def voxels(example: Example, view: View, count: int) -> list[Cell]:
    """Draw the reconstruction, the truth, and how their voxels agree, as protocol paper has them.

    Source: the paper's figure 4.
    """
    shape = example.deformed()
    predicted, true = _PAPER.voxels(shape), _PAPER.voxels(example.truth)
    kinds = np.where(predicted, np.where(true, 1, 3), np.where(true, 2, 0))
    iou = next(metric for metric in _PAPER.metrics if metric.name == "iou")
    cubes = voxel_mesh(kinds, list(AGREEMENT.values()))
    behind = replace(view.camera, azimuth=(view.camera.azimuth + 180) % 360)
    return [
        Cell("deformed mesh", painted(shape.mesh(), DEFORMED), _template(example).label),
        _truth(example),
        Cell("voxels", cubes, score_text(iou, voxel_iou(predicted, true))),
        Cell("voxels from behind", cubes, camera=behind),
    ]


def labels(example: Example, view: View, count: int) -> list[Cell]:
    """Draw the template's parts, carried along by its deformation, and the true ones.

    Source: the paper's figure 7.

    Raises:
        DataError: the data has no part labels.
    """
    prepared = example.run.data.prepared
    if not prepared.part_names:
        raise DataError(
            f"{prepared.path} has no part labels to show: the embedded data has them, ShapeNet's "
            "models get them with data.parts_root=DIR"
        )
    shape, truth = example.deformed(), prepared.mesh(example.sample.row)
    fine = example.run.data.bank.subdivided(example.ranked())[0]
    before, after = (
        cloud_mesh(cloud.points[:_CLOUD_POINTS], colors=part_colors(cloud.labels[:_CLOUD_POINTS]))
        for cloud in (example.template().labelled_points(), shape.labelled_points())
    )
    deformed = Mesh(shape.mesh()[0], fine.faces, part_colors(fine.parts()))
    return [
        Cell("template cloud", before, _template(example).label),
        Cell("deformed cloud", after),
        Cell("deformed mesh", deformed),
        Cell("ground truth", Mesh(truth.vertices, truth.faces, part_colors(truth.parts()))),
    ]


def part_legend(examples: Sequence[Example]) -> dict[str, Color]:
    """Return the colours of the parts that the examples' categories have, by name."""
    prepared = examples[0].run.data.prepared
    names = {name for e in examples for name in prepared.part_names_of(e.sample.row)}
    colors = part_colors(np.arange(len(prepared.part_names), dtype=np.uint8))[:, :3].tolist()
    named = zip(prepared.part_names, colors, strict=True)
    return {name: (red, green, blue) for name, (red, green, blue) in named if name in names}


def _template(example: Example, rank: int = 0, heading: str = "template") -> Cell:
    """Return the template of the greatest weight, or the `rank`-th after it, with its weight."""
    index = example.ranked(rank)
    label = f"{example.run.data.bank.ids[index]}\nweight {example.weights[index]:.2f}"
    return Cell(heading, painted(example.template(rank).mesh(), TEMPLATE), label)


def _truth(example: Example) -> Cell:
    return Cell("ground truth", painted(example.truth.mesh(), TRUTH))


FIGURES: dict[str, Callable[[Example, View, int], list[Cell]]] = {
    "method": method,
    "overview": overview,
    "subdivision": subdivision,
    "voxels": voxels,
    "labels": labels,
}
"""What is drawn beside an image; the last argument is how many templates `method` shows."""

LEGENDS: dict[str, Callable[[Sequence[Example]], Mapping[str, Color]]] = {
    "voxels": lambda _: AGREEMENT,
    "labels": part_legend,
}


def paper_figure(
    name: str, runs: Sequence[Sequence[Example]], size: int = 320, templates: int = 4
) -> Image.Image:
    """Draw one of the paper's figures.

    Args:
        name: a key of `FIGURES`.
        runs: examples of each run, side by side; of `method`, which is wide, below each other.
        size: width of a cell in pixels; its height follows from the shape of the input images.
        templates: of each image, in `method`.

    Raises:
        DataError: `labels` of data without part labels.
    """
    pictures = [_of_run(name, examples, size, templates) for examples in runs]
    if len(pictures) == 1:
        return pictures[0]
    font_size = round(size / 16)
    folders = [examples[0].run.folder for examples in runs]
    labels = run_labels(Results.of(folders, folder=Path()).runs)
    titled = [
        grid([picture], 1, headings=[labels[relpath(folder.path)]], font_size=font_size)
        for picture, folder in zip(pictures, folders, strict=True)
    ]
    return joined(titled, across=name != "method")


def _of_run(name: str, examples: Sequence[Example], size: int, templates: int) -> Image.Image:
    count = min(templates, len(examples[0].weights))
    pictures: list[Picture] = []
    labels: list[str] = []
    for example in examples:
        view = example.view(size)
        cells = FIGURES[name](example, view, count)
        shapes = [(cell.content, cell.camera) for cell in cells if isinstance(cell.content, Mesh)]
        meshes, cameras = zip(*shapes, strict=True)
        seen = reconstruction_row(
            example.image, meshes, view, [camera or view.camera for camera in cameras]
        )
        drawn = iter(seen[1:])
        pictures.append(seen[0])
        pictures += [next(drawn) if isinstance(c.content, Mesh) else c.content for c in cells]
        labels += [example.name, *(cell.label for cell in cells)]
    headings = ["input", *(cell.heading for cell in cells)]
    font_size = max(10, round(size / 17))
    sheet = grid(pictures, len(headings), labels, headings, font_size)
    if name not in LEGENDS:
        return sheet
    return joined([sheet, legend(LEGENDS[name](examples), sheet.width, font_size)])
