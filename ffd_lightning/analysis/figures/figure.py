"""The paper's qualitative figures, of any run, and what to say below them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from ffd_lightning.analysis.figures import sheets
from ffd_lightning.analysis.figures.examples import Choice, Example
from ffd_lightning.analysis.figures.method import method
from ffd_lightning.analysis.results import setting_of
from ffd_lightning.imaging.sheet import Sheet, lay_out, stacked
from ffd_lightning.palette import regime_title

_OF_TEMPLATES = {"method": method, "candidates": sheets.candidates}
FIGURES: dict[str, Callable[[Sequence[Example], int], Sheet]] = {
    "method": method,
    "overview": sheets.overview,
    "subdivision": sheets.subdivision,
    "voxels": sheets.voxels,
    "labels": sheets.labels,
    "candidates": sheets.candidates,
}

_PAPER = "1,024 points, in units of the hemisphere of radius 3.2 around the truth"
_CAPTIONS = {
    "method": "Input image; the templates of the greatest weights; the selected one in its lattice "
    "of control points, with orange lines to where each is moved; lattice and mesh deformed "
    "(lattices that reach far are drawn smaller, and cut off); the deformed mesh alone; the true "
    "mesh.",
    "overview": "Input image, selected template (and its weight), the template deformed: its "
    "cloud, its voxels (32^3) and its subdivided mesh; the true mesh.",
    "subdivision": "Input image; the selected template's mesh, the same deformed; the mesh with "
    "its edges subdivided, the same deformed by the same offsets; the true mesh.",
    "voxels": "Input image; deformed mesh; true mesh; their voxels (32^3, conservative and filled, "
    "as in protocol paper): grey in both, orange only in the truth, blue only in the prediction.",
    "labels": "Input image; the selected template's cloud by its parts; cloud and mesh deformed, "
    "with the template's parts; the true mesh by its own. Part IoU: protocol parts.",
    "candidates": "Input image and true mesh; the templates of the greatest weights, above as they "
    f"are, below deformed. Chamfer distance and IoU of protocol paper ({_PAPER}; 32^3 voxels).",
}


def paper_figure(
    name: str,
    runs: Sequence[Sequence[Example]],
    size: int = sheets.SIZE,
    templates: int = sheets.CANDIDATES,
) -> Sheet:
    """Draw one of the paper's figures.

    Args:
        name: a key of `FIGURES`.
        runs: examples of each run, as `collect` gives them; shown side by side, or for `method`
            below each other.
        size: width of a cell in pixels.
        templates: of each image, in `method` and `candidates`.

    Raises:
        DataError: `labels` of data without part labels.
    """
    draw = FIGURES[name]
    if name in _OF_TEMPLATES:
        draw = partial(_OF_TEMPLATES[name], count=templates)
    pictures = [draw(examples, size) for examples in runs]
    if len(pictures) == 1:
        return pictures[0]
    titles, font_size = [_title(examples[0]) for examples in runs], round(size / 16)
    if name == "method":  # it is too wide for others beside it
        titled = zip(pictures, titles, strict=True)
        return stacked(
            [lay_out([p], 1, headings=[title], font_size=font_size) for p, title in titled]
        )
    return lay_out(pictures, len(pictures), headings=titles, font_size=font_size)


def caption(name: str, runs: Sequence[Sequence[Example]], choice: Choice) -> str:
    """Return what a figure shows, in words; see `paper_figure`."""
    first = runs[0][0]
    count = len(runs[0])
    which = f"{count} image{'s' if count > 1 else ''}"
    if not choice.models:
        which += f" of {len(first.run.data.split.test)} for testing ({choice.pick})"
    shows_score = name in ("method", "overview") and first.score
    scored = f" {first.definition}." if shows_score else ""
    return f"{_CAPTIONS[name]} {which}.{scored}"


def _title(example: Example) -> str:
    settings = example.run.folder.settings
    keys = ("category.name", "regime.name", "templates.count")
    category, regime, templates = (setting_of(settings, key) for key in keys)
    return f"{category}, regime {regime_title(regime)}, T = {templates}"
