"""Makes the pictures in docs/ from runs of the present code, training what is not there yet.

    python docs/tools/pictures.py                     # all, which takes trainings
    python docs/tools/pictures.py overview.jpg figures/method.png

`--runs` and `--data` name folders, by default `runs` and `data`. Screenshots and notebooks need the
extra `pictures`, and a Chromium on the path.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

TOOLS = Path(__file__).parent
DOCS, ROOT = TOOLS.parent, TOOLS.parents[1]

_LARGEST = 2000  # pixels

REGIMES = ("b", "w", "e", "r", "posterior")
SHOWN = ("chair", "plane", "sofa", "bench", "car")
FIGURES = ("method", "overview", "subdivision", "voxels", "labels", "candidates")
NOTEBOOKS = {
    "cumulative_chamfer": "demo",
    "template_selection": "demo",
    "label_transfer": "demo",
    "deformation": "demo",
    "limited_templates": "template_counts-quick",
}
SHORT = ("schedule=quick", "schedule.steps=300", "schedule.annealing_steps=30")
SWEEPS = {
    "demo": ("train", "-m", f"regime={','.join(REGIMES)}", "category=table", "name=demo"),
    "categories": ("sweep", "categories", f"category={','.join(SHOWN)}"),
    "template_counts-quick": ("sweep", "template_counts", "--quick", "category=table"),
    "paper_table": ("sweep", "paper_table", f"regime={','.join(REGIMES)}", *SHORT),
    "real": (
        *("train", "-m", "name=real", "data=folder", "data.root=meshes", "data.yaw=180"),
        *("data.render.azimuths=[45,90,135,180,225,270,315,0]", "split.train_fraction=0.6"),
        *("templates=t8", "category=chair,table", f"regime={','.join(REGIMES)}", "seed=0,1,2"),
        *SHORT,
    ),
}
"""Commands that give the runs; what is finished is not trained again."""


@dataclass(frozen=True)
class Place:
    """Where runs and prepared data are."""

    runs: Path
    data: Path

    def run(self, sweep: str, category: str, regime: str) -> Path:
        """Return the folder of a sweep's run."""
        found = sorted((self.runs / sweep / category / regime).glob("t*/seed0*"))
        if not found:
            sys.exit(f"{self.runs / sweep}: no run of category {category}, regime {regime}")
        return found[0]

    def ffd(self, *arguments: str) -> None:
        """Run a command of the project."""
        print("ffd", *arguments, flush=True)
        subprocess.run([sys.executable, "-m", "ffd_lightning", *arguments], cwd=ROOT, check=True)

    def train(self, sweep: str) -> None:
        """Train the runs of a sweep, as far as they are not finished."""
        self.ffd(*SWEEPS[sweep], f"paths.runs={self.runs}", f"paths.data={self.data}")


@dataclass(frozen=True)
class Picture:
    """A picture of docs/.

    Attributes:
        sweep: whose runs it shows; None for none.
        make: writes it.
    """

    sweep: str | None
    make: Callable[[Place, Path], None]


def _overview(place: Place, file: Path) -> None:
    from drawings import overview

    _save(overview([{r: place.run("demo", "table", r) for r in REGIMES}], 6), file)


def _findings(sweep: str, categories: Sequence[str], count: int, place: Place, file: Path) -> None:
    from drawings import overview

    groups = [{r: place.run(sweep, c, r) for r in REGIMES} for c in categories]
    _save(overview(groups, count, width=120), file)


def _by_category(place: Place, file: Path) -> None:
    from drawings import by_category

    _save(by_category({c: place.run("categories", c, "posterior") for c in SHOWN}), file)


def _deforming(place: Place, file: Path) -> None:
    from drawings import deforming, write_animation

    runs = {c: place.run("categories", c, "posterior") for c in SHOWN}
    write_animation(deforming(runs), file)


