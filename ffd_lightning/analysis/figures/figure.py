"""A figure of the paper, of any run."""

from __future__ import annotations

from collections.abc import Sequence

from PIL import Image

from ffd_lightning.analysis.figures.examples import Example
from ffd_lightning.analysis.figures.sheets import FIGURES, LEGENDS
from ffd_lightning.analysis.results import setting_of
from ffd_lightning.evaluation.figures import reconstruction_row
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.grid import Picture, grid, joined, legend
from ffd_lightning.palette import regime_title


def paper_figure(
    name: str, runs: Sequence[Sequence[Example]], size: int = 320, templates: int = 4
) -> Image.Image:
    """Draw one of the paper's figures.

    Args:
        name: a key of `FIGURES`.
        runs: examples of each run, as `collect` gives them; shown side by side, or for `method`,
            which is wide, below each other.
        size: width of a cell in pixels; its height follows from the shape of the input images.
        templates: of each image, in `method`.

    Raises:
        DataError: `labels` of data without part labels.
    """
    pictures = [_of_run(name, examples, size, templates) for examples in runs]
    if len(pictures) == 1:
        return pictures[0]
    font_size = round(size / 16)
    titled = [
        grid([picture], 1, headings=[_title(examples[0])], font_size=font_size)
        for picture, examples in zip(pictures, runs, strict=True)
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
    headings = ["input", *(cell.heading for cell in cells if cell.heading)]
    font_size = max(10, round(size / 17))
    sheet = grid(pictures, len(headings), labels, headings, font_size)
    if name not in LEGENDS:
        return sheet
    return joined([sheet, legend(LEGENDS[name](examples), sheet.width, font_size)])


def _title(example: Example) -> str:
    settings = example.run.folder.settings
    keys = ("category.name", "regime.name", "templates.count")
    category, regime, templates = (setting_of(settings, key) for key in keys)
    return f"{category}, regime {regime_title(regime)}, T = {templates}"
