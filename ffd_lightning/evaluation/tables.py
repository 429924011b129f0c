"""One table of an evaluation, for people."""

from __future__ import annotations

from pathlib import Path

from rich.table import Table

from ffd_lightning.evaluation.protocols import EvaluationProtocol, ProtocolDescription
from ffd_lightning.evaluation.references import SHAPES
from ffd_lightning.terminal import table_console

_PART = "part_iou_"


def print_summary(
    folder: Path, protocol: EvaluationProtocol, summary: dict[str, float], subset: str = "test"
) -> None:
    """Print a row for each shape that was scored and a column for each measure."""
    caption = "; ".join(f"{m.title}: {m.definition}" for m in protocol.measures)
    caption += f". {protocol.note}.{ProtocolDescription.of(protocol).factors}"
    scored = f"{summary['num_samples']:.0f} images of {subset} shapes"
    table = Table(
        title=f"{folder}, {scored}",
        caption=f"Means over the {subset} shapes. {caption}",
        caption_justify="left",
    )
    table.add_column("shape")
    for measure in protocol.measures:
        table.add_column(f"{measure.title} {measure.arrow}", justify="right")
    for name, title in SHAPES.items():
        keys = [f"{name}_{m.name}" if name else m.name for m in protocol.measures]
        if keys[0] in summary:
            values = [
                f"{m.factor * summary[k]:.4g}" for m, k in zip(protocol.measures, keys, strict=True)
            ]
            table.add_row(title, *values, style="bold" if not name else None)
    table_console().print(table)
    lines = [f"effective templates {summary['effective_templates']:.1f}"]
    if "folded" in summary:
        lines.append(
            f"deformed meshes: {summary['folded']:.1%} of the surface folded, edges stretched "
            f"{summary['stretch_95']:.2f} times (95th percentile)"
        )
    of_parts = [(name, summary[name]) for name in summary if name.startswith(_PART)]
    if of_parts:
        told = ", ".join(f"{name.removeprefix(_PART)} {100 * x:.1f}" for name, x in of_parts)
        lines.append(f"the model's part IoU x 100, over the test shapes that have the part: {told}")
    lines.append(f"samples.csv and summary.json: {folder}")
    print("\n".join(lines))
