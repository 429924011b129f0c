"""Tests of analysis/selection.py (tests/metrics has a test_selection.py)."""

from itertools import combinations

import numpy as np
import pandas as pd
import pytest

from ffd_lightning.analysis.selection import run_families, selection_stability, selection_table
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription
from ffd_lightning.run_folder import RunFolder

PAPER = ProtocolDescription.of(PaperProtocol())


def run_samples(templates, *, run="a", seed=0, regime="b", **columns):
    """Samples of one run as `load_samples` gives them."""
    n = len(templates)
    return pd.DataFrame(
        {
            "run": run,
            "regime": regime,
            "templates": 4,
            "seed": seed,
            "id": [f"m{k}" for k in range(n)],
            "category": "table",
            "family": None,
            "view": 0,
            "template": list(templates),
            "chamfer": 0.0,
            **columns,
        }
    )


def test_counts_of_the_selected_templates():
    samples = pd.concat([run_samples("xxxyyz"), run_samples("xxxxxx", run="b", regime="w")])
    table = selection_table(samples, PAPER).set_index("run")
    shares = np.array([3, 2, 1]) / 6
    assert table.loc["a", "entropy"] == pytest.approx(-(shares * np.log(shares)).sum())
    assert table.loc["b", "entropy"] == 0
    assert table["effective_templates"].tolist() == pytest.approx([2.7495, 1], abs=1e-3)
    assert table["templates_used"].tolist() == [3, 1]
    assert table["top1_share"].tolist() == [0.5, 1]
    assert table["top5_share"].tolist() == [1, 1]
    assert table["regime"].tolist() == ["b", "w"]
    assert table["num_samples"].tolist() == [6, 6]
    assert not {"regret", "best_share", "family_agreement"} & set(table), "nothing to say of these"


def with_references(**changes):
    columns = {
        "chamfer": [3.0, 5.0, 1.0],
        "iou": [0.4, 0.0, 0.9],
        "best_deformed_chamfer": [2.0, 5.0, 1.0],
        "best_deformed_iou": [0.7, 0.0, 0.9],
        "undeformed_chamfer": [9.0, 8.0, 4.0],
        "undeformed_iou": [0.0, 0.0, 0.1],
        "best_undeformed_chamfer": [3.0, 7.0, 4.0],
        "best_undeformed_iou": [0.0, 0.0, 0.1],
    }
    return run_samples("xyx", **(columns | changes))


def test_regret_is_what_a_better_choice_would_have_saved():
    row = selection_table(with_references(), PAPER).iloc[0]
    assert row["regret"] == pytest.approx((1 + 0 + 0) / 3)
    assert row["undeformed_regret"] == pytest.approx((6 + 1 + 0) / 3)
    assert row["best_share"] == pytest.approx(2 / 3)
    row = selection_table(with_references(), PAPER, measure="iou").iloc[0]
    assert row["regret"] == pytest.approx(0.3 / 3), "of IoU more is better"
    # Equal IoU of 0 does not make two shapes one: all measures must be equal.
    assert row["undeformed_best_share"] == pytest.approx(1 / 3)


def test_runs_without_references_have_no_regret():
    without = run_samples("xyz", run="b", seed=1, iou=0.0)
    table = selection_table(pd.concat([with_references(), without]), PAPER).set_index("run")
    assert table["regret"].notna().tolist() == [True, False]
    with pytest.raises(DataError, match="no column emd"):
        selection_table(with_references(), PAPER, measure="emd")
    with pytest.raises(DataError, match="no measure"):
        selection_table(with_references(), PAPER, measure="weight")


def test_families_beside_chance_and_what_can_be_reached():
    samples = run_samples("xyyxx", family=["desk", "desk", "bar", "round", "kitchen"])
    families = {"a": {"x": "table/desk", "y": "table/bar", "z": "table/round"}}
    row = selection_table(samples, PAPER, families).iloc[0]
    assert row["family_agreement"] == pytest.approx(2 / 5)
    assert row["family_chance"] == pytest.approx(2 / 5 * 3 / 5 + 1 / 5 * 2 / 5)
    assert row["family_reachable"] == pytest.approx(4 / 5), "z too, which was never selected"
    # For which samples templates are selected does not change what chance is.
    other = selection_table(samples.assign(template=list("yxxxy")), PAPER, families).iloc[0]
    assert other["family_agreement"] == pytest.approx(1 / 5)
    assert other["family_chance"] == row["family_chance"]


