"""Makes the pictures in docs/ from runs of the present code, training what is not there yet.

    python docs/tools/pictures.py                     # all, which takes trainings
    python docs/tools/pictures.py overview.jpg figures/method.png

`--runs` and `--data` name folders, by default `runs` and `data`. Notebooks and screenshots need the
extra `pictures`, screenshots Chromium, too.
"""

import argparse
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from PIL import Image

TOOLS = Path(__file__).parent
DOCS, ROOT = TOOLS.parent, TOOLS.parents[1]

_LARGEST = 2000  # pixels

REGIMES = ("b", "w", "e", "r", "posterior")
SHOWN = ("chair", "plane", "sofa", "bench", "car")
FIGURES = ("method", "overview", "subdivision", "voxels", "labels")
NOTEBOOKS = {"results": "tables.zip", "deformation": "demo"}
"""Notebooks that are pages, too, and of which runs, or kept results."""
WEIGHTS = "encoder.weights=neutral.weights.h5"  # of neutral_encoder.py
SWEEPS = {
    "demo": ("train", "-m", f"regime={','.join(REGIMES)}", "category=table", "name=demo"),
    "categories": ("sweep", "categories", f"category={','.join(SHOWN)}"),
    "paper_table": (
        *("sweep", "paper_table", f"regime={','.join(REGIMES)}", "schedule=quick"),
        *("schedule.steps=300", "schedule.annealing_steps=30", WEIGHTS),
    ),
    "real": (
        *("train", "-m", "name=real", "data=folder", "data.root=meshes", "data.yaw=180"),
        *("data.variants=0", "data.render.azimuths=[45,90,135,180,225,270,315,0]"),
        *("split.train_fraction=0.6", "templates=t8", "category=chair,table"),
        *(f"regime={','.join(REGIMES)}", "seed=0,1,2", "schedule.steps=300", WEIGHTS),
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


Make = Callable[[Place, Path], None]
"""Writes a picture."""


def _groups(place: Place, sweep: str, categories: Sequence[str]) -> list[dict[str, Path]]:
    return [{r: place.run(sweep, category, r) for r in REGIMES} for category in categories]


def _drawing(name: str, runs: Callable[[Place], Any], *options: Any) -> Make:
    """Return what saves a picture of `drawings`."""

    def make(place: Place, file: Path) -> None:
        import drawings

        getattr(drawings, name)(runs(place), *options).save(file, quality=80)

    return make


def _posterior(place: Place) -> dict[str, Path]:
    return {c: place.run("categories", c, "posterior") for c in SHOWN}


def _real(place: Place) -> list[Path]:
    return [place.run("real", category, "posterior") for category in ("chair", "table")]


def _deforming(place: Place, file: Path) -> None:
    from drawings import deforming

    deforming(_posterior(place), file)


def _figure(place: Place, file: Path) -> None:
    regimes = ("posterior",) if file.stem == "method" else ("r", "posterior")
    runs = ",".join(str(place.run("demo", "table", regime)) for regime in regimes)
    place.ffd("figures", f"figure={file.stem}", f"runs=[{runs}]", f"out={file}", "number=4")
    _fewer_colors(file)


def _scaling(place: Place, file: Path) -> None:
    results = ["--only", "scaling", "--out", str(place.runs / "benchmarks")]
    subprocess.run([sys.executable, "-m", "benchmarks", *results], cwd=ROOT, check=True)
    shutil.copy(place.runs / "benchmarks" / "scaling.png", file)


def _notebook(place: Place, file: Path) -> None:
    from notebook_pages import write_page

    source = NOTEBOOKS[file.stem]
    kept = source.endswith(".zip")
    sweep = (DOCS / "findings" / "data" if kept else place.runs) / source
    write_page(ROOT / "notebooks" / f"{file.stem}.ipynb", file, sweep, place.data)
    for drawn in file.with_name(f"{file.stem}_files").glob("*.png"):
        _fewer_colors(drawn)


def _screenshot(place: Place, file: Path) -> None:
    import screenshots

    kind = file.stem.partition("-")[0]
    demo = place.runs / "demo"
    shown = {"report": demo / "report.html", "tensorboard": demo / "table"}
    page = shown.get(kind) or place.run("demo", "table", "posterior")
    getattr(screenshots, kind)(page, file)
    _fewer_colors(file)


def _fewer_colors(file: Path) -> None:
    """Write a PNG again with 256 colours: a third of the bytes, and no difference to the eye.

    No side is longer than a large screen's.
    """
    picture = Image.open(file).convert("RGB")
    picture.thumbnail((_LARGEST, _LARGEST))
    # k-means finds the colours of small places, too.
    picture.quantize(256, kmeans=3, dither=Image.Dither.NONE).save(file, optimize=True)


def _pictures() -> dict[str, tuple[str | None, Make]]:
    """Return the sweep whose runs each picture shows, None for none, and what writes it."""
    from screenshots import BOARDS

    from ffd_lightning.shapes import categories

    demo = partial(_groups, sweep="demo", categories=["table"])
    every = partial(_groups, sweep="paper_table", categories=categories())
    real = partial(_groups, sweep="real", categories=["chair", "table"])
    found: dict[str, tuple[str | None, Make]] = {
        "overview.jpg": ("demo", _drawing("overview", demo, 6)),
        "posterior.jpg": ("categories", _drawing("by_category", _posterior)),
        "deforming.gif": ("categories", _deforming),
        "findings/categories.jpg": ("paper_table", _drawing("overview", every, 1, 120)),
        "findings/real.jpg": ("real", _drawing("overview", real, 3, 120)),
        "own-meshes.jpg": ("real", _drawing("own_templates", _real)),
        "photographs.jpg": (
            None,
            _drawing("photographs", lambda _: ROOT / "examples" / "photos"),
        ),
        "scaling.png": (None, _scaling),
    }
    found |= {f"figures/{name}.png": ("demo", _figure) for name in FIGURES}
    found |= {f"{name}.png": ("demo", _screenshot) for name in ("report", "viewer", *BOARDS)}
    for name, source in NOTEBOOKS.items():
        found[f"notebooks/{name}.md"] = None if source.endswith(".zip") else source, _notebook
    for name in categories():
        made = _drawing("contact_sheet", lambda _, name=name: name)
        found[f"categories/{name}.jpg"] = None, made
    return found


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
    for sweep in sorted({PICTURES[name][0] or "" for name in names} - {""}):
        place.train(sweep)
    for name in names:
        print(f"docs/{name}", flush=True)
        PICTURES[name][1](place, DOCS / name)


if __name__ == "__main__":
    main()
