import io

import pandas as pd
import pytest
from rich.console import Console

from ffd_lightning.analysis.table_layout import Column, RunHeads, fitted, titled

NUMBERS = [f"{x:.1f}" for x in (1234.5, 7.25, 0.0)]
COLUMNS = [Column(f"a long heading {k}", NUMBERS) for k in range(9)]
HEADS = [Column("regime", ["b, base", "posterior", "w, log-weighted"])]


def printed(tables, width):
    file = io.StringIO()
    console = Console(file=file, width=width or 10_000)
    for table in tables:
        console.print(table)
    return file.getvalue()


@pytest.mark.parametrize("width", [40, 80, 120, None])
def test_no_number_is_cut_and_no_line_is_too_long(width):
    tables = fitted(HEADS, COLUMNS, width)
    text = printed(tables, width)
    assert width is None or max(map(len, text.splitlines())) <= width
    for number in NUMBERS:
        assert text.split().count(number) == len(COLUMNS)
    assert text.count("w, log-weighted") == len(tables), "each table says which runs it is of"
    assert (len(tables) == 1) == (width is None)


def test_captions_are_wrapped_to_lines_that_are_read_easily():
    caption = "word " * 100
    for width in (60, None):
        text = printed([titled("Title", fitted(HEADS, COLUMNS[:1]), caption, width)], width)
        assert text.startswith("Title")
        assert text.split().count("word") == 100
        assert max(map(len, text.splitlines())) <= (width or 100)


def runs(**columns):
    count = max(len(values) for values in columns.values())
    same = {"category": ["table"], "regime": ["b"], "templates": [16], "seed": [0]}
    filled = {k: v * count if len(v) == 1 else v for k, v in (same | columns).items()}
    return pd.DataFrame(filled | {"run": [f"runs/x/{k}/seed0" for k in range(count)]})


def test_what_runs_have_in_common_is_no_column():
    heads = RunHeads.of(runs(regime=["b", "w"]))
    assert heads.columns == [Column("regime", ["b, base", "w, log-weighted"])]
    assert heads.common == "table, T = 16, seed 0"
    heads = RunHeads.of(runs(templates=[4, 8], seed=[0, 1]))
    assert [column.title for column in heads.columns] == ["T", "seed"]
    assert heads.common == "table, b, base"


def test_one_run_is_told_by_its_regime():
    heads = RunHeads.of(runs(seed=[3]))
    assert heads == RunHeads([Column("regime", ["b, base"])], "table, T = 16, seed 3")


def test_runs_that_differ_in_something_else_are_told_by_their_folders():
    heads = RunHeads.of(runs(seed=[0, 0]))
    assert heads.columns[-1] == Column("run", ["0/seed0", "1/seed0"])
