"""What a user should know of a set that has just been prepared: in lines, and in a picture."""

from __future__ import annotations

import csv
import io
from collections import Counter
from pathlib import Path

from ffd_lightning.data.preparation.prepared import REJECTED, WARNINGS, PreparedSet
from ffd_lightning.data.preparation.sheet import draw_set
from ffd_lightning.files import write_bytes_atomic

_EXAMPLES = 3  # shapes named with the reason for which they were rejected
_KINDS = 6  # of warnings in one line; a source of one's own may word each its own way


def sheet_of(folder: Path) -> Path:
    """Return where the picture of a prepared set is: not in its folder, which never changes."""
    return folder.parents[1] / "sheets" / f"{folder.name}.png"


def describe(prepared: PreparedSet) -> list[str]:
    """Return what was prepared and rejected, and in a line of its own the warnings by kind."""
    size = sum(facts["bytes"] for facts in prepared.manifest["files"].values())
    line = f"prepared {len(prepared)} shapes in {prepared.path} ({size / 1e6:.0f} MB)"
    if prepared.rejected:
        first = "; ".join(f"{i}: {why}" for i, why in list(prepared.rejected.items())[:_EXAMPLES])
        more = "; ..." if len(prepared.rejected) > _EXAMPLES else ""
        count, file = len(prepared.rejected), prepared.path / REJECTED
        line += f"; rejected {count} ({first}{more}), see {file}"
    lines = [line]
    if counted := count_warnings(prepared):
        lines.append(f"warnings: {counted}; see {prepared.path / WARNINGS}")
    return lines


def warnings_of(prepared: PreparedSet) -> dict[str, list[str]]:
    """Return what is wrong with shapes that are in a set all the same, by their ids."""
    found: dict[str, list[str]] = {}
    with (prepared.path / WARNINGS).open(newline="", encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found.setdefault(row["id"], []).append(row["warning"])
    return found


def count_warnings(prepared: PreparedSet) -> str:
    """Return how many shapes have each of the commonest kinds of warning, in words."""
    counts: Counter[str] = Counter()
    for texts in warnings_of(prepared).values():
        counts.update({text.partition(": ")[0] for text in texts})
    total = f" of {len(prepared)}"
    parts = []
    for kind, count in counts.most_common(_KINDS):
        parts.append(f"{kind} ({count}{total})")
        total = ""
    if len(counts) > _KINDS:
        parts.append(f"{len(counts) - _KINDS} more kinds")
    return "; ".join(parts)


def write_sheet(prepared: PreparedSet, file: Path) -> str:
    """Draw a set into a PNG file, and say where it is, or why it could not be written.

    Args:
        prepared: the set.
        file: of the picture.
    """
    data = io.BytesIO()
    draw_set(prepared).save(data, "png", optimize=True)
    try:
        write_bytes_atomic(file, data.getvalue())
    except OSError as error:  # the set itself is there
        return f"no picture could be written: {error.strerror or error}: {file}"
    return f"what they look like, and how they stand: {file}"
