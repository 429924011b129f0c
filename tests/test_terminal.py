import math
import sys

import pytest
from rich.table import Table

from ffd_lightning.terminal import duration, table_console, terminal_width


@pytest.mark.parametrize("seconds", [0.2, 59, 61, 89, 91, 5399, 5401, 172_000, 172_801, 9e6])
def test_times_are_in_the_unit_that_fits(seconds):
    value, unit = duration(seconds).split()
    length = {"s": 1, "min": 60, "h": 3600, "days": 86400}[unit]
    assert math.isclose(float(value) * length, seconds, abs_tol=length)
    assert 1 <= float(value) < 200


def test_no_line_is_cut_but_on_a_terminal(capsys, monkeypatch):
    table = Table("word")
    table.add_row("x" * 500)
    table_console().print(table)
    assert "x" * 500 in capsys.readouterr().out
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "70")
    assert terminal_width() == table_console().width == 70
    monkeypatch.setattr(sys.stdout, "isatty", lambda: False)
    assert terminal_width() is None
