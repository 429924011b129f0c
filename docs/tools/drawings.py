"""Pictures in docs/ that no command of `ffd` draws: reconstructions side by side, and moving."""

import random
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from PIL import Image

from ffd_lightning.analysis.figures.examples import Example, reconstruct
from ffd_lightning.app.open_run import open_run
from ffd_lightning.evaluation.figures import View, reconstruction_row
from ffd_lightning.geometry.mesh import Mesh, normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.grid import grid, joined, write
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.own_templates import of_prepared
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.reconstruction import Reconstruction
from ffd_lightning.palette import regime_title
from ffd_lightning.run_folder import RunFolder
from ffd_lightning.shapes import build
from ffd_lightning.training.callbacks import example_rows

_STEPS = 16  # pictures from the template as it is to the deformed one
_HOLD = 900  # milliseconds at either end
_FONT = 11  # pixels; headings are a fifth larger
_GAP = 24  # pixels between two blocks


def examples(folder: Path, count: int) -> list[Example]:
    """Return validation shapes of a run, evenly spread: nobody has chosen them."""
    run = open_run(RunFolder(folder))
    rows = example_rows(run.data, count)
    return reconstruct(run, [(run.data.prepared.ids[row], 0) for row in rows])


def _moved(example: Example, share: float = 1) -> Mesh:
    """Return the selected template, moved by a share of its offsets."""
    index = example.ranked()
    offsets = torch.from_numpy(example.offsets[index])
    return example.run.data.bank.deformed_mesh(index, share * offsets)


def _truth(example: Example) -> Mesh:
    return example.run.data.prepared.mesh(example.sample.row)


def overview(groups: Sequence[dict[str, Path]], count: int, width: int = 150) -> Image.Image:
    """Draw the same inputs under several regimes: a row an input, the truth last.

    Args:
        groups: runs of the same data by their regime; the same regimes in each.
        count: inputs of each group.
        width: of a cell in pixels.
    """
    cells = []
    for runs in groups:
        for row in zip(*(examples(folder, count) for folder in runs.values()), strict=True):
            meshes = [*map(_moved, row), _truth(row[0])]
            cells += reconstruction_row(row[0].image, meshes, row[0].view(width))
    headings = ["input", *map(regime_title, groups[0]), "ground truth"]
    return grid(cells, len(headings), headings=headings, font_size=_FONT)


def by_category(runs: dict[str, Path], count: int = 3, width: int = 120) -> Image.Image:
    """Draw inputs, selected templates, reconstructions and truths of several categories."""
    rows = [
        reconstruction_row(
            shape.image, [_moved(shape, 0), _moved(shape), _truth(shape)], shape.view(width)
        )
        for folder in runs.values()
        for shape in examples(folder, count)
    ]
    headings = ["input", "template", "deformed", "ground truth"]
    half = -(-len(rows) // 2)
    left, right = (
        grid([cell for row in part for cell in row], 4, headings=headings, font_size=_FONT)
        for part in (rows[:half], rows[half:])
    )
    return joined([left, Image.new("RGB", (_GAP, 1), "white"), right], across=True)


def photographs(folder: Path, height: int = 150, width: int = 200) -> Image.Image:
    """Draw photographs, the templates that the package's model selects, and what become of them."""
    predictor = Predictor.load()
    found = [predictor.predict(file) for file in sorted(folder.glob("*.png"))]
    return _predictions(found, "photograph", View(Camera(), height, width))


def own_templates(runs: Sequence[Path], count: int = 3) -> Image.Image:
    """Draw some of the shapes of each run at random, and what its others become as templates."""
    predictor, found = Predictor.load(), []
    for folder in runs:
        prepared = open_run(RunFolder(folder)).data.prepared
        some = random.Random(0).sample(prepared.ids, count)
        own = of_prepared(predictor.model, prepared, [i for i in prepared.ids if i not in some])
        told = predictor.told(own)
        found += [told.predict(prepared.image(prepared.index(i), 0)) for i in some]
    return _predictions(found, "image", View(Camera(), 120, 160))


def _predictions(found: Sequence[Reconstruction], seen: str, view: View) -> Image.Image:
    cells = []
    for one in found:
        meshes = [one.bank.meshes[one.index], one.colored("photo")]
        own = replace(view, camera=one.camera or view.camera)
        cells += reconstruction_row(one.photo.image, meshes, own)
    headings = 2 * [seen, "template", "deformed"]
    return grid(cells, len(headings), headings=headings, font_size=_FONT)


def deforming(runs: dict[str, Path], file: Path, width: int = 150) -> None:
    """Write a GIF of a shape of each run as its template deforms: inputs above, truths below."""
    shares = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, _STEPS))
    columns = []  # a shape's pictures have one scale, so that it does not jump
    for folder in runs.values():
        (shape,) = examples(folder, 1)
        meshes = [_truth(shape), *(_moved(shape, share) for share in shares)]
        columns.append(reconstruction_row(shape.image, meshes, shape.view(width)))
    inputs, truths, *steps = zip(*columns, strict=True)
    frames = []
    for step in steps:
        rows = []
        for word, cells in (("image", inputs), ("mesh", step), ("truth", truths)):
            row = grid(cells, len(cells))
            head = Image.new("RGB", (60, row.height), "white")
            write(head, word, 6, row.height / 2, 13)
            rows.append(joined([head, row], across=True))
        frames.append(joined(rows))
    _write_animation(frames, file)


def _write_animation(frames: Sequence[Image.Image], file: Path) -> None:
    """Write frames forth and back as a GIF, with one palette so that nothing flickers."""
    palette = joined([frames[0], frames[len(frames) // 2], frames[-1]]).quantize(64)
    forth = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    order = [*forth, *forth[-2:0:-1]]
    pause = [60] * len(order)
    pause[0] = pause[len(forth) - 1] = _HOLD
    order[0].save(file, save_all=True, append_images=order[1:], duration=pause, loop=0)


def contact_sheet(category: str, count: int = 32) -> Image.Image:
    """Draw the first shapes of a category."""
    pictures, labels = [], []
    for index in range(count):
        mesh, family = build(category, index, seed=0)
        mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
        pictures.append(render(mesh, height=120, width=160))
        labels.append(f"{index}  {family}")
    return grid(pictures, 8, labels)
