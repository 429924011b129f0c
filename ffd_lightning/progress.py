"""Progress on stderr: a bar on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from ffd_lightning.terminal import duration

_LINE_EVERY = 10.0  # seconds, and more the longer it takes: long jobs would have thousands
_NOTE_EVERY = 1.0  # seconds


class CountProgress:
    """Counts shapes, images or steps; says how many are done, the rate and the time left.

    Args:
        label: what the bar is called.
        total, done: how many there are, and how many of them are done already.
        show: say anything at all.
        unit: what is counted, where the label does not say it.
    """

    def __init__(self, label: str, total: int, done: int, show: bool, unit: str = "") -> None:
        self._label, self._total, self._done, self._show = label, total, done, show
        self._unit = f" {unit}" if unit else ""
        self._start = self._last = time.monotonic()
        self._made = self._first = 0
        self._bar: Progress | None = None

    def __enter__(self) -> CountProgress:
        if self._show and sys.stderr.isatty():
            named = "{task.description}", "{task.fields[note]}"
            texts = [TextColumn(name, markup=False) for name in named]  # names may hold brackets
            columns = texts[0], BarColumn(24), MofNCompleteColumn(), texts[1], TimeRemainingColumn()
            self._bar = Progress(*columns, console=Console(stderr=True))
            self._bar.start()
            self._task = self._bar.add_task(self._label, total=self._total, note="")
            self._bar.update(self._task, completed=self._done)
        return self

    def __exit__(self, *_: Any) -> None:
        if self._bar is not None:
            self._bar.stop()

    def advance(self, count: int = 1, note: Callable[[], str] | None = None) -> None:
        """Count what was done.

        Args:
            count: how much.
            note: what else is to be said; called only when it is, once a second at most.
        """
        self._made += count
        now = time.monotonic()
        if self._made == count:  # with what it takes to start: it tells nothing of the others
            self._start, self._last, self._first = now, now, count
        rate = (self._made - self._first) / max(now - self._start, 1e-9)
        since, done = now - self._last, self._done + self._made
        if self._bar is not None:
            self._bar.update(self._task, completed=done)
            if since > _NOTE_EVERY:
                self._last = now
                text = f"  {note()}" if note else ""
                self._bar.update(self._task, note=f"{rate:.1f}/s{text}")
        elif self._show and since > max(_LINE_EVERY, (now - self._start) / 20):
            self._last = now
            text = f"{note()}, " if note else ""
            print(
                f"  {self._label}: {done} of {self._total}{self._unit}, {rate:.1f}/s, {text}"
                f"about {duration((self._total - done) / rate)} left",
                file=sys.stderr,
            )
