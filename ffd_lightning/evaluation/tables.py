"""One table of an evaluation, for people."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from ffd_lightning.evaluation.candidates import CANDIDATES
from ffd_lightning.evaluation.protocols import Protocol
from ffd_lightning.terminal import table_console

_PART = "part_iou_"


def print_summary(
    folder: Path, protocol: Protocol, summary: dict[str, float], subset: str = "test"
) -> None:
    """Print a row for each candidate that was scored and a column for each metric."""
    caption = "; ".join(f"{m.title}: {m.definition}" for m in protocol.metrics)
    table = Table(
        title=f"{folder}, {summary['num_samples']:.0f} images of {subset} shapes",
        caption=f"Means over the {subset} shapes. {caption}. {protocol.note}.",
        caption_justify="left",
    )
    table.add_column("shape")
    for metric in protocol.metrics:
        table.add_column(f"{metric.scaled_title} {metric.arrow}", justify="right")
    for name, title in CANDIDATES.items():
        scores = {m: summary.get(f"{name}_{m.name}" if name else m.name) for m in protocol.metrics}
        values = [f"{m.factor * x:.4g}" for m, x in scores.items() if x is not None]
        if values:
            table.add_row(title, *values, style=None if name else "bold")
    table_console().print(table)
    print(f"effective templates {summary['effective_templates']:.1f}")
    print(
        f"deformed meshes: {summary['folded']:.1%} of the surface folded, edges stretched "
        f"{summary['stretch_95']:.2f} times (95th percentile)"
    )
    parts = {k.removeprefix(_PART): 100 * x for k, x in summary.items() if k.startswith(_PART)}
    if parts:
        ious = ", ".join(f"{name} {iou:.1f}" for name, iou in parts.items())
        print(f"the model's part IoU x 100, over the test shapes that have the part: {ious}")
    print(f"samples.csv and summary.json: {folder}")
