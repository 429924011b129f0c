"""Tables for notebooks."""

import re

import pandas as pd

from ffd_lightning.analysis.styled import styled

TABLE = pd.DataFrame(
    {"a": [2.0, 1.0, float("nan")], "b": [float("nan")] * 3, "c": [1, 2, 3]}, index=list("xyz")
)
FORMATS = {"a": "{:.2f}", "b": "{:.2f}", "c": "{}", "d": "{}"}


def test_numbers_have_their_formats_and_empty_columns_are_left_out():
    html = styled(TABLE, "of what", FORMATS).to_html()
    cells = re.findall(r"<td[^>]*>(.*?)</td>", html)
    assert cells == [
        "2.00",
        "1",
        "1.00",
        "2",
        "\N{EN DASH}",
        "3",
    ]
    assert "of what</caption>" in html
    assert not re.search(r"<th[^>]*>b</th>", html)
    assert "nan" not in html


def test_the_best_is_bold_where_there_is_a_choice():
    for which, place in (("min", "row1_col0"), ("max", "row0_col0")):
        html = styled(TABLE, "", FORMATS, {"a": which, "b": "min"}).to_html()
        bold = re.findall(r"#T_\S*?_(row\d+_col\d+) {\s*font-weight: bold", html)
        assert bold == [place]
    assert "bold" not in styled(TABLE[:1], "", FORMATS, {"a": "min"}).to_html()


def test_a_table_is_the_same_each_time():
    assert styled(TABLE, "x", FORMATS).to_html() == styled(TABLE, "x", FORMATS).to_html()
