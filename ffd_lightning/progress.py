"""Progress on stderr: a bar on a terminal, a plain line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from types import TracebackType

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
)

_LINE_EVERY = 10.0  # seconds


class CountProgress:
    """Counts shapes, or images; shows how many are done, the rate and the time left.

    Args:
        label: what the bar is called.
        total: number of shapes.
        done: how many of them are done already.
        show: show anything at all.
    """

    def __init__(self, label: str, total: int, done: int, show: bool) -> None:
        self._label, self._total, self._done, self._show = label, total, done, show
        self._start = self._last_line = time.monotonic()
        self._made = 0
        self._bar: Progress | None = None

    def __enter__(self) -> CountProgress:
        if self._show and sys.stderr.isatty():
            self._bar = Progress(
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[rate]}"),
                TimeRemainingColumn(),
                console=Console(stderr=True),
            )
            self._bar.start()
            self._task = self._bar.add_task(
                self._label, total=self._total, completed=self._done, rate=""
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

    def advance(self) -> None:
        """Count one shape."""
        self._made += 1
        now = time.monotonic()
        rate = self._made / max(now - self._start, 1e-9)
        if self._bar is not None:
            self._bar.update(self._task, advance=1, rate=f"{rate:.1f}/s")
        elif self._show and now - self._last_line > _LINE_EVERY:
            self._last_line = now
            done = self._done + self._made
            print(
                f"  {self._label}: {done} of {self._total}, {rate:.1f}/s, "
                f"about {(self._total - done) / rate:.0f} s left",
                file=sys.stderr,
            )
