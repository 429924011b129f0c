"""What a user should know of a set that has just been prepared: in lines, and in a picture."""

from __future__ import annotations

import csv
import io
from collections import Counter
from pathlib import Path
from typing import get_args

from ffd_lightning.data.preparation.pose import SHAPES, PoseGuess, guess_pose
from ffd_lightning.data.preparation.prepared import REJECTED, WARNINGS, PreparedSet
from ffd_lightning.data.preparation.sheet import draw_set
from ffd_lightning.data.reading.frame import Up
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


def pose_warning(prepared: PreparedSet) -> str:
    """Return how shapes should be turned, in words, "" where nothing is to be said."""
    source = prepared.manifest["settings"]["source"]
    if source.get("source") == "procedural":
        return ""
    step = max(1, len(prepared) // SHAPES)
    clouds = [prepared.cloud(row, 256) for row in range(0, len(prepared), step)]
    # A source of one's own may mean something else by these words.
    turned = source.get("up") in get_args(Up) and isinstance(source.get("yaw"), int | float)
    up: Up = source["up"] if turned else "y"
    yaw, category = float(source["yaw"]) if turned else 0.0, prepared.category(0)
    guess = guess_pose(clouds, category, up, yaw)
    return "" if guess is None else _in_words(guess, category, turned, up, yaw)


def _in_words(guess: PoseGuess, category: str, turned: bool, up: str, yaw: float) -> str:
    why = (
        f"turned so, they come {guess.gain:.1f} times nearer to embedded shapes"
        if guess.known
        else f"turned so, they are {guess.gain:.1f} times nearer to their mirror images"
    )
    settings = " or ".join(_settings(*pose, up, yaw) for pose in guess.poses)
    if turned:
        return f"{category}: shapes seem not to be y up and facing -z: try {settings} ({why})"
    return (
        f"{category}: shapes seem not to be y up and facing -z, as if {settings} were needed "
        f"({why}): are they of another version of the data set than its layout says?"
    )


def _settings(up: str, yaw: float, old_up: str, old_yaw: float) -> str:
    """Return the settings of a pose that differ from the present ones."""
    changed = [f"data.up={up}"] if up != old_up else []
    changed += [f"data.yaw={yaw:g}"] if yaw != old_yaw else []
    return " ".join(changed)


def write_sheet(prepared: PreparedSet, file: Path, guess: str = "") -> str:
    """Draw a set into a PNG file, and say where it is, or why it could not be written.

    Args:
        prepared: the set.
        file: of the picture.
        guess: what seems wrong with the pose, in words.
    """
    data = io.BytesIO()
    draw_set(prepared, guess).save(data, "png", optimize=True)
    try:
        write_bytes_atomic(file, data.getvalue())
    except OSError as error:  # the set itself is there
        return f"no picture could be written: {error.strerror or error}: {file}"
    return f"what they look like, and how they stand: {file}"
