import io
import sys

import pytest

from ffd_lightning import progress
from ffd_lightning.progress import CountProgress


@pytest.fixture
def clock(monkeypatch):
    """Seconds that a test lets pass."""
    now = [0.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


def lines(clock, capsys, seconds, total, **settings):
    """Count to the end, each taking so many seconds."""
    with CountProgress("training", total, 0, True, **settings) as bar:
        for number in range(total):
            clock[0] += seconds
            bar.advance(1, lambda number=number: f"at {number}")
    return capsys.readouterr().err.splitlines()


def test_a_line_says_how_far_how_fast_and_how_long(clock, capsys):
    found = lines(clock, capsys, 2, 20, unit="steps")
    assert found[0] == "  training: 6 of 20 steps, 0.5/s, at 5, about 28 s left"
    assert [line.split()[1] for line in found] == ["6", "12", "18"], "not within ten seconds"


def test_long_jobs_say_less_and_less_but_something(clock, capsys):
    assert 100 < len(lines(clock, capsys, 1, 100_000)) < 200


def test_on_a_terminal_a_bar_reads_its_note_about_once_a_second(clock, monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    screen, read = Terminal(), []
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    with CountProgress("training", 100, 0, True, "steps") as bar:
        for number in range(100):
            clock[0] += 0.1
            bar.advance(1, lambda number=number: read.append(number) or f"box Chamfer {number}")
    assert 7 <= len(read) <= 10
    assert "training" in screen.getvalue()
    assert f"box Chamfer {read[-1]}" in screen.getvalue()
