"""What the viewer's panel says."""

import html
from collections.abc import Mapping

import numpy as np

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.framing import FramedPhoto
from ffd_lightning.palette import part_colors

_STYLE = "font-size:12px;margin:2px 12px"


def part_legend(mesh: Mesh) -> str:
    """Return the parts of a mesh with their colours, as HTML."""
    entries = []
    for label in [] if mesh.face_parts is None else np.unique(mesh.face_parts):
        name = mesh.part_names[label] if label < len(mesh.part_names) else "unknown"
        red, green, blue, _ = part_colors(np.array([label], np.uint8))[0].tolist()
        entries.append(
            f'<span style="color:rgb({red},{green},{blue})">&#9632;</span> {html.escape(name)}'
        )
    return f'<div style="{_STYLE}">{" &nbsp; ".join(entries)}</div>'


def score_table(scores: Mapping[str, float]) -> str:
    """Return box Chamfer distances x 1000 as a table in Markdown."""
    if not scores:
        return "A photo has no ground truth: no distances."
    lines = [f"| {kind} | {1000 * value:.2f} |" for kind, value in scores.items()]
    return "\n".join(["| box Chamfer | x 1000 |", "| --- | ---: |", *lines]) + (
        "\n\nTo the ground truth, as `val/box_chamfer`: squared, mean over 1,024 points, "
        "both directions added, bounding-box diagonal 1."
    )


def input_text(photo: FramedPhoto) -> str:
    """Return how the image came about, and what to be aware of, as HTML."""
    lines = [html.escape("; ".join(photo.steps))]
    lines += [f"<b>Beware:</b> {html.escape(in_page(warning))}" for warning in photo.warnings]
    return f'<div style="{_STYLE}">{"<br>".join(lines)}</div>'


def in_page(message: str) -> str:
    """Return a message that asks for a setting as one that asks for what the page has.

    >>> in_page("no object found: give mask=...")
    'no object found: open a mask'
    """
    return message.replace("give mask=...", "open a mask")
