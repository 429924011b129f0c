"""What the viewer's panel says about a session."""

from __future__ import annotations

import html

import numpy as np

from ffd_lightning.data.preparation.part_labels import part_colors
from ffd_lightning.imaging.framing import FramedPhoto
from ffd_lightning.inference.viewer.session import Session


def category_labels(session: Session) -> list[str]:
    """Return a line for each category that the network knows, best first: name, weight."""
    weights = session.reconstruction.category_weights
    return [f"{name} ({weight:.1%})" for name, weight in weights.items()]


def template_labels(session: Session) -> list[str]:
    """Return a line for each template of the category, best first: rank, id, weight."""
    found = session.reconstruction
    return [
        f"{rank + 1}. {found.bank.ids[t]} ({found.weights[t]:.1%})"
        for rank, t in enumerate(found.ranking)
    ]


def weight_bars(session: Session) -> str:
    """Return bars of the templates' weights, best first, as HTML; the one shown in red."""
    found = session.reconstruction
    ranking = found.ranking
    top = float(found.weights[ranking[0]])
    bars = []
    for t in ranking:
        weight, color = float(found.weights[t]), "#d62728" if t == session.template else "#9aa7b8"
        title = html.escape(f"{found.bank.ids[t]}: {weight:.2%}", quote=True)
        bars.append(
            f'<div title="{title}" style="flex:1;min-width:2px;border-radius:2px 2px 0 0;'
            f'height:{max(2.0, 100 * weight / max(top, 1e-12)):.1f}%;background:{color}"></div>'
        )
    return (
        '<div style="display:flex;align-items:flex-end;gap:2px;height:64px;margin:4px 12px 0">'
        f"{''.join(bars)}</div>"
        '<div style="font-size:11px;opacity:0.7;margin:2px 12px 6px;text-align:center">'
        f"weights of {len(bars)} templates, best first; the highest {top:.1%}</div>"
    )


def part_legend(session: Session) -> str:
    """Return the parts of the template that is shown with their colours, as HTML."""
    mesh = session.template_surface()
    labels = np.unique(mesh.face_parts) if mesh.face_parts is not None else np.zeros(0, np.uint8)
    entries = []
    for label, (red, green, blue, _) in zip(labels, part_colors(labels).tolist(), strict=True):
        name = mesh.part_names[label] if label < len(mesh.part_names) else "unknown"
        entries.append(
            f'<span style="color:rgb({red},{green},{blue})">&#9632;</span> {html.escape(name)}'
        )
    return f'<div style="font-size:12px;margin:2px 12px">{" &nbsp; ".join(entries)}</div>'


def score_table(scores: dict[str, float]) -> str:
    """Return Chamfer distances as a table in Markdown, "" for none."""
    if not scores:
        return "Of a photo the truth is not known: no distances."
    rows = "\n".join(f"| {kind} | {1000 * value:.2f} |" for kind, value in scores.items())
    return (
        f"| Chamfer distance | x 1000 |\n|---|---|\n{rows}\n\n"
        "To the ground truth: squared, mean over 1,024 points, both directions added; unit: "
        "bounding-box diagonal 1 (as `val/chamfer`)."
    )


def caption(photo: FramedPhoto) -> str:
    """Return what was done to a photograph, and what to be aware of, as Markdown."""
    lines = ["What the network saw" + (": " + "; ".join(photo.steps) if photo.steps else "")]
    lines += [f"**Beware:** {warning}" for warning in photo.warnings]
    return "\n\n".join(lines)
