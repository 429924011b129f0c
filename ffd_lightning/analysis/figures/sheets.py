"""The paper's qualitative figures: each from examples of one run to a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch
from numpy.typing import NDArray

from ffd_lightning.analysis.figures.drawing import (
    Color,
    draw_row,
    legend,
    painted,
    rgba,
    voxel_mesh,
    with_bars,
    with_rims,
)
from ffd_lightning.analysis.figures.examples import Example, score_text
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.candidates import Candidate
from ffd_lightning.evaluation.figures import cloud_mesh
from ffd_lightning.evaluation.protocols import PaperProtocol, PartProtocol
from ffd_lightning.evaluation.samples import score_sample
from ffd_lightning.geometry.deformation import deform, deformation_matrix
from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh
from ffd_lightning.geometry.voxels import voxelize
from ffd_lightning.imaging.sheet import Picture, Sheet, lay_out, stacked
from ffd_lightning.metrics.iou import voxel_iou
from ffd_lightning.palette import part_colors

SIZE = 320
"""Width of a cell in pixels; its height follows from the shape of the input images."""
CANDIDATES = 4

TEMPLATE: Color = (172, 172, 172)
DEFORMED: Color = (92, 142, 200)
CLOUD: Color = (40, 88, 152)
TRUTH: Color = (216, 172, 104)
FACE: Color = (222, 230, 240)
EDGE: Color = (24, 28, 40)
AGREEMENT: dict[str, Color] = {
    "in both": (170, 170, 170),
    "only in the truth (false negative)": (230, 120, 0),
    "only in the prediction (false positive)": (0, 114, 178),
}
_BAR = 0.0025  # half the thickness of an edge
_CLOUD_POINTS = 4096
_PAPER = PaperProtocol()

Rows = list[tuple[list[Picture], list[str]]]


def overview(examples: Sequence[Example], size: int = SIZE) -> Sheet:
    """Draw a row per image: it, the template, that deformed as cloud, voxels, mesh, and the truth.

    Source: the paper's figure 3.

    Args:
        examples: of one run, at least one.
        size: width of a cell in pixels.
    """
    rows: Rows = []
    for example in examples:
        view, shape = example.view(size), example.deformed()
        meshes = [
            painted(example.template().mesh(), TEMPLATE),
            _cloud(shape),
            voxel_mesh(_voxels(shape).astype(int), [DEFORMED]),
            painted(shape.mesh(), DEFORMED),
            painted(example.truth.mesh(), TRUTH),
        ]
        labels = [example.name, template_label(example), "", "", example.score, ""]
        rows.append(([example.image(view), *draw_row(meshes, view)], labels))
    names = ["template", "deformed cloud", "deformed voxels", "deformed mesh", "ground truth"]
    return _sheet(rows, ["input", *names], size)


def subdivision(examples: Sequence[Example], size: int = SIZE) -> Sheet:
    """Draw a row per image: the template's mesh as it is and with short edges, both also deformed.

    A mesh bends only at its vertices: long edges stay straight, whatever the deformation.

    Source: the paper's figure 2. Arguments and result are those of `overview`.
    """
    rows: Rows = []
    for example in examples:
        view, index, bank = example.view(size), example.ranked(), example.run.data.bank
        coarse, fine = bank.meshes[index], bank.subdivided(index)[0]
        meshes = [
            with_bars(painted((coarse.vertices, coarse.faces), FACE), _BAR, EDGE),
            with_bars(painted((_deformed_vertices(example), coarse.faces), FACE), _BAR, EDGE),
            with_rims(painted((fine.vertices, fine.faces), FACE), EDGE),
            with_rims(painted(example.deformed().mesh(), FACE), EDGE),
            painted(example.truth.mesh(), TRUTH),
        ]
        counts = [f"{len(m.vertices):,} vertices\n{len(m.faces):,} faces" for m in (coarse, fine)]
        before, after = (
            f"{bank.ids[index]}\n{counts[0]}",
            f"edges ≤ {bank.max_edge:g}\n{counts[1]}",
        )
        cells = [example.image(view), *draw_row(meshes, view)]
        rows.append((cells, [example.name, before, "", after, "", ""]))
    names = ["template", "deformed", "subdivided", "subdivided, deformed", "ground truth"]
    return _sheet(rows, ["input", *names], size)


def voxels(examples: Sequence[Example], size: int = SIZE) -> Sheet:
    """Draw a row per image: it, the reconstruction, the truth, and how their voxels agree.

    Voxels and IoU are those of protocol paper.

    Source: the paper's figure 4. Arguments and result are those of `overview`.
    """
    rows: Rows = []
    for example in examples:
        view, shape, truth = example.view(size), example.deformed(), example.truth
        kinds, iou = voxel_agreement(_voxels(shape), _voxels(truth))
        cubes = voxel_mesh(kinds, list(AGREEMENT.values()))
        meshes = [painted(shape.mesh(), DEFORMED), painted(truth.mesh(), TRUTH), cubes, cubes]
        behind = replace(view.camera, azimuth=(view.camera.azimuth + 180) % 360)
        cells = draw_row(meshes, view, [view.camera] * 3 + [behind])
        labels = [
            example.name,
            template_label(example),
            "",
            score_text(_PAPER.metrics[-1], iou),
            "",
        ]
        rows.append(([example.image(view), *cells], labels))
    names = ["deformed mesh", "ground truth", "voxels", "voxels from behind"]
    sheet = _sheet(rows, ["input", *names], size)
    return stacked([sheet, legend(list(AGREEMENT.items()), sheet.width, font_size(size))])


def voxel_agreement(
    predicted: NDArray[np.bool_], true: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], float]:
    """Return the kind of each voxel and the intersection over union.

    Args:
        predicted: (R, R, R).
        true: (R, R, R).

    Returns:
        (R, R, R): 0 in neither, 1 in both, 2 only in the truth, 3 only predicted; and the IoU.
    """
    kinds = np.where(predicted, np.where(true, 1, 3), np.where(true, 2, 0))
    return kinds, voxel_iou(predicted, true)


def candidates(examples: Sequence[Example], size: int = SIZE, count: int = CANDIDATES) -> Sheet:
    """Draw two rows per image: it and the templates of the greatest weights; these deformed.

    Chamfer distance and IoU are those of protocol paper, with seed 0.

    Args:
        examples: of one run, at least one.
        size: width of a cell in pixels.
        count: templates at most.
    """
    rows: Rows = []
    ranks = range(min(count, len(examples[0].weights)))
    for example in examples:
        view = example.view(size)
        shapes: dict[str, Candidate] = {str(rank): example.deformed(rank) for rank in ranks}
        scores = score_sample(_PAPER, example.run.data.prepared, example.sample.row, shapes, 0)
        drawn = draw_row(
            [painted(example.template(rank).mesh(), TEMPLATE) for rank in ranks]
            + [painted(example.truth.mesh(), TRUTH)]
            + [painted(shape.mesh(), DEFORMED) for shape in shapes.values()],
            view,
        )
        above = [example.name, *(template_label(example, rank) for rank in ranks)]
        below = ["ground truth"]
        for rank in ranks:
            shown = (_PAPER.metrics[0], _PAPER.metrics[-1])
            below.append("\n".join(score_text(m, scores[f"{rank}_{m.name}"]) for m in shown))
        rows.append(([example.image(view), *drawn[: len(ranks)]], above))
        rows.append((drawn[len(ranks) :], below))
    return _sheet(rows, ["input", *(f"template {rank + 1}" for rank in ranks)], size)


def labels(examples: Sequence[Example], size: int = SIZE) -> Sheet:
    """Draw a row per image: the template's parts, carried along by its deformation; the true ones.

    Source: the paper's figure 7. Arguments and result are those of `overview`.

    Raises:
        DataError: the data has no part labels.
    """
    bank, prepared = examples[0].run.data.bank, examples[0].run.data.prepared
    if not prepared.part_names:
        raise DataError(
            f"{prepared.path} has no part labels to show: the embedded data has them, ShapeNet's "
            "models get them with data.parts_root=DIR"
        )
    palette = part_colors(np.arange(256, dtype=np.uint8))
    rows: Rows = []
    seen: set[int] = set()
    for example in examples:
        view, template, shape = example.view(size), example.template(), example.deformed()
        fine, truth = bank.subdivided(example.ranked())[0], prepared.mesh(example.sample.row)
        clouds = [s.labelled_points() for s in (template, shape)]
        meshes = [
            *(
                cloud_mesh(c.points[:_CLOUD_POINTS], colors=palette[c.labels[:_CLOUD_POINTS]])
                for c in clouds
            ),
            _by_part(shape.mesh()[0], fine, palette),
            _by_part(truth.vertices, truth, palette),
        ]
        for shown in (clouds[0].labels, fine.face_parts, truth.face_parts):
            seen |= set(np.unique(np.zeros(0, int) if shown is None else shown).tolist())
        cells = [example.image(view), *draw_row(meshes, view)]
        rows.append((cells, [example.name, template_label(example), _part_iou(example), "", ""]))
    names = ["template cloud", "deformed cloud", "deformed mesh", "ground truth"]
    sheet = _sheet(rows, ["input", *names], size)
    words = dict(enumerate(prepared.part_names)) | {UNKNOWN_PART: "unknown"}
    entries = [(words[k], tuple(palette[k, :3].tolist())) for k in sorted(seen)]
    return stacked([sheet, legend(entries, sheet.width, font_size(size))])


def _by_part(vertices: NDArray[np.float64], mesh: Mesh, palette: NDArray[np.uint8]) -> Mesh:
    """Return a mesh on other vertices, (V, 3), in the colours of its faces' parts."""
    unknown = np.full(len(mesh.faces), UNKNOWN_PART, np.uint8)
    parts = unknown if mesh.face_parts is None else mesh.face_parts
    return Mesh(vertices, mesh.faces, palette[parts])


