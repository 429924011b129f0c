import sys

from rich.table import Table

from ffd_lightning.terminal import table_console, terminal_width


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
