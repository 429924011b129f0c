"""Quality against seconds of training, for the recipes of `recipes.yaml`.

A point of a curve is a whole run of its own length: where the learning rate fades, what a long run
is at half of its time is not what a run of half its length becomes.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator, StrMethodFormatter

from benchmarks.timing import Row
from ffd_lightning.app.commands.train import train_command
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.palette import COLORS
from ffd_lightning.run_folder import RunFolder

SECONDS = (60, 120, 300, 600)
RECIPES = Path(__file__).with_name("recipes.yaml")
QUICK = ("data.num_models=60", "templates=t4", "protocol.points=64")
_ALWAYS = (
    "trainer.progress_bar=false",
    "evaluation.subset=val",  # recipes are chosen by it
    "evaluation.references=false",
    "callbacks.report=false",
)
_TIMED_STEPS = 20
_KEPT = ("effective_templates", "folded", "stretch_95", "bending", "num_samples")
_MEASURES = PaperProtocol().measures


@dataclass(frozen=True)
class Trial:
    """One run: a recipe, trained for some seconds.

    Attributes:
        recipe: its name.
        overrides: its settings, and those of all recipes.
        asked: seconds of training that its steps should take.
        seed: of the run.
        folder: of the run; other overrides, another folder.
    """

    recipe: str
    overrides: tuple[str, ...]
    asked: int
    seed: int
    folder: RunFolder


def read_recipes(file: Path = RECIPES) -> dict[str, list[str]]:
    """Return the settings of each recipe, by its name."""
    return dict(yaml.safe_load(file.read_text(encoding="utf-8")))


def trials(
    recipes: Mapping[str, Sequence[str]],
    settings: Sequence[str],
    seconds: Sequence[int],
    seeds: Sequence[int],
    out: Path,
) -> list[Trial]:
    """Return all runs, the short ones first, so that all recipes have a point early.

    Args:
        recipes: as `read_recipes` gives them.
        settings: of all recipes, as `train` takes them.
        seconds: lengths of the runs.
        seeds: of the runs.
        out: where their folders are.
    """
    found = []
    for asked in sorted(seconds):
        for seed in seeds:
            for recipe, own in recipes.items():
                overrides = (*own, *settings)
                digest = hashlib.sha256("\n".join(overrides).encode()).hexdigest()[:6]
                name = f"{re.sub('[^a-z0-9.]+', '_', recipe.lower())}_{digest}"
                folder = RunFolder(out / name / f"{asked}s" / f"seed{seed}")
                found.append(Trial(recipe, overrides, asked, seed, folder))
    return found


def measure(
    recipes: Mapping[str, Sequence[str]],
    settings: Sequence[str],
    seconds: Sequence[int],
    seeds: Sequence[int],
    out: Path,
) -> tuple[list[Row], list[Path]]:
    """Train what is not trained yet, and write `quality.csv` and `quality.png`.

    Args:
        recipes: as `read_recipes` gives them.
        settings: of all recipes, as `train` takes them.
        seconds: lengths of the runs.
        seeds: of the runs.
        out: the folder to write to; runs go to its folder `quality`.

    Returns:
        A row for each run, and the files.
    """
    rows, points = [], []
    times: dict[tuple[str, ...], float] = {}
    for trial in trials(recipes, settings, seconds, seeds, out / "quality"):
        if not trial.folder.finished and not _train(trial, times):
            note = f"failed: {trial.folder.status.get('reason', 'see above')}"
            rows.append(Row("quality", f"{trial.recipe}, {trial.asked} s", note=note))
            continue
        points.append(_point(trial))
        rows.append(_row(points[-1]))
    if not points:
        return rows, []
    table = pd.DataFrame(points)
    files = [out / "quality.csv", out / "quality.png"]
    table.to_csv(files[0], index=False)
    draw(table).savefig(files[1], dpi=110)
    return rows, files


def _train(trial: Trial, times: dict[tuple[str, ...], float]) -> bool:
    """Train a run, or the rest of it; return whether it came to its end.

    Args:
        trial: the run.
        times: seconds a step takes, by overrides; what is measured is added.
    """
    if trial.folder.config.is_file():  # begun: with as many steps
        steps = int(trial.folder.settings["schedule"]["steps"])
    else:
        if trial.overrides not in times:
            seconds = _seconds_per_step(trial)
            if seconds is None:
                return False
            times[trial.overrides] = seconds
        steps = max(2, round(trial.asked / times[trial.overrides]))
    return _run(trial, trial.folder, steps)


def _seconds_per_step(trial: Trial) -> float | None:
    """Return what a step takes in a run of a few steps, None where that run fails."""
    folder = RunFolder(trial.folder.path.parents[1] / "timing")
    if not _run(trial, folder, _TIMED_STEPS):
        return None
    return float(folder.status["summary"]["seconds_per_step"])


def _run(trial: Trial, folder: RunFolder, steps: int) -> bool:
    command = [
        *train_command(),
        *_ALWAYS,
        f"schedule.annealing_steps={max(1, steps // 2)}",  # half of the run, as in schedule=quick
        *trial.overrides,
        f"schedule.steps={steps}",
        f"seed={trial.seed}",
        f"hydra.run.dir='{folder.path}'",
    ]
    return subprocess.run(command, check=False).returncode == 0


def _point(trial: Trial) -> dict[str, Any]:
    """Return a finished run's scores, and the seconds that its training took."""
    status = trial.folder.status
    summary, steps = status["summary"], int(status["steps"])
    return {
        "recipe": trial.recipe,
        "category": trial.folder.settings["category"]["name"],
        "seed": trial.seed,
        "asked_seconds": trial.asked,
        "steps": steps,
        "seconds_per_step": summary["seconds_per_step"],
        "seconds": steps * summary["seconds_per_step"],
        **{m.name: summary[m.name] for m in _MEASURES},
        **{name: summary[name] for name in _KEPT},
    }


