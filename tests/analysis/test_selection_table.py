"""Tests of analysis/selection.py (tests/metrics has a test_selection.py)."""

from dataclasses import replace

import numpy as np
import pytest
from analysis.made import PAPER, results
from analysis.made import run_samples as made_samples

from ffd_lightning.analysis.selection import selection_stability, selection_table
from ffd_lightning.metrics.selection import adjusted_rand


def run_samples(templates, regime="b", **columns):
    n = len(templates)
    columns = {"template": list(templates), "templates": 4, "chamfer": 0.0} | columns
    return made_samples(n, regime, **columns)


def test_counts_of_the_selected_templates():
    table = selection_table(results(run_samples("xxxyyz"), run_samples("xxxxxx", "w")))
    b, w = table.to_dict("records")
    shares = np.array([3, 2, 1]) / 6
    assert b["effective_templates"] == pytest.approx(np.exp(-(shares * np.log(shares)).sum()))
    assert w["effective_templates"] == 1
    for name, values in (("templates_used", [3, 1]), ("top1_share", [0.5, 1])):
        assert table[name].tolist() == values
    assert not {"regret", "best_share"} & set(table), "nothing to say of these"


def test_regret_is_what_a_better_choice_would_have_saved():
    scores = {
        "": ([3.0, 5.0, 1.0], [0.4, 0.0, 0.9]),
        "best_deformed_": ([2.0, 5.0, 1.0], [0.7, 0.1, 0.9]),
    }
    columns = {f"{shape}emd": 0.0 for shape in scores}
    for shape, (chamfer, iou) in scores.items():
        columns |= {f"{shape}chamfer": chamfer, f"{shape}iou": iou}
    samples, without = run_samples("xyx", **columns), run_samples("xyz", seed=1)
    table = selection_table(results(samples, without))
    assert table["regret"].tolist() == pytest.approx([(1 + 0 + 0) / 3, np.nan], nan_ok=True)
    # An equal Chamfer distance does not make two shapes one: all metrics must be equal.
    assert table["best_share"].iloc[0] == pytest.approx(1 / 3)
    higher = replace(PAPER, metrics=PAPER.metrics[2:])
    row = selection_table(results(samples, protocol=higher)).iloc[0]
    assert row["regret"] == pytest.approx(0.4 / 3), "of IoU more is better"


def test_seeds_are_compared_over_the_samples_both_have():
    a, b, c = selections = "xxyyzzxy", "xxyyzzyy", "yyxxzzzx"
    parts = [run_samples(s, seed=k) for k, s in enumerate(selections)]
    parts[1] = parts[1].iloc[::-1]  # rows in another order
    parts[2] = parts[2].iloc[1:]  # a sample less
    table = selection_stability(results(*parts, run_samples("xxxxxxxx", "w"))).set_index("regime")
    pairs = [(a, b), (a[1:], c[1:]), (b[1:], c[1:])]
    expected = np.mean([adjusted_rand(*map(list, pair)) for pair in pairs])
    assert table.loc["b", "adjusted_rand"] == pytest.approx(expected)
    same = [np.mean([x == y for x, y in zip(*pair, strict=True)]) for pair in pairs]
    assert table.loc["b", "same_template"] == pytest.approx(np.mean(same))
    assert table.loc["b", ["num_seeds", "num_pairs", "num_samples"]].tolist() == [3, 3, 7]
    assert table.loc["w", "num_pairs"] == 0
    assert np.isnan(table.loc["w", "adjusted_rand"])


def test_other_templates_can_group_the_same():
    first, second = run_samples("xxyz"), run_samples("ppqr", seed=1)
    row = selection_stability(results(first, second)).iloc[0]
    assert (row["adjusted_rand"], row["same_template"]) == (1, 0)
    others = selection_stability(results(first, second.assign(id=list("pqrs")))).iloc[0]
    assert others["num_pairs"] == 0, "of samples that both have"
