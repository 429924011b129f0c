"""What the viewer's panel says about sessions."""

from __future__ import annotations

import html
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ffd_lightning.imaging.framing import FramedPhoto
from ffd_lightning.inference.viewer.session import NetworkTitle, Session
from ffd_lightning.inference.viewer.thumbnails import data_uri
from ffd_lightning.palette import part_colors

# A picture is as good as the button of its rank: the nearest one, whose way is up and down again.
_CLICK = (
    "let e=this,b;while(!b&&(e=e.parentElement))"
    "b=[...e.querySelectorAll('button')].find(x=>x.textContent===this.dataset.rank);b?.click()"
)


def heading(titles: Sequence[NetworkTitle], text: str, note: str) -> str:
    """Return what is looked at, and what visitors should know, as HTML."""
    lines = [f"<b>{html.escape(text)}</b>"]
    for title in titles:
        lines.append(
            f'<span style="color:{title.color}">&#9632;</span> <b>{html.escape(title.text)}</b>: '
            f"{html.escape(title.note)}"
        )
    if note:
        lines.append(html.escape(note))
    return f'<div style="font-size:14px;margin:6px 12px">{"<br>".join(lines)}</div>'


def category_labels(session: Session) -> list[str]:
    """Return a line for each category that the network knows, best first: name, weight."""
    weights = session.reconstruction.category_weights
    return [f"{name} ({weight:.1%})" for name, weight in weights.items()]


def template_pictures(session: Session, thumbnail: Callable[[int], str], rows: int) -> str:
    """Return the category's templates by weight as HTML: picture, rank, weight and a bar of it.

    The one that is shown has a frame in its network's colour. A click on a picture clicks the
    button that is named by its rank.

    Args:
        session: whose templates.
        thumbnail: returns the address of a template's picture.
        rows: that are seen without scrolling.
    """
    found, color = session.reconstruction, session.title.color
    top = max(float(found.weights[found.ranking[0]]), 1e-12)
    cells = []
    for rank, t in enumerate(found.ranking, start=1):
        weight, shown = float(found.weights[t]), t == session.template
        name = html.escape(f"{found.bank.ids[t]}: {weight:.2%}", quote=True)
        cells.append(
            f'<div title="{name}" data-rank="{rank}" onclick="{_CLICK}" style="cursor:pointer;'
            f'border-radius:4px;border:2px solid {color if shown else "transparent"}">'
            f'<img src="{thumbnail(int(t))}" alt="{name}" style="display:block;width:100%">'
            f'<div style="height:4px;width:{max(3.0, 100 * weight / top):.1f}%;'
            f'background:{color}"></div>'
            f'<div style="font-size:11px;line-height:1.3;text-align:center">{rank} &middot; '
            f"{_percent(weight)}</div></div>"
        )
    return (
        '<div style="display:grid;grid-template-columns:repeat(auto-fill,minmax(48px,1fr));'
        "gap:2px;margin:4px 10px;"
        f'max-height:{63 * rows}px;overflow-y:auto">{"".join(cells)}</div>'
    )


def _percent(weight: float) -> str:
    return "<0.1%" if weight < 0.0005 else f"{weight:.{0 if weight >= 0.0995 else 1}%}"


def shown_template(session: Session) -> str:
    """Return which template is shown, as Markdown: its rank, id and weight."""
    found, t = session.reconstruction, session.template
    rank = found.ranking.tolist().index(t) + 1
    return f"Shown: {rank} of {len(found.ranking)}, `{found.bank.ids[t]}`, {found.weights[t]:.1%}"


def part_legend(sessions: Sequence[Session]) -> str:
    """Return the parts of the templates that are shown with their colours, as HTML."""
    names: dict[int, str] = {}
    for session in sessions:
        mesh = session.template_surface()
        labels = np.unique(mesh.face_parts) if mesh.face_parts is not None else ()
        for label in map(int, labels):
            known = label < len(mesh.part_names)
            names[label] = mesh.part_names[label] if known else "unknown"
    entries = []
    for label, name in sorted(names.items()):
        red, green, blue, _ = part_colors(np.array([label], np.uint8))[0].tolist()
        entries.append(
            f'<span style="color:rgb({red},{green},{blue})">&#9632;</span> {html.escape(name)}'
        )
    return f'<div style="font-size:12px;margin:2px 12px">{" &nbsp; ".join(entries)}</div>'


def score_table(titles: Sequence[NetworkTitle], scores: Sequence[Mapping[str, float]]) -> str:
    """Return box Chamfer distances x 1000 as a table in Markdown, a column for each network."""
    if not scores[0]:
        return "A photo has no ground truth: no distances."
    several = len(titles) > 1
    heads = [title.text for title in titles] if several else ["x 1000"]
    lines = [["box Chamfer x 1000" if several else "box Chamfer", *heads]]
    lines.append(["---"] + ["---:"] * len(heads))
    for kind in scores[0]:
        lines.append([kind, *(f"{1000 * own[kind]:.2f}" for own in scores)])
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    return (
        f"{table}\n\nTo the ground truth, as `val/box_chamfer`: squared, mean over 1,024 points, "
        "both directions added, bounding-box diagonal 1."
    )


def scene_label(title: NetworkTitle, scores: Mapping[str, float]) -> str:
    """Return what stands before the reconstruction of one of two networks."""
    if not scores:
        return title.text
    return f"{title.text} (box Chamfer x 1000: {1000 * scores['shown']:.2f})"


def input_block(photo: FramedPhoto) -> str:
    """Return what the network saw, how it came about, and what to be aware of, as HTML."""
    lines = [html.escape("; ".join(photo.steps))]
    lines += [f"<b>Beware:</b> {html.escape(in_page(warning))}" for warning in photo.warnings]
    return (
        '<div style="display:flex;gap:10px;margin:2px 12px 8px;align-items:flex-start">'
        f'<img src="{data_uri(photo.image[..., :3])}" alt="what the network saw" '
        'style="flex:0 0 45%;min-width:0;border:1px solid #ced4da;border-radius:4px">'
        '<div style="font-size:12px;line-height:1.35;overflow-wrap:anywhere">'
        f"<b>What the network saw</b><br>{'<br>'.join(lines)}</div></div>"
    )


def in_page(message: str) -> str:
    """Return a message that asks for a setting as one that asks for what the page has.

    >>> in_page("no object found: give mask=...")
    'no object found: open a mask'
    """
    return message.replace("give mask=...", "open a mask")
