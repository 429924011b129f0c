import csv
import io

import pytest
from analysis.folders import write_run
from rich.console import Console

from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.table import Cell, Table
from ffd_lightning.analysis.tables import differing_settings, scores, summary_tables
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription

NUMBERS = ["1234.5", "7.25", "0.0 ± 1"]
TABLE = Table(
    "Of what",
    ["regime", *(f"a long heading {k}\nx 1000" for k in range(9))],
    [["b", *[NUMBERS[0]] * 9], ["posterior", *[NUMBERS[1]] * 9], ["w, log", *[NUMBERS[2]] * 9]],
    note="word " * 100,
)


def printed(*tables, width=None):
    file = io.StringIO()
    for table in tables:
        Console(file=file, width=width or 10_000).print(table)
    return file.getvalue()


@pytest.mark.parametrize("width", [40, 120, None])
def test_no_number_is_cut_and_no_line_is_too_long(width):
    text = printed(TABLE.rich(width), width=width)
    assert max(len(line) for line in text.splitlines() if "word" in line) <= (width or 100)
    assert width is None or max(map(len, text.splitlines())) <= width
    for number in NUMBERS:
        assert text.count(number) == 9
    assert (text.count("w, log") == 1) == (width is None), "each part says which rows it is of"


def test_all_forms_hold_the_same_cells():
    cells = [["a|b<", Cell("1.5", "▲"), "-"], ["c", "20", "0.5"]]
    table = Table("t", ["name", "x\nunit", "y_%"], cells, note="n & m")
    head, *rows = csv.reader(io.StringIO(table.csv()))
    assert head == ["name", "x unit", "y_%"]
    assert rows == [list(map(str, row)) for row in cells]
    assert table.markdown().splitlines()[2] == "| a/b< | 1.5 ▲ | - |"
    html = table.html()
    assert "a|b&lt;" in html
    assert '<td class="number">1.5 <b class="mark">▲</b></td>' in html
    assert "n &amp; m" in html


PROTOCOL = ProtocolDescription("mine", "", (Metric("chamfer", "squared"),))


def test_seeds_become_a_mean_and_the_best_and_what_reads_the_same_is_marked(tmp_path):
    for regime, chamfers in {"b": (0, 0.06402), "w": (0, 0.06398), "e": (0.04, 0.06)}.items():
        for seed, chamfer in enumerate(chamfers):
            run = tmp_path / f"{regime}{seed}"
            write_run(run, regime, seed=seed, protocol=PROTOCOL, chamfer=[chamfer, chamfer])
    table = scores(Results.read(tmp_path))
    assert table.columns[:3] == ["regime", "seeds", "Chamfer ↓\nx 1000"]
    means = ["32.0 ± 45.3", "32.0 ± 45.2", "50.0 ± 14.1"]
    assert [row[1:3] for row in table.rows] == [["2", mean] for mean in means]
    assert [row[2].mark for row in table.rows] == ["▲", "▲", ""]


def test_a_training_ends_with_scores_and_reasons_under_its_protocol(tmp_path):
    own = ProtocolDescription("own", "no unit", (Metric("warmth", "degrees", True, 1.0),))
    run = write_run(tmp_path / "own", protocol=own, warmth=0.7, medoid_warmth=0.2)
    failed, damaged = (write_run(tmp_path / name, protocol=own) for name in ("failed", "damaged"))
    failed.set_status("failed", reason="the disk is full", evaluation={"name": "own"})
    damaged.config.write_text("")
    text = " ".join(printed(*summary_tables([run, failed, damaged])).split())
    assert "protocol own: table, T = 4, seed 0, 2 test shapes" in text
    words = ("warmth ↑", "0.7", "central training shape", "the disk is full", "does not name")
    assert all(word in text for word in words)
    assert "holds no run that can be read" in printed(*summary_tables([damaged]))


def test_settings_stand_once_for_all_seeds_and_categories(tmp_path):
    runs = (("a", "table", 0, 3), ("b", "lamp", 1, 3), ("c", "table", 0, 9))
    for name, category, seed, steps in runs:
        settings = f"schedule: {{steps: {steps}}}\n"
        write_run(tmp_path / name, category=category, seed=seed, settings=settings)
    table, shared = differing_settings(Results.read(tmp_path))
    assert list(table.columns) == ["run", "schedule.steps"]
    assert sorted(map(list, table.rows)) == [["schedule.steps=3", "3"], ["schedule.steps=9", "9"]]
    assert shared == ["regime.name=b", "templates.count=4"]
