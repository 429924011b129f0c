"""The paper's qualitative figures, of any run.

    python -m ffd_lightning.analysis.figures.command FIGURE RUN [RUN ...]

FIGURE is one of

    overview     the paper's figure 3: input, template, deformed cloud, voxels and mesh, truth
    subdivision  its figure 2: what a deformation makes of long edges, and of short ones
    voxels       its figure 4: where the voxels of prediction and truth agree
    labels       its figure 7: part labels that a template brings along
    candidates   the templates of the greatest weights, each of them deformed

It is written to FIGURE.png in the run's folder; of several runs, side by side, to the folder that
holds them all. What it shows is printed, for the caption.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from PIL import Image

from ffd_lightning.analysis.figures import sheets
from ffd_lightning.analysis.figures.drawing import Picture
from ffd_lightning.analysis.figures.examples import Choice, Example, Pick, collect
from ffd_lightning.analysis.runs import find_runs
from ffd_lightning.app.config import ProtocolKind
from ffd_lightning.errors import ConfigError, DataError, UserError
from ffd_lightning.imaging.rendering import contact_sheet
from ffd_lightning.run_folder import RunFolder

FIGURES: dict[str, Callable[[Sequence[Example], int], Picture]] = {
    "overview": sheets.overview,
    "subdivision": sheets.subdivision,
    "voxels": sheets.voxels,
    "labels": sheets.labels,
    "candidates": sheets.candidates,
}

_SMALLEST, _LARGEST = 64, 2048  # pixels
_PAPER = "1,024 points, in units of the hemisphere of radius 3.2 around the truth"
_CAPTIONS = {
    "overview": "Input image, selected template (and its weight), the template deformed: its "
    "cloud, its voxels (32^3) and its subdivided mesh; the true mesh.",
    "subdivision": "Input image; the selected template's mesh, the same deformed; the mesh with "
    "its edges subdivided, the same deformed by the same offsets; the true mesh.",
    "voxels": "Input image; deformed mesh; true mesh; their voxels (32^3, conservative and filled, "
    "as in protocol paper): grey in both, red only in the truth, green only in the prediction.",
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
) -> Picture:
    """Draw one of the paper's figures.

    Args:
        name: a key of `FIGURES`.
        runs: examples of each run, as `collect` gives them; shown side by side.
        size: width of a cell in pixels.
        templates: of each image, in `candidates`.

    Returns:
        RGB image, (H, W, 3) uint8.

    Raises:
        DataError: `labels` of data without part labels.
    """
    draw = FIGURES[name]
    if name == "candidates":
        draw = partial(sheets.candidates, count=templates)
    pictures = [draw(examples, size) for examples in runs]
    if len(pictures) == 1:
        return pictures[0]
    titles = [_title(examples[0]) for examples in runs]
    return contact_sheet(pictures, len(pictures), headings=titles, font_size=round(size / 16))


def caption(name: str, runs: Sequence[Sequence[Example]], choice: Choice) -> str:
    """Return what a figure shows, in words; see `paper_figure`."""
    first = runs[0][0]
    count = len(runs[0])
    which = f"{count} image{'s' if count > 1 else ''}"
    if not choice.models:
        which += f" of {len(first.run.data.split.test)} for testing ({choice.pick.value})"
    scored = f" {first.definition}." if name == "overview" and first.score else ""
    return f"{_CAPTIONS[name]} {which}.{scored}"


def _title(example: Example) -> str:
    config = example.run.config
    return f"{config.category.name}, regime {config.regime.name}, T = {config.templates.count}"


# --- command line --------------------------------------------------------------------------------


def main(arguments: Sequence[str] | None = None) -> None:
    """Write a figure and print what it shows and where it is; exit code 1 for a mistake."""
    options = _parser().parse_args(arguments)
    try:
        runs = [_run(Path(path)) for path in options.runs]
        target = _target(options.out, runs, options.figure)
        choice = Choice(
            models=tuple(i.strip() for i in (options.models or "").split(",") if i.strip()),
            number=options.number,
            pick=Pick(options.pick),
            protocol=None if options.protocol is None else ProtocolKind(options.protocol),
            seed=options.seed,
        )
        if not _SMALLEST <= options.size <= _LARGEST:
            raise ConfigError(f"--size={options.size}: choose {_SMALLEST} to {_LARGEST} pixels")
        if options.top < 1:
            raise ConfigError(f"--top={options.top}: at least one template must be shown")
        root = None if options.data_root is None else Path(options.data_root)
        examples = collect(runs, choice, root)
        _write(paper_figure(options.figure, examples, options.size, options.top), target)
    except UserError as error:
        sys.exit(f"error: {error}")
    print(caption(options.figure, examples, choice))
    print(target)


def _parser() -> argparse.ArgumentParser:
    text = str(__doc__)
    parser = argparse.ArgumentParser(
        prog="python -m ffd_lightning.analysis.figures.command",
        description=text,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("figure", choices=list(FIGURES), metavar="FIGURE")
    parser.add_argument("runs", nargs="+", metavar="RUN", help="a run's folder")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--models", metavar="ID,ID", help="these models, in this order")
    which.add_argument("--number", type=int, default=6, help="images (default: 6)")
    parser.add_argument(
        "--pick",
        choices=[p.value for p in Pick],
        default=Pick.spread.value,
        help="which, by Chamfer distance (default: spread, evenly from the best to the worst); "
        "random needs no scores",
    )
    parser.add_argument("--seed", type=int, default=0, help="of --pick random (default: 0)")
    parser.add_argument(
        "--protocol",
        choices=[p.value for p in ProtocolKind],
        help="whose scores sort the images (default: the one the run's training ended with)",
    )
    parser.add_argument(
        "--size", type=int, default=sheets.SIZE, help="width of a cell, pixels (default: 256)"
    )
    parser.add_argument(
        "--top",
        type=int,
        default=sheets.CANDIDATES,
        help=f"templates of an image in `candidates` (default: {sheets.CANDIDATES})",
    )
    parser.add_argument("--out", metavar="FILE", help="where to write, a .png")
    parser.add_argument("--data-root", metavar="DIR", help="the prepared data, if it has moved")
    return parser


def _run(path: Path) -> RunFolder:
    """Return a run's folder; point to the runs below one that is not.

    Raises:
        ConfigError: it is none.
    """
    run = RunFolder(path)
    if not run.config.is_file():
        below = find_runs(path)
        hint = f", but holds {len(below)}: give {below[0].path}, say" if below else ""
        raise ConfigError(f"{path} is not a run folder{hint or ': it has no config.yaml'}")
    return run


def _target(out: str | None, runs: Sequence[RunFolder], figure: str) -> Path:
    """Return where to write.

    Raises:
        ConfigError: no PNG.
    """
    if out is None:
        folder = os.path.commonpath([run.path.resolve() for run in runs])
        # As the user wrote it where there is one run.
        return (runs[0].path if len(runs) == 1 else Path(folder)) / f"{figure}.png"
    if Path(out).suffix.lower() != ".png":
        raise ConfigError(f"--out={out}: figures are written as .png")
    return Path(out)


def _write(picture: Picture, path: Path) -> None:
    """Write a PNG, whole or not at all.

    Raises:
        DataError: it cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(picture).save(part, "PNG", optimize=True)
        part.replace(path)
    except OSError as error:
        raise DataError(f"cannot write {path}: {error.strerror or error}") from None


if __name__ == "__main__":
    main()
