"""Tests of analysis/selection.py (tests/metrics has a test_selection.py)."""

from itertools import combinations

import numpy as np
import pytest
from analysis.made import results
from analysis.made import run_samples as made_samples

from ffd_lightning.analysis.selection import selection_stability, selection_table
from ffd_lightning.errors import ConfigError, DataError

NAME = "table/b/t4/seed0"


def run_samples(templates, regime="b", **columns):
    n = len(templates)
    columns = {"template": list(templates), "templates": 4, "chamfer": 0.0} | columns
    return made_samples(n, regime, **columns)


def test_counts_of_the_selected_templates():
    table = selection_table(results(run_samples("xxxyyz"), run_samples("xxxxxx", "w")))
    b, w = table.to_dict("records")
    shares = np.array([3, 2, 1]) / 6
    assert b["entropy"] == pytest.approx(-(shares * np.log(shares)).sum())
    assert w["entropy"] == 0
    for name, values in (("templates_used", [3, 1]), ("top1_share", [0.5, 1])):
        assert table[name].tolist() == values
    assert not {"regret", "best_share", "family_agreement"} & set(table), "nothing to say of these"


def test_regret_is_what_a_better_choice_would_have_saved():
    scores = {
        "": ([3.0, 5.0, 1.0], [0.4, 0.0, 0.9]),
        "best_deformed_": ([2.0, 5.0, 1.0], [0.7, 0.0, 0.9]),
        "undeformed_": ([9.0, 8.0, 4.0], [0.0, 0.0, 0.1]),
        "best_undeformed_": ([3.0, 7.0, 4.0], [0.0, 0.0, 0.1]),
    }
    columns = {f"{shape}emd": 0.0 for shape in scores}
    for shape, (chamfer, iou) in scores.items():
        columns |= {f"{shape}chamfer": chamfer, f"{shape}iou": iou}
    samples = run_samples("xyx", **columns)
    row = selection_table(results(samples)).iloc[0]
    assert row["regret"] == pytest.approx((1 + 0 + 0) / 3)
    assert row["undeformed_regret"] == pytest.approx((6 + 1 + 0) / 3)
    assert row["best_share"] == pytest.approx(2 / 3)
    row = selection_table(results(samples), "iou").iloc[0]
    assert row["regret"] == pytest.approx(0.3 / 3), "of IoU more is better"
    # Equal IoU of 0 does not make two shapes one: all measures must be equal.
    assert row["undeformed_best_share"] == pytest.approx(1 / 3)
    without = run_samples("xyz", seed=1)
    table = selection_table(results(samples, without))
    assert table["regret"].notna().tolist() == [True, False]
    with pytest.raises(ConfigError, match="no metric"):
        selection_table(results(without), "weight")


def test_families_beside_chance_and_what_can_be_reached():
    samples = run_samples("xyyxx", family=["desk", "desk", "bar", "round", "kitchen"])
    families = {NAME: {"x": "table/desk", "y": "table/bar", "z": "table/round"}}
    row = selection_table(results(samples, families=families)).iloc[0]
    assert row["family_agreement"] == pytest.approx(2 / 5)
    assert row["family_chance"] == pytest.approx(2 / 5 * 3 / 5 + 1 / 5 * 2 / 5)
    assert row["family_reachable"] == pytest.approx(4 / 5), "z too, which was never selected"
    # For which samples templates are selected does not change what chance is.
    samples["template"] = list("yxxxy")
    other = selection_table(results(samples, families=families)).iloc[0]
    assert other["family_agreement"] == pytest.approx(1 / 5)
    assert other["family_chance"] == row["family_chance"]


def test_unknown_families_are_left_out():
    families = {NAME: {"x": "table/desk", "y": "table/bar"}}
    samples = run_samples("xyyx", family=["desk", None, "desk", ""])
    found = selection_table(results(samples, families=families))
    assert found.iloc[0]["family_agreement"] == 0.5
    for unknown in (results(samples), results(samples.assign(family=None), families=families)):
        assert "family_agreement" not in selection_table(unknown)
    with pytest.raises(DataError, match="selects y"):
        selection_table(results(samples, families={NAME: {"x": "table/desk"}}))


def test_a_family_of_another_category_is_another_family():
    samples = run_samples("xyy", family="plain").assign(category=["table", "table", "chair"])
    families = {NAME: {"x": "table/plain", "y": "chair/plain"}}
    row = selection_table(results(samples, families=families)).iloc[0]
    assert (row["category"], row["family_agreement"]) == ("table, chair", pytest.approx(2 / 3))


def naive_rand(a, b):
    pairs = list(combinations(range(len(a)), 2))
    both = sum(a[i] == a[j] and b[i] == b[j] for i, j in pairs)
    first, second = (sum(x[i] == x[j] for i, j in pairs) for x in (a, b))
    expected = first * second / len(pairs)
    return (both - expected) / ((first + second) / 2 - expected)


def test_seeds_are_compared_over_the_samples_both_have():
    a, b, c = selections = "xxyyzzxy", "xxyyzzyy", "yyxxzzzx"
    parts = [run_samples(s, seed=k) for k, s in enumerate(selections)]
    parts[1] = parts[1].iloc[::-1]  # rows in another order
    parts[2] = parts[2].iloc[1:]  # a sample less
    table = selection_stability(results(*parts, run_samples("xxxxxxxx", "w"))).set_index("regime")
    pairs = [(a, b), (a[1:], c[1:]), (b[1:], c[1:])]
    expected = np.mean([naive_rand(*pair) for pair in pairs])
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
    with pytest.raises(DataError, match="share 0 test samples"):
        selection_stability(results(first, second.assign(id=list("pqrs"))))
