"""Draw the paper's figures of runs.

    ffd figures figure=overview runs/demo/table/e/t16/seed0
    ffd figures figure=voxels runs=[DIR,DIR] number=3 pick=worst out=voxels.png

method       the paper's figure 1: input, template weights, lattice, offsets, deformed mesh, truth
overview     the paper's figure 3: input, template, deformed cloud, voxels and mesh, truth
subdivision  its figure 2: what a deformation makes of long edges, and of short ones
voxels       its figure 4: where the voxels of prediction and truth agree
labels       its figure 7: part labels that a template brings along

The picture is written to FIGURE.png in the run's folder; of several runs, side by side (`method`:
below each other), to the folder that holds them all.
"""

import os
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

from ffd_lightning.components import MISSING, NotNegative, Positive, Range
from ffd_lightning.errors import ConfigError
from ffd_lightning.run_folder import RunFolder

MAIN = "runs"


@dataclass
class Settings:
    """Which figure, of which runs and images.

    Attributes:
        figure: see above.
        runs: a run's folder, or several: [DIR,DIR].
        models: ids of shapes that are shown, in this order: [ID,ID]; by default those of `pick`.
        number: images at most.
        pick: which test images, by their first distance: spread, evenly from the best to the
            worst; random needs no scores.
        seed: of pick=random.
        protocol: whose scores sort the images; by default the one that the run's training ended
            with.
        size: width of a cell in pixels.
        top: templates of an image in figure=method.
        out: where to write, a .png.
        data_root: where the runs' prepared data is, if not where they left it.
    """

    figure: Literal["method", "overview", "subdivision", "voxels", "labels"] = MISSING
    runs: list[str] = MISSING
    models: list[str] = field(default_factory=list)
    number: Positive = 6
    pick: Literal["spread", "best", "median", "worst", "random"] = "spread"
    seed: NotNegative = 0
    protocol: str | None = None
    size: Annotated[int, Range("[64, 2048]")] = 320
    top: Positive = 4
    out: str | None = None
    data_root: str | None = None


def main(settings: Settings) -> int:
    """Draw the figure, and print where it is."""
    from ffd_lightning.analysis.figures.examples import collect
    from ffd_lightning.analysis.figures.sheets import paper_figure
    from ffd_lightning.analysis.plots import save_figure
    from ffd_lightning.app.open_run import open_run

    if not settings.runs:
        raise ConfigError("runs=[]: at least one run must be shown")
    if settings.out and Path(settings.out).suffix.lower() not in ("", ".png"):
        raise ConfigError(f"out={settings.out}: figures are written as .png")
    for name, used in (
        ("top", settings.figure == "method"),
        ("seed", settings.pick == "random" and not settings.models),
        ("pick", not settings.models),
    ):
        if not used and (value := getattr(settings, name)) != getattr(Settings, name):
            raise ConfigError(f"{name}={value} means nothing here: leave it out")
    runs = [RunFolder.at(name) for name in settings.runs]
    # As the user wrote it where there is one run.
    places = [run.path.resolve() for run in runs]
    folder = runs[0].path if len(runs) == 1 else Path(os.path.commonpath(places))
    examples = collect(
        runs,
        partial(open_run, data_root=settings.data_root),
        models=settings.models,
        number=settings.number,
        pick=settings.pick,
        protocol=settings.protocol,
        seed=settings.seed,
    )
    picture = paper_figure(settings.figure, examples, settings.size, settings.top)
    print(*save_figure(picture, Path(settings.out or folder / settings.figure)))
    return 0
