"""Run the benchmarks: `python -m benchmarks --help`."""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from dataclasses import asdict
from itertools import cycle
from pathlib import Path
from typing import Any

# Before torch is loaded, as train.py does it.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

import torch
from rich.console import Console
from rich.table import Table

from benchmarks import evaluation, nearest, preparation, quality, training_step
from benchmarks.timing import Row
from ffd_lightning.palette import COLORS

SECTIONS = ("nearest", "scaling", "step", "preparation", "evaluation")
ASKED_FOR = ("quality",)
"""Sections that take hours: measured where `--only` names them."""


def main() -> None:
    """Measure, print one table, write JSON and a plot."""
    arguments = _arguments()
    arguments.out.mkdir(parents=True, exist_ok=True)
    devices = [torch.device("cpu")]
    if torch.cuda.is_available():
        devices.append(torch.device("cuda"))
    rows: list[Row] = []
    curves: dict[str, Any] = {}
    console = Console(stderr=True)
    for device in devices:
        if "nearest" in arguments.only:
            console.log(f"nearest neighbours on {device} ...")
            rows += nearest.measure(device, arguments.quick)
        if "scaling" in arguments.only:
            console.log(f"scaling on {device} ...")
            curves[device.type] = nearest.scaling(device, arguments.quick)
    if "step" in arguments.only:
        console.log("training step ...")
        rows += training_step.measure(devices[-1], arguments.quick)
        rows += _memory()
    if "preparation" in arguments.only:
        console.log("preparation and start ...")
        rows += preparation.measure(arguments.meshes, arguments.quick)
    if "evaluation" in arguments.only:
        console.log("evaluation ...")
        rows += evaluation.measure(arguments.quick)
    files: list[Path] = []
    if "quality" in arguments.only:
        more, files = _quality(arguments)
        rows += more
    if devices[-1].type == "cpu":
        rows.append(Row("CUDA", "everything", note="not measured: there is no GPU here"))
    machine = _machine()
    _print(rows, machine)
    result = {"machine": machine, "rows": [asdict(row) for row in rows], "scaling": curves}
    file = arguments.out / "benchmarks.json"
    file.write_text(json.dumps(result, indent=1), encoding="utf-8")
    print(f"\n{file}", end="")
    if curves:
        files.append(_plot(curves, machine, arguments.out / "scaling.png"))
    print("".join(f", {each}" for each in files))


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds: does it all run?")
    parser.add_argument("--only", nargs="+", choices=SECTIONS + ASKED_FOR, default=list(SECTIONS))
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    parser.add_argument(
        "--meshes", type=Path, help="a folder with a folder `all` of OBJ shapes, to prepare those"
    )
    group = parser.add_argument_group(
        "quality",
        "Chamfer, EMD and IoU on the validation shapes against seconds of training, for the "
        "recipes of benchmarks/recipes.yaml: some 20 minutes for each. The same command again "
        "resumes what was interrupted and skips what is finished.",
    )
    lengths = "of training, a run each (60 120 300 600)"
    group.add_argument("--seconds", nargs="+", type=int, metavar="S", help=lengths)
    group.add_argument("--seeds", nargs="+", type=int, default=[0], metavar="N")
    names = list(quality.read_recipes())
    group.add_argument("--recipes", nargs="+", choices=names, default=names, metavar="NAME")
    group.add_argument(
        "--settings",
        nargs="+",
        default=[],
        metavar="KEY=VALUE",
        help="of all runs, as train takes them: category=table data.num_models=2000",
    )
    return parser.parse_args()


def _quality(arguments: argparse.Namespace) -> tuple[list[Row], list[Path]]:
    """Train the recipes that are asked for; see `quality.measure`."""
    known = quality.read_recipes()
    recipes = {name: known[name] for name in arguments.recipes}
    settings, seconds = arguments.settings, arguments.seconds or quality.SECONDS
    if arguments.quick:
        settings, seconds = [*quality.QUICK, *settings], arguments.seconds or (2, 4)
    return quality.measure(recipes, settings, seconds, arguments.seeds, arguments.out)


def _memory() -> list[Row]:
    """Peak memory of a process of its own, since this one holds the peers as well."""
    section, name = "memory", "peak of 6 full steps, CPU"
    if not Path("/proc/self/status").exists():
        return [Row(section, name, note="not measured: this system has no /proc")]
    command = [sys.executable, "-m", "benchmarks.training_step"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    size = int(done.stdout.split()[-1])
    note = f"{size / 2**30:.2f} GiB, mapped pages of the data set counted"
    return [Row(section, name, note=note, extra={"bytes": size})]


def _machine() -> dict[str, Any]:
    return {
        "processor": _processor(),
        "threads": torch.get_num_threads(),
        "vectors": torch.backends.cpu.get_cpu_capability(),
        "python": platform.python_version(),
        "torch": torch.__version__,
        "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _print(rows: list[Row], machine: dict[str, Any]) -> None:
    table = Table(caption=", ".join(f"{k} {v}" for k, v in machine.items() if v))
    table.add_column("measured")
    table.add_column("ratio", justify="right")
    table.add_column("ms", justify="right")
    table.add_column("note")
    section = ""
    for row in rows:
        if row.section != section:
            section = row.section
            table.add_section()
            table.add_row(f"[bold]{section}")
        ratio = "" if row.ratio is None else f"{row.ratio:.2f}"
        milliseconds = "" if row.seconds is None else f"{row.seconds * 1e3:,.1f}"
        table.add_row(f"  {row.name}", ratio, milliseconds, row.note)
    console = Console(width=None if sys.stdout.isatty() else 150)
    console.print(table)
    console.print(
        "ratio: best time over that of the section's own entry (ratio 1.00), all entries of a "
        "section timed in turn in one process. ms: that best time."
    )


def _plot(curves: dict[str, Any], machine: dict[str, Any], file: Path) -> Path:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    axes_names = list(next(iter(curves.values())))
    figure, axes = pyplot.subplots(1, len(axes_names), figsize=(13, 4.2), constrained_layout=True)
    names = sorted({n for c in curves.values() for panel in c.values() for n in panel})
    colors = dict(zip(names, cycle(COLORS)))
    for axis, title in zip(axes, axes_names, strict=True):
        for device, panels in curves.items():
            for name, points in panels[title].items():
                x, y = zip(*points, strict=True)
                style = "--" if device == "cuda" else "-"
                width = 2.2 if name.startswith("ffd_lightning") else 1.2
                label = f"{name} ({device})"
                axis.loglog(
                    x, y, style, marker="o", ms=3, lw=width, color=colors[name], label=label
                )
        axis.set_xlabel(title)
        axis.grid(alpha=0.3)
    axes[0].set_ylabel("seconds, both directions")
    axes[0].legend(fontsize=8)
    gpu = f", {machine['gpu']}" if machine["gpu"] else ""
    figure.suptitle(f"{machine['processor']}, {machine['threads']} threads{gpu}", fontsize=10)
    figure.savefig(file, dpi=110)
    return file


if __name__ == "__main__":
    main()
