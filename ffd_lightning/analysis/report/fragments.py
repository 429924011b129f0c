"""Fragments of HTML; everything that comes from outside is escaped here."""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape

import numpy as np
import pandas as pd

from ffd_lightning.analysis.gallery import Example
from ffd_lightning.analysis.plots import measure_title
from ffd_lightning.analysis.tables import number
from ffd_lightning.evaluation.protocols import EvaluationProtocol

NOTHING = "-"
"""What stands in a table where there is no value."""


def paragraph(text: str, kind: str = "") -> str:
    """Return text as a paragraph."""
    return f"<p{_class(kind)}>{escape(text)}</p>"


def items(lines: Iterable[str]) -> str:
    """Return lines of text as a list."""
    return "<ul>" + "".join(f"<li>{escape(line)}</li>" for line in lines) + "</ul>"


def statements(lines: Iterable[str]) -> str:
    """Return sentences as a list: what is claimed first, then how sure it is, in brackets."""
    shown = []
    for line in lines:
        claim, bracket, sure = line.rpartition(" (") if line.endswith(")") else (line, "", "")
        who, colon, how_much = claim.partition(": ")
        weight = "strong" if " beats " in who else "span"
        small = f' <small class="note">({escape(sure)}</small>' if bracket else ""
        shown.append(f"<li><{weight}>{escape(who)}</{weight}>{colon}{escape(how_much)}{small}</li>")
    return f'<ul class="statements">{"".join(shown)}</ul>'


def section(key: str, title: str, *parts: str) -> str:
    """Return a section with its heading, to be found under `#key`."""
    content = "\n".join(part for part in parts if part)
    return f'<section id="{key}">\n<h2>{escape(title)}</h2>\n{content}\n</section>'


def details(summary: str, content: str) -> str:
    """Return what is shown when it is asked for."""
    return f"<details><summary>{escape(summary)}</summary>\n{content}\n</details>"


def facts(pairs: Mapping[str, str]) -> str:
    """Return names and values, the values as HTML."""
    rows = "".join(f"<div><dt>{escape(k)}</dt><dd>{v}</dd></div>" for k, v in pairs.items())
    return f'<dl class="facts">{rows}</dl>'


def table(
    label: str,
    headings: Sequence[str],
    rows: Sequence[Sequence[str]],
    below: Sequence[Sequence[str]] = (),
    text: Sequence[str] = (),
) -> str:
    """Return a table that scrolls within itself where it is wider than the page.

    Columns whose cells all begin as numbers do are aligned to the right.

    Args:
        label: what it is, for those who do not see it.
        headings: of the columns; what follows a line break is set as the unit.
        rows: as many cells each, plain text.
        below: more rows, set apart; the first cell of a shorter one spans the columns it lacks.
        text: headings of columns that may wrap.
    """
    numeric = [bool(rows) and all(_is_number(row[k]) for row in rows) for k in range(len(headings))]
    kinds = [
        "number" if right else "text" if heading in text else ""
        for heading, right in zip(headings, numeric, strict=True)
    ]
    head = "".join(
        f'<th scope="col"{_class(kind)}>{_heading(h)}</th>'
        for h, kind in zip(headings, kinds, strict=True)
    )
    bodies = "".join(
        "<tbody>\n" + "\n".join(_row(row, kinds) for row in part) + "\n</tbody>"
        for part in (rows, below)
        if part
    )
    return (
        f'<div class="scroll" role="region" tabindex="0" aria-label="{escape(label)}">\n'
        f"<table>\n<thead><tr>{head}</tr></thead>\n{bodies}\n</table>\n</div>"
    )


