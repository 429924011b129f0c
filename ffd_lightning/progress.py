"""Progress on stderr: a bar on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)

from ffd_lightning.terminal import duration

_LINE_EVERY = 10.0  # seconds, if much was done in them
_MUCH = 0.05  # of the whole
_LINE_AT_LEAST_EVERY = 300.0  # seconds
_NOTE_EVERY = 1.0  # seconds


class CountProgress:
    """Counts shapes, images or steps; shows how many are done, the rate and the time left.

    Args:
        label: what the bar is called.
        total: how many there are.
        done: how many of them are done already.
        show: show anything at all.
        unit: what is counted, where the label does not say it.
    """

    def __init__(self, label: str, total: int, done: int, show: bool, unit: str = "") -> None:
        self._label, self._total, self._done, self._show = label, total, done, show
        self._unit = f" {unit}" if unit else ""
        self._start = self._last_line = self._last_note = time.monotonic()
        self._made = self._told = 0
        self._bar: Progress | None = None

    def __enter__(self) -> CountProgress:
        if self._show and sys.stderr.isatty():
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(24),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rate]}"),
                TextColumn("{task.fields[note]}"),
                TimeRemainingColumn(),
                console=Console(stderr=True),
            )
            self._bar.start()
            self._task = self._bar.add_task(
                self._label, total=self._total, completed=self._done, rate="", note=""
            )
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def advance(self, count: int = 1, note: Callable[[], str] | None = None) -> None:
        """Count what was done.

        Args:
            count: how much.
            note: what else is to be said; called only when it is shown, about once a second at
                most.
        """
        self._made += count
        now = time.monotonic()
        rate = self._made / max(now - self._start, 1e-9)
        if self._bar is not None:
            self._bar.update(self._task, advance=count, rate=f"{rate:.1f}/s")
            if note is not None and now - self._last_note > _NOTE_EVERY:
                self._last_note = now
                self._bar.update(self._task, note=note())
        elif self._show and self._due(now):
            self._last_line, self._told = now, self._made
            done = self._done + self._made
            told = "" if note is None else f"{note()}, "
            print(
                f"  {self._label}: {done} of {self._total}{self._unit}, {rate:.1f}/s, {told}"
                f"about {duration((self._total - done) / rate)} left",
                file=sys.stderr,
            )

    def _due(self, now: float) -> bool:
        """Tell whether enough is new for a line: long jobs would have thousands of them."""
        since = now - self._last_line
        much = self._made - self._told >= _MUCH * self._total
        return since > _LINE_AT_LEAST_EVERY or (since > _LINE_EVERY and much)
