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


def test_a_line_says_how_far_how_fast_and_how_long(clock, capsys):
    with CountProgress("training", 20, 0, True, unit="steps") as bar:
        for number in range(20):
            clock[0] += 2 if number else 30
            bar.advance(1, lambda number=number: f"at {number}")
    found = capsys.readouterr().err.splitlines()
    assert found[0] == "  training: 7 of 20 steps, 0.5/s, at 6, about 26 s left"
    assert [line.split()[1] for line in found] == ["7", "13", "19"], "not within ten seconds"


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