def cell(value: object) -> str:
    """Return a value as people read it.

    >>> cell(0.00345), cell(12.0), cell(None), cell([3, 3, 3])
    ('0.00345', '12', '-', '3, 3, 3')
    """
    if isinstance(value, bool | np.bool_):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(cell(part) for part in value)
    if value is None or value is pd.NA or (isinstance(value, float) and np.isnan(value)):
        return NOTHING
    if isinstance(value, float):
        return f"{value:.0f}" if value.is_integer() and abs(value) < 1e9 else number(value)
    return str(value)


def plot(svg: bytes, alt: str, caption: str) -> str:
    """Return a figure; as an image of its own, since names inside of it recur in others."""
    source = f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
    return (
        f'<figure class="plot"><img src="{source}" alt="{escape(alt)}">'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )


def plots(figures: Sequence[str]) -> str:
    """Return figures side by side where there is room."""
    kind = "figures single" if len(figures) == 1 else "figures"
    return f'<div class="{kind}">\n' + "\n".join(figures) + "\n</div>"


def examples(label: str, shown: Sequence[Example], protocol: EvaluationProtocol) -> str:
    """Return a run's examples: what the network saw, the template it took, and both meshes."""
    cards = "\n".join(_card(example, protocol) for example in shown)
    return f'<h3>{escape(label)}</h3>\n<div class="examples">\n{cards}\n</div>'


def _card(example: Example, protocol: EvaluationProtocol) -> str:
    row = example.row
    name, template = escape(str(row["id"])), escape(str(row["template"]))
    scores = "".join(
        f"<div><dt>{escape(title)}</dt><dd>{value}</dd></div>"
        for title, value in _scores(row, protocol)
    )
    return f"""<article class="example">
<h4>{example.rank.capitalize()} <span>{name}</span></h4>
<div class="two">
<div>{_picture(example.image, f"Input image of {name}")}input image</div>
<div>{_picture(example.template_image, f"Template {template}")}template {template}</div>
</div>
<canvas data-left="{example.deformed.name}" data-right="{example.truth.name}"
 data-azimuth="{example.azimuth:g}" data-elevation="{example.elevation:g}" tabindex="0" role="img"
 aria-label="Two meshes in 3D: the template deformed for {name}, and the ground truth"></canvas>
<div class="two"><span>template deformed</span><span>ground truth</span></div>
<dl class="scores">{scores}</dl>
</article>"""


def _scores(row: pd.Series, protocol: EvaluationProtocol) -> list[tuple[str, str]]:
    """Return names and numbers: the first measures, and the first of the template as it is."""
    shown = [(m, "") for m in protocol.measures[:3]]
    shown += [(m, "undeformed_") for m in protocol.measures[:1] if f"undeformed_{m.name}" in row]
    result = [
        (f"{prefix.rstrip('_')} {measure_title(m.name)}", number(m.factor * row[prefix + m.name]))
        for m, prefix in shown
    ]
    return [*result, ("template weight", f"{row['weight']:.2f}")] if "weight" in row else result


def _picture(png: bytes, alt: str) -> str:
    return f'<img src="data:image/png;base64,{base64.b64encode(png).decode()}" alt="{alt}">'


def _row(cells: Sequence[str], kinds: Sequence[str]) -> str:
    lacking = len(kinds) - len(cells)
    span = f' colspan="{lacking + 1}"' if lacking else ""
    first = f"<td{_class('' if lacking else kinds[0])}{span}>{escape(cells[0])}</td>"
    rest = zip(cells[1:], kinds[lacking + 1 :], strict=True)
    return f"<tr>{first}{''.join(f'<td{_class(k)}>{escape(c)}</td>' for c, k in rest)}</tr>"


def _heading(text: str) -> str:
    name, _, unit = text.partition("\n")
    return escape(name) + (f' <span class="unit">{escape(unit)}</span>' if unit else "")


def _class(kind: str) -> str:
    return f' class="{kind}"' if kind else ""


def _is_number(text: str) -> bool:
    return re.fullmatch(r"|-|[<~]?[-+]?[\d.,]+(e-?\d+)?%?( ± \S+)?", text) is not None