def _row(point: Mapping[str, Any]) -> Row:
    scores = ", ".join(f"{m.title} {m.factor * point[m.name]:.1f}" for m in _MEASURES)
    name = f"{point['recipe']}, seed {point['seed']}: {point['seconds']:.0f} s"
    return Row("quality", name, note=f"{scores} after {point['steps']:,} steps", extra=dict(point))


def draw(table: pd.DataFrame) -> Figure:
    """Draw each measure against seconds: a line through the means over seeds, a dot for each.

    Args:
        table: as `measure` writes it.
    """
    figure = Figure(figsize=(13, 5), layout="constrained")
    axes = figure.subplots(1, len(_MEASURES))
    for axis, shown in zip(axes, _MEASURES, strict=True):
        recipes = table.groupby("recipe", sort=False)
        for (recipe, runs), color in zip(recipes, cycle(COLORS), strict=False):
            values = shown.factor * runs[shown.name]
            axis.plot(runs["seconds"], values, "o", ms=4, color=color, alpha=0.6)
            means = runs.assign(value=values).groupby("asked_seconds")[["seconds", "value"]].mean()
            axis.plot(means["seconds"], means["value"], color=color, label=str(recipe))
        axis.set_xscale("log")
        axis.xaxis.set_major_locator(FixedLocator(sorted(table["asked_seconds"].unique())))
        axis.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.xaxis.set_minor_locator(NullLocator())
        axis.set_title(f"{shown.title} x {shown.factor:g} {shown.arrow}", fontsize=10)
        axis.set_xlabel("seconds of training")
        axis.grid(alpha=0.3)
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2, fontsize=9, frameon=False)
    first, seeds = table.iloc[0], table["seed"].nunique()
    figure.suptitle(
        f"{first['category']}: {first['num_samples']:.0f} validation shapes, protocol paper, "
        f"{seeds} seed{'s' * (seeds > 1)}; each dot is a run of its own",
        fontsize=10,
    )
    return figure