def _part_iou(example: Example) -> str:
    """Return the score of the labels under protocol parts, in words; "" where none are known."""
    protocol, shape = PartProtocol(), example.deformed()
    clouds = example.truth.truth_labelled_points(), shape.labelled_points()
    if any((cloud.labels == UNKNOWN_PART).all() for cloud in clouds):
        return ""
    row, prepared = example.sample.row, example.run.data.prepared
    measure = protocol.metrics[0]
    value = score_sample(protocol, prepared, row, {"": shape}, 0)[measure.name]
    return score_text(measure, value)


def _deformed_vertices(example: Example) -> NDArray[np.float64]:
    """Return the vertices of the selected template's own mesh, not subdivided, deformed: (V, 3)."""
    bank, index = example.run.data.bank, example.ranked()
    matrix = deformation_matrix(torch.from_numpy(bank.meshes[index].vertices), bank.lattices[index])
    offsets = torch.from_numpy(example.offsets[index]).double()
    return np.asarray(deform(matrix, bank.control_points[index].double(), offsets).numpy())


def _cloud(shape: Candidate) -> Mesh:
    points = shape.labelled_points().points[:_CLOUD_POINTS]
    return cloud_mesh(points, colors=rgba([CLOUD] * len(points)))


def _voxels(shape: Candidate) -> NDArray[np.bool_]:
    """Return the voxels that protocol paper compares, (R, R, R)."""
    return voxelize(*shape.mesh(), _PAPER.resolution, half_size=_PAPER.half_size)


def template_label(example: Example, rank: int = 0) -> str:
    """Return a template's id and weight; see `Example.ranked`."""
    index = example.ranked(rank)
    return f"{example.run.data.bank.ids[index]}\nweight {example.weights[index]:.2f}"


def _sheet(rows: Rows, headings: Sequence[str], size: int) -> Sheet:
    """Lay out rows of pictures with their labels."""
    cells, words = ([x for row in part for x in row] for part in zip(*rows, strict=True))
    return lay_out(cells, len(headings), words, headings=headings, font_size=font_size(size))


def font_size(size: int) -> int:
    """Return the height of labels for cells of this width, pixels."""
    return max(10, round(size / 17))
