"""Run the benchmarks: `python -m benchmarks --help`."""

import argparse
import json
import os
import platform
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

from benchmarks import nearest, training_step, whole
from benchmarks.timing import Row
from ffd_lightning.palette import COLORS

SECTIONS = ("nearest", "scaling", "step", "preparation", "evaluation", "start")


def main() -> None:
    """Measure, print one table, write JSON and a plot."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds: does it all run?")
    parser.add_argument("--only", nargs="+", choices=SECTIONS, default=list(SECTIONS))
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    quick, devices = arguments.quick, [torch.device("cpu")]
    if torch.cuda.is_available():
        devices.append(torch.device("cuda"))
    rows: list[Row] = []
    curves: dict[str, Any] = {}
    for section in arguments.only:
        print(f"{section} ...", file=sys.stderr)
        if section == "nearest":
            rows += [row for device in devices for row in nearest.measure(device, quick)]
        elif section == "scaling":
            curves = {device.type: nearest.scaling(device, quick) for device in devices}
        elif section == "step":
            rows += training_step.measure(devices[-1], quick)
        else:
            rows += getattr(whole, section)(quick)
    if devices[-1].type == "cpu":
        rows.append(Row("CUDA", "everything", note="not measured: there is no GPU here"))
    machine = {
        "processor": _processor(),
        "threads": torch.get_num_threads(),
        "python": platform.python_version(),
        "torch": torch.__version__,
        "gpu": torch.cuda.get_device_name() if torch.cuda.is_available() else None,
    }
    _print(rows, machine)
    result = {"machine": machine, "rows": [asdict(row) for row in rows], "scaling": curves}
    file = arguments.out / "benchmarks.json"
    file.write_text(json.dumps(result, indent=1), encoding="utf-8")
    print(f"\n{file}")
    if curves:
        print(_plot(curves, machine, arguments.out / "scaling.png"))


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
    for name in ("ratio", "ms"):
        table.add_column(name, justify="right")
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
        "ratio: best time over that of the section's first entry, all entries of a section timed "
        "in turn in one process. ms: that best time."
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
