import csv
import io

import pandas as pd
import pytest
from rich.console import Console

from ffd_lightning.analysis.table import Cell, Table
from ffd_lightning.analysis.tables import scores
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription

NUMBERS = ["1234.5", "7.25", "0.0 ± 1"]
TABLE = Table(
    "Of what",
    ["regime", *(f"a long heading {k}\nx 1000" for k in range(9))],
    [["b", *[NUMBERS[0]] * 9], ["posterior", *[NUMBERS[1]] * 9], ["w, log", *[NUMBERS[2]] * 9]],
    note="word " * 100,
)


def printed(table, width):
    file = io.StringIO()
    Console(file=file, width=width or 10_000).print(table.rich(width))
    return file.getvalue()


@pytest.mark.parametrize("width", [40, 80, 120, None])
def test_no_number_is_cut_and_no_line_is_too_long(width):
    text = printed(TABLE, width)
    assert max(len(line) for line in text.splitlines() if "word" in line) <= (width or 100)
    assert width is None or max(map(len, text.splitlines())) <= width
    for number in NUMBERS:
        assert text.count(number) == 9
    assert (text.count("w, log") == 1) == (width is None), "each part says which rows it is of"


def test_all_forms_hold_the_same_cells():
    cells = [["a|b<", Cell("1.5", "[1, 2]", "▲"), "-"], ["c", "20", "0.5"]]
    table = Table("t", ["name", "x\nunit", "y_%"], cells, note="n & m", below=1)
    head, *rows = csv.reader(io.StringIO(table.csv()))
    assert head == ["name", "x unit", "y_%"]
    assert rows == [list(map(str, row)) for row in cells]
    assert table.markdown().splitlines()[2] == "| a/b< | 1.5 ▲ [1, 2] | - |"
    html = table.html()
    assert "a|b&lt;" in html
    assert '<td class="number">1.5 <b class="mark">▲</b><small>[1, 2]</small></td>' in html
    assert html.count("<tbody>") == 2
    assert "n &amp; m" in html
    assert r"y\_\% \\" in table.latex()
    assert r"a|b< & 1.5 & - \\" in table.latex()


def runs(**columns):
    count = max(len(values) for values in columns.values())
    same = {"category": ["table"], "regime": ["b"], "templates": [16], "seed": [0]}
    filled = {k: v * count if len(v) == 1 else v for k, v in (same | columns).items()}
    return pd.DataFrame(filled | {"num_samples": 9, "chamfer": [float(k) for k in range(count)]})


PROTOCOL = ProtocolDescription("mine", "", (Metric("chamfer", "squared"),))
KEYS = ["category", "regime", "templates", "seed"]


def test_what_runs_have_in_common_is_in_the_title():
    table = scores(runs(regime=["b", "w"]), PROTOCOL, KEYS)
    assert table.title.endswith(": table, T = 16, seed 0, 9 test shapes")
    assert [row[0] for row in table.rows] == ["b, base", "w, log-weighted"]
    table = scores(runs(templates=[4, 8], seed=[0, 1]), PROTOCOL, KEYS)
    assert table.columns[:2] == ["T", "seed"]
    table = scores(runs(seed=[3]), PROTOCOL, KEYS)
    assert (table.columns[0], table.rows[0][0]) == ("regime", "b, base")


def test_seeds_become_a_mean_and_the_best_is_marked():
    table = scores(runs(regime=["b", "b", "w", "w"], seed=[0, 1, 0, 1]), PROTOCOL, KEYS[:3])
    assert table.columns[:3] == ["regime", "seeds", "Chamfer ↓\nx 1000"]
    assert [row[1:3] for row in table.rows] == [["2", "500.0 ± 707.1"], ["2", "2500.0 ± 707.1"]]
    assert [row[2].mark for row in table.rows] == ["▲", ""]