def test_unknown_families_are_left_out():
    families = {"a": {"x": "table/desk", "y": "table/bar"}}
    samples = run_samples("xyyx", family=["desk", None, "desk", ""])
    assert selection_table(samples, PAPER, families).iloc[0]["family_agreement"] == 0.5
    assert "family_agreement" not in selection_table(samples.assign(family=None), PAPER, families)
    assert "family_agreement" not in selection_table(samples, PAPER, {"another": families["a"]})
    assert "family_agreement" not in selection_table(samples, PAPER, {"a": {"x": "", "y": ""}})
    with pytest.raises(DataError, match="a selects y"):
        selection_table(samples, PAPER, {"a": {"x": "table/desk"}})


def test_a_family_of_another_category_is_another_family():
    samples = run_samples("xyy", family="plain", category=["table", "table", "chair"])
    row = selection_table(samples, PAPER, {"a": {"x": "table/plain", "y": "chair/plain"}}).iloc[0]
    assert row["category"] == "table, chair"
    assert row["family_agreement"] == pytest.approx(2 / 3)


def ranked(folder, families, config="category: {name: table}\n"):
    """A run folder as training leaves it, as far as these tests look."""
    run = RunFolder(folder)
    run.path.mkdir()
    run.config.write_text(config)
    rows = [f"{k},{i},{family}" for k, (i, family) in enumerate(families.items())]
    (run.path / "template_ranking.csv").write_text("\n".join(["rank,id,family", *rows, ""]))
    return run


def test_families_come_with_the_ranking_of_the_templates(tmp_path):
    run = ranked(tmp_path / "run", {"001": "desk", "2": "", "NA": "nan"})
    expected = {"001": "table/desk", "2": "", "NA": "table/nan"}
    assert run_families([run]) == {str(run.path): expected}
    members = "category: {name: two, members: [table, lamp]}\n"
    joint = ranked(tmp_path / "joint", {"lamp/1": "desk", "table/1": "desk"}, members)
    assert run_families([joint]) == {
        str(joint.path): {"lamp/1": "lamp/desk", "table/1": "table/desk"}
    }
    alone = ranked(tmp_path / "alone", {"1": "desk"}, "category: {name: table, members: [table]}\n")
    assert run_families([alone]) == {str(alone.path): {"1": "table/desk"}}


def test_runs_without_families_are_left_out(tmp_path):
    unknown = ranked(tmp_path / "unknown", {"a": "", "b": ""})
    new = ranked(tmp_path / "new", {})
    (new.path / "template_ranking.csv").unlink()
    assert run_families([unknown, new]) == {}
    for damaged in ("", "rank,id\n1,a\n"):
        (unknown.path / "template_ranking.csv").write_text(damaged)
        with pytest.raises(DataError, match=r"template_ranking\.csv is damaged or of another"):
            run_families([unknown])


def naive_rand(a, b):
    pairs = list(combinations(range(len(a)), 2))
    both = sum(a[i] == a[j] and b[i] == b[j] for i, j in pairs)
    first, second = (sum(x[i] == x[j] for i, j in pairs) for x in (a, b))
    expected = first * second / len(pairs)
    return (both - expected) / ((first + second) / 2 - expected)


def test_seeds_are_compared_over_the_samples_both_have():
    selections = {0: "xxyyzzxy", 1: "xxyyzzyy", 2: "yyxxzzzx"}
    parts = [run_samples(s, run=f"r{k}", seed=k) for k, s in selections.items()]
    parts[1] = parts[1].iloc[::-1]  # rows in another order
    parts[2] = parts[2].iloc[1:]  # a sample less
    other = run_samples("xxxxxxxx", run="w", regime="w")
    table = selection_stability(pd.concat([*parts, other])).set_index("regime")
    a, b, c = selections.values()
    pairs = [(a, b), (a[1:], c[1:]), (b[1:], c[1:])]
    assert table.loc["b", "adjusted_rand"] == pytest.approx(
        np.mean([naive_rand(*p) for p in pairs])
    )
    same = [np.mean([x == y for x, y in zip(*p, strict=True)]) for p in pairs]
    assert table.loc["b", "same_template"] == pytest.approx(np.mean(same))
    assert table.loc["b", ["num_seeds", "num_pairs", "num_samples"]].tolist() == [3, 3, 7]
    assert table.loc["w", "num_pairs"] == 0
    assert np.isnan(table.loc["w", "adjusted_rand"])


def test_other_templates_can_group_the_same():
    samples = pd.concat([run_samples("xxyz"), run_samples("ppqr", run="b", seed=1)])
    row = selection_stability(samples).iloc[0]
    assert (row["adjusted_rand"], row["same_template"]) == (1, 0)


def test_seeds_that_share_nothing_are_said():
    first = run_samples("xy")
    strange = run_samples("xy", run="b", seed=1).assign(id=["p", "q"])
    with pytest.raises(DataError, match="a and b share 0 test samples"):
        selection_stability(pd.concat([first, strange]))
    with pytest.raises(DataError, match="another setting differs"):
        selection_stability(pd.concat([first, strange.assign(seed=0)]))
