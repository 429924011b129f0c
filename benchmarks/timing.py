"""Timing rounds in which every candidate takes its turn, so that a busy moment hits them all."""

import gc
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import torch


@dataclass
class Row:
    """One line of the table.

    Attributes:
        section: what was measured.
        name: whose it is.
        seconds: best of all rounds; None where it could not be measured.
        ratio: `seconds` over those of the section's own row; above 1 is slower than ours.
        note: a count, a unit, or the reason why there is no number.
    """

    section: str
    name: str
    seconds: float | None = None
    ratio: float | None = None
    note: str = ""


def seconds_of(function: Callable[[], object]) -> float:
    """Return how long one call takes, with the GPU's work done."""
    _synchronize()
    start = time.perf_counter()
    function()
    _synchronize()
    return time.perf_counter() - start


def _synchronize() -> None:
    if torch.cuda.is_available():
        torch.cuda.synchronize()


def compete(
    section: str, candidates: Mapping[str, tuple[Callable[[], object], float]], rounds: int
) -> list[Row]:
    """Time candidates in turn, and return a row each with its ratio to the first.

    Args:
        section: name of the comparison.
        candidates: what to call, and what part of the work it does; slow ones may do less.
        rounds: how often each is called, after one call that is not counted.
    """
    times: dict[str, list[float]] = {}
    rows = []
    for name, (function, _) in candidates.items():
        try:
            function()
            times[name] = []
        except Exception as error:  # a peer that does not work here is named, not dropped
            reason = " ".join(str(error).split())
            rows.append(Row(section, name, note=f"failed: {type(error).__name__}: {reason}"[:100]))
    gc.collect()
    for _ in range(rounds):
        for name in times:
            function, part = candidates[name]
            times[name].append(seconds_of(function) / part)
    own = min(times[next(iter(candidates))])
    for name, values in times.items():
        part = candidates[name][1]
        note = f"measured on {part:.0%} of the work" if part < 1 else ""
        rows.append(Row(section, name, min(values), min(values) / own, note))
    return rows
