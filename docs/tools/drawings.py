"""Pictures in docs/ that no command of `ffd` draws: reconstructions side by side, and moving."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.analysis.figures.drawing import View, draw_row
from ffd_lightning.app.open_run import open_run
from ffd_lightning.evaluation.opened import OpenRun
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.sheet import (
    Line,
    Sheet,
    contact_sheet,
    lay_out,
    side_by_side,
    stacked,
)
from ffd_lightning.palette import regime_title
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.training.callbacks import example_rows

Picture = NDArray[np.uint8]
_STEPS = 16  # pictures from the template as it is to the deformed one
_HOLD = 900  # milliseconds at either end
_FONT = 11  # pixels; headings are a fifth larger
_GAP = 24  # pixels between two blocks


@dataclass(frozen=True)
class Shown:
    """A validation shape and what a run makes of it."""

    run: OpenRun
    row: int
    template: int
    offsets: torch.Tensor

    def mesh(self, share: float) -> Mesh:
        """Return the selected template, moved by a share of its offsets."""
        return self.run.data.bank.deformed_mesh(self.template, share * self.offsets)

    def input(self, view: View) -> Picture:
        """Return the image that the network saw."""
        image = Image.fromarray(self.run.data.prepared.image(self.row)[..., :3])
        return np.asarray(image.resize((view.width, view.height), Image.Resampling.LANCZOS))

    def view(self, width: int) -> View:
        """Return the camera of the image."""
        _, height, columns, _ = self.run.data.prepared.image_shape
        return View(self.run.data.prepared.camera(self.row), round(width * height / columns), width)


def shown(folder: Path, count: int) -> list[Shown]:
    """Return validation shapes of a run, evenly spread: nobody has chosen them."""
    run = open_run(RunFolder(folder))
    rows = example_rows(run.data, count)
    images = np.stack([run.data.prepared.image(row)[..., :3] for row in rows])
    with torch.no_grad():
        prediction = run.network.eval()(torch.from_numpy(images).permute(0, 3, 1, 2))
    return [
        Shown(run, row, int(t), prediction.offsets[k, t])
        for k, (row, t) in enumerate(zip(rows, prediction.template_index, strict=True))
    ]


def overview(groups: Sequence[dict[str, Path]], count: int, width: int = 150) -> Picture:
    """Draw the same inputs under several regimes: a row an input, the truth last.

    Args:
        groups: runs of the same data by their regime; the same regimes in each.
        count: inputs of each group.
        width: of a cell in pixels.
    """
    cells, view = [], None
    for runs in groups:
        columns = [shown(folder, count) for folder in runs.values()]
        for k, shape in enumerate(columns[0]):
            view = view or shape.view(width)
            truth = shape.run.data.prepared.mesh(shape.row)
            meshes = [column[k].mesh(1) for column in columns]
            cells += [shape.input(view), *draw_row([*meshes, truth], shape.view(width))]
    heads = ["input", *map(regime_title, groups[0]), "ground truth"]
    return contact_sheet(cells, len(heads), headings=heads, font_size=_FONT)


def by_category(runs: dict[str, Path], count: int = 3, width: int = 120) -> Picture:
    """Draw inputs, selected templates, reconstructions and truths of several categories."""
    rows, view = [], None
    for folder in runs.values():
        for shape in shown(folder, count):
            view = view or shape.view(width)
            truth = shape.run.data.prepared.mesh(shape.row)
            meshes = [shape.mesh(0), shape.mesh(1), truth]
            rows.append([shape.input(view), *draw_row(meshes, shape.view(width))])
    heads = ["input", "template", "deformed", "ground truth"]
    half = -(-len(rows) // 2)
    blocks = [
        lay_out([cell for row in part for cell in row], 4, headings=heads, font_size=_FONT)
        for part in (rows[:half], rows[half:])
    ]
    return side_by_side([blocks[0], Sheet(1, _GAP), blocks[1]]).draw()


def deforming(runs: dict[str, Path], width: int = 150) -> list[Picture]:
    """Draw a shape of each run as its template deforms: inputs above, truths below."""
    shapes = [shown(folder, 1)[0] for folder in runs.values()]
    view = shapes[0].view(width)
    shares = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, _STEPS))
    drawn = []  # a shape's pictures have one scale, so that it does not jump
    for shape in shapes:
        truth = shape.run.data.prepared.mesh(shape.row)
        drawn.append(draw_row([truth, *map(shape.mesh, shares)], shape.view(width)))
    inputs, truths = [shape.input(view) for shape in shapes], [pictures[0] for pictures in drawn]
    frames = []
    for k in range(1, _STEPS + 1):
        rows = {"image": inputs, "mesh": [pictures[k] for pictures in drawn], "truth": truths}
        named = [_named(word, lay_out(row, len(row))) for word, row in rows.items()]
        frames.append(stacked(named).draw())
    return frames


def _named(word: str, row: Sheet) -> Sheet:
    """Return a row with a word to its left."""
    return side_by_side([Sheet(row.height, 60, lines=(Line(word, 6, row.height / 2, 13),)), row])


def write_animation(frames: Sequence[Picture], file: Path) -> None:
    """Write frames forth and back as a GIF, with one palette so that nothing flickers."""
    together = np.concatenate([frames[0], frames[len(frames) // 2], frames[-1]])
    palette = Image.fromarray(together).quantize(64)
    forth = [Image.fromarray(f).quantize(palette=palette, dither=Image.Dither.NONE) for f in frames]
    order = [*forth, *forth[-2:0:-1]]
    pause = [60] * len(order)
    pause[0] = pause[len(forth) - 1] = _HOLD
    order[0].save(file, save_all=True, append_images=order[1:], duration=pause, loop=0)