def _figure(place: Place, file: Path) -> None:
    regimes = ("posterior",) if file.stem == "method" else ("r", "posterior")
    runs = ",".join(str(place.run("demo", "table", regime)) for regime in regimes)
    place.ffd("figures", f"figure={file.stem}", f"runs=[{runs}]", f"out={file}", "number=4")
    _fewer_colors(file)


def _contact_sheet(place: Place, file: Path) -> None:
    from contact_sheets import draw_sheet

    draw_sheet(file.stem).save(file, quality=80)


def _scaling(place: Place, file: Path) -> None:
    results = ["--only", "scaling", "--out", str(place.runs / "benchmarks")]
    subprocess.run([sys.executable, "-m", "benchmarks", *results], cwd=ROOT, check=True)
    shutil.copy(place.runs / "benchmarks" / "scaling.png", file)


def _notebook(place: Place, file: Path) -> None:
    from notebook_pages import write_page

    notebook = ROOT / "notebooks" / f"{file.stem}.ipynb"
    write_page(notebook, file, place.runs / NOTEBOOKS[file.stem], place.data)
    for drawn in file.with_name(f"{file.stem}_files").glob("*.png"):
        _fewer_colors(drawn)


def _screenshot(what: str, place: Place, file: Path) -> None:
    import screenshots

    getattr(screenshots, what)(place, file)
    _fewer_colors(file)


def _save(picture: NDArray[np.uint8], file: Path) -> None:
    Image.fromarray(picture).save(file, quality=85)


def _fewer_colors(file: Path) -> None:
    """Write a PNG again with 256 colours: a third of the bytes, and no difference to the eye.

    No side is longer than a large screen's.
    """
    picture = Image.open(file).convert("RGB")
    picture.thumbnail((_LARGEST, _LARGEST))
    # k-means finds the colours of small places, too.
    picture.quantize(256, kmeans=3, dither=Image.Dither.NONE).save(file, optimize=True)


def _pictures() -> dict[str, Picture]:
    from ffd_lightning.shapes import categories

    found = {
        "overview.jpg": Picture("demo", _overview),
        "posterior.jpg": Picture("categories", _by_category),
        "deforming.gif": Picture("categories", _deforming),
        "findings/categories.jpg": Picture(
            "paper_table", partial(_findings, "paper_table", categories(), 1)
        ),
        "findings/real.jpg": Picture("real", partial(_findings, "real", ("chair", "table"), 3)),
        "scaling.png": Picture(None, _scaling),
        "report.png": Picture("demo", partial(_screenshot, "report")),
        "viewer.png": Picture("demo", partial(_screenshot, "viewer")),
    }
    for name in ("scalars", "selection", "clouds", "hparams"):
        make = partial(_screenshot, f"tensorboard_{name}")
        found[f"tensorboard-{name}.png"] = Picture("demo", make)
    found |= {f"figures/{name}.png": Picture("demo", _figure) for name in FIGURES}
    found |= {f"notebooks/{name}.md": Picture(s, _notebook) for name, s in NOTEBOOKS.items()}
    return found | {f"categories/{c}.jpg": Picture(None, _contact_sheet) for c in categories()}


PICTURES = _pictures()


def main() -> None:
    """Make what the command line names, or all."""
    parser = argparse.ArgumentParser(description="Make the pictures in docs/.")
    parser.add_argument("names", nargs="*", help=f"by default all of {', '.join(PICTURES)}")
    parser.add_argument("--runs", type=Path, default=ROOT / "runs")
    parser.add_argument("--data", type=Path, default=ROOT / "data")
    given = parser.parse_args()
    if unknown := sorted(set(given.names) - set(PICTURES)):
        sys.exit(f"no picture {unknown[0]}: {', '.join(PICTURES)}")
    names = given.names or list(PICTURES)
    place = Place(given.runs.resolve(), given.data.resolve())
    for sweep in sorted({PICTURES[name].sweep or "" for name in names} - {""}):
        place.train(sweep)
    for name in names:
        print(f"docs/{name}", flush=True)
        PICTURES[name].make(place, DOCS / name)


if __name__ == "__main__":
    main()
