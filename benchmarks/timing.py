"""Timing rounds in which every candidate takes its turn, so that a busy moment hits them all."""

from __future__ import annotations

import gc
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import torch


@dataclass
class Row:
    """One line of the table.

    Attributes:
        section, name: what was measured, and whose it is.
        seconds: best of all rounds; None where it could not be measured.
        median: of all rounds.
        ratio: `seconds` over those of the section's own row; above 1 is slower than ours.
        note: a count, a unit, or the reason why there is no number.
        extra: further numbers, for the JSON.
    """

    section: str
    name: str
    seconds: float | None = None
    median: float | None = None
    ratio: float | None = None
    note: str = ""
    extra: dict[str, Any] = field(default_factory=dict)


def synchronize() -> None:
    """Wait for the GPU, if there is one."""
    if torch.cuda.is_available():
        torch.cuda.synchronize()


def seconds_of(function: Callable[[], object]) -> float:
    """Return how long one call takes."""
    synchronize()
    start = time.perf_counter()
    function()
    synchronize()
    return time.perf_counter() - start


def compete(
    section: str,
    ours: str,
    candidates: dict[str, Callable[[], object]],
    rounds: int = 7,
    share: dict[str, float] | None = None,
) -> list[Row]:
    """Time candidates in turn, and return a row each with its ratio to `ours`.

    Args:
        section: name of the comparison.
        ours: which candidate the others are compared with.
        candidates: what to call; one that raises gets a row that says so.
        rounds: how often each is called, after one call that is not counted.
        share: candidates that do a part of the work only, for being slow; their time is divided
            by it.
    """
    share = share or {}
    times: dict[str, list[float]] = {}
    rows = []
    for name, function in candidates.items():
        try:
            function()
            times[name] = []
        except Exception as error:  # a peer that does not work here is named, not dropped
            rows.append(Row(section, name, note=f"failed: {_short(error)}"))
    gc.collect()
    for _ in range(rounds):
        for name in times:
            times[name].append(seconds_of(candidates[name]) / share.get(name, 1))
    reference = min(times[ours])
    for name, values in times.items():
        part = f"measured on {share[name]:.0%} of the work" if name in share else ""
        best = min(values)
        row = Row(section, name, best, statistics.median(values), best / reference, part)
        rows.append(row)
    return sorted(rows, key=lambda row: (row.seconds is None, row.seconds))


def absent(section: str, names: dict[str, str]) -> list[Row]:
    """Return rows for peers that are not there: name and reason."""
    return [Row(section, name, note=f"absent: {reason}") for name, reason in names.items()]


def _short(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"[:100]
