import tracemalloc
from itertools import product

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from ffd_lightning.analysis import compare
from ffd_lightning.analysis.compare import (
    aggregate_seeds,
    compare_runs,
    compare_with_retrieval,
    holm,
    measure_of,
)
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription, SurfaceProtocol
from ffd_lightning.evaluation.protocols.surface import MeshRcnn

PAPER = ProtocolDescription.of(PaperProtocol())


def run_samples(scores, regime="b", *, seed=0, category="table", templates=16, **columns):
    """Samples of one run as `load_samples` gives them."""
    measure = {"chamfer": scores} if not isinstance(scores, dict) else scores
    n = len(next(iter(measure.values())))
    return pd.DataFrame(
        {
            "run": f"{category}/{regime}/t{templates}/seed{seed}",
            "regime": regime,
            "templates": templates,
            "seed": seed,
            "id": [f"m{k:05}" for k in range(n)],
            "category": category,
            "view": 0,
            **measure,
            **columns,
        }
    )


def joined(*parts):
    return pd.concat(parts, ignore_index=True)


def skewed(seed, n=60, shift=0.3):
    """Scores of two runs whose differences have a long tail."""
    rng = np.random.default_rng(seed)
    b = rng.gamma(2.0, size=n)
    return b, b + shift - rng.exponential(size=n) ** 2 / 2


# --- one category ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "differences",
    [[1.0, 2, 3, 4, 5], [1.0, 1, 1, 2, -3, 0], [0.0, 0, 1, 2], [1.0, -1], [3.0, 3, 3, 3, 3, 3, -1]],
)
def test_p_values_of_few_models_are_exact(differences):
    row = compare_runs(
        joined(run_samples(np.zeros(len(differences))), run_samples(differences, "w")),
        PAPER,
        "chamfer",
    ).iloc[0]
    d = np.array(differences)
    below = [(np.abs(d) < abs(x)).sum() for x in d]
    equal = [(np.abs(d) == abs(x)).sum() for x in d]
    ranks = [b + (e + 1) / 2 for b, e in zip(below, equal, strict=True)]

    def statistic(signs):
        return abs(sum(s * r * (x != 0) for s, r, x in zip(signs, ranks, d, strict=True)))

    values = [statistic(signs) for signs in product((-1, 1), repeat=len(d))]
    assert row["p"] == pytest.approx(np.mean(np.array(values) >= statistic(np.sign(d))))


def test_fewer_than_six_models_never_show_a_difference():
    x = np.array([1.0, 1.1, 1.3, 1.6, 2.0])
    assert sentence(0 * x, x).startswith("no difference shown")
    x = np.array([1.0, 1.1, 1.3, 1.6, 2.0, 2.5])
    assert sentence(0 * x, x).startswith("b scores better than w")


def test_intervals_hold_the_true_mean_as_often_as_they_say(monkeypatch):
    monkeypatch.setattr(compare, "RESAMPLES", 1000)
    rng = np.random.default_rng(0)
    held = []
    for _ in range(100):
        w = rng.gamma(1.0, size=40) - 1
        row = compare_runs(joined(run_samples(0 * w), run_samples(w, "w")), PAPER, "chamfer").iloc[
            0
        ]
        held.append(row["low"] <= 0 <= row["high"])
    assert 0.86 <= np.mean(held) <= 0.99


def test_models_are_paired_by_id_not_by_row():
    b, w = skewed(0)
    in_order = compare_runs(joined(run_samples(b), run_samples(w, "w")), PAPER, "chamfer")
    shuffled = joined(run_samples(b), run_samples(w, "w")).sample(frac=1, random_state=0)
    pd.testing.assert_frame_equal(compare_runs(shuffled, PAPER, "chamfer"), in_order)


def test_pairing_finds_what_the_spread_over_models_would_hide():
    rng = np.random.default_rng(0)
    b = rng.gamma(2.0, size=50)
    w = b - 0.01 - 0.001 * rng.random(50)
    row = compare_runs(joined(run_samples(b), run_samples(w, "w")), PAPER, "chamfer").iloc[0]
    assert stats.ranksums(b, w).pvalue > 0.5, "unpaired, nothing is seen"
    assert row["high"] < 0
    assert row["p"] < 1e-6


def test_only_models_that_all_runs_have_count():
    b, w = skewed(0)
    few = run_samples(w, "w").iloc[10:]
    row = compare_runs(joined(run_samples(b), few), PAPER, "chamfer").iloc[0]
    assert row["num_samples"] == 50
    assert row["difference"] == pytest.approx(np.mean((w - b)[10:]))


def test_views_of_a_model_are_one_sample():
    b, w = skewed(0, n=20)
    views = [
        run_samples(x + k, r).assign(view=k) for k in range(3) for x, r in ((b, "b"), (w, "w"))
    ]
    single = compare_runs(joined(run_samples(b), run_samples(w, "w")), PAPER, "chamfer").iloc[0]
    row = compare_runs(joined(*views), PAPER, "chamfer").iloc[0]
    for name in ("num_samples", "difference", "low", "high", "p"):
        assert row[name] == pytest.approx(single[name]), name


def test_seeds_of_a_group_are_averaged_first():
    rng = np.random.default_rng(0)
    b, w = rng.random((3, 30)), rng.random((2, 30)) + 0.2
    parts = [run_samples(x, "b", seed=k) for k, x in enumerate(b)]
    parts += [run_samples(x, "w", seed=k) for k, x in enumerate(w)]
    row = compare_runs(joined(*parts), PAPER, "chamfer").iloc[0]
    differences = w.mean(0) - b.mean(0)
    assert row["difference"] == pytest.approx(differences.mean())
    assert row["p"] == pytest.approx(stats.wilcoxon(differences).pvalue)
    assert (row["seeds_a"], row["seeds_b"]) == (2, 3)
    signs = [x.mean() > y.mean() for x in w for y in b]
    assert row["agreement"] == pytest.approx(np.mean(signs))


def test_seeds_agree_on_the_mean_over_categories_though_a_category_says_the_opposite():
    rng = np.random.default_rng(0)
    parts = []
    for category, apart in (("table", 0.5), ("sofa", -0.2)):
        for regime, more in (("b", 0.0), ("w", apart)):
            parts += [
                run_samples(rng.random(30) + more, regime, seed=k).assign(
                    category=category, run=f"{category}/{regime}/{k}"
                )
                for k in range(2)
            ]
    table = compare_runs(joined(*parts), PAPER, "chamfer").set_index("category")
    assert table.loc["sofa", "difference"] < 0 < table.loc["mean of 2", "difference"]
    assert table.loc["mean of 2", "agreement"] == 1.0


def test_all_pairs_of_regimes_in_the_papers_order():
    parts = [run_samples(np.arange(9.0) ** k, r) for k, r in enumerate("rewb")]
    table = compare_runs(joined(*parts), PAPER, "chamfer")
    assert list(zip(table["a"], table["b"], strict=True)) == [
        ("w", "b"), ("e", "b"), ("r", "b"), ("e", "w"), ("r", "w"), ("r", "e")
    ]  # fmt: skip
    assert table["p_corrected"].tolist() == holm(table["p"])


def naive_holm(p):
    """Holm's procedure as he states it: the smallest level at which each is rejected."""
    result = {}
    worst = 0.0
    for rank, k in enumerate(sorted(range(len(p)), key=lambda k: p[k])):
        worst = max(worst, p[k] * (len(p) - rank))
        result[k] = min(worst, 1.0)
    return [result[k] for k in range(len(p))]


def test_holm():
    p = np.random.default_rng(0).random(12) ** 3
    assert holm(p) == pytest.approx(naive_holm(p))
    assert holm([0.2]) == [0.2]
    assert holm([0.01, 0.01, 0.9]) == pytest.approx([0.03, 0.03, 0.9])


# --- several categories ---------------------------------------------------------------------------


def test_each_category_counts_the_same_in_the_mean():
    (b1, w1), (b2, w2) = skewed(0, n=25), skewed(1, n=80, shift=1.0)
    samples = joined(
        run_samples(b1),
        run_samples(w1, "w"),
        run_samples(b2, category="chair"),
        run_samples(w2, "w", category="chair"),
    )
    table = compare_runs(samples, PAPER, "chamfer").set_index("category")
    row = table.loc["mean of 2"]
    oracle = stats.bootstrap(
        (w1 - b1, w2 - b2),
        lambda x, y, axis: (x.mean(axis) + y.mean(axis)) / 2,
        n_resamples=20_000,
        method="BCa",
        rng=np.random.default_rng(1),
    ).confidence_interval
    width = oracle.high - oracle.low
    assert row["difference"] == pytest.approx((np.mean(w1 - b1) + np.mean(w2 - b2)) / 2)
    assert row["low"] == pytest.approx(oracle.low, abs=0.03 * width)
    assert row["high"] == pytest.approx(oracle.high, abs=0.03 * width)
    assert row["num_samples"] == 105
    one_sided = [
        stats.wilcoxon(d, alternative="greater", method="approx").pvalue for d in (w1 - b1, w2 - b2)
    ]
    combined = stats.combine_pvalues(one_sided, method="stouffer").pvalue
    assert row["p"] == pytest.approx(2 * min(combined, 1 - combined), rel=0.05)
    assert len(table) == 3


def test_categories_are_resampled_independently():
    x = np.random.default_rng(0).normal(size=30)
    samples = joined(
        run_samples(0 * x),
        run_samples(x, "w"),
        run_samples(0 * x, category="chair"),
        run_samples(-x, "w", category="chair"),
    )
    row = compare_runs(samples, PAPER, "chamfer").set_index("category").loc["mean of 2"]
    spread = np.sqrt(2 * x.var() / 30) / 2
    assert row["high"] - row["low"] == pytest.approx(2 * 1.96 * spread, rel=0.1)


def test_a_category_in_which_a_group_is_missing_is_left_out_of_the_mean():
    b, w = skewed(0)
    samples = joined(*(run_samples(x, r) for x, r in ((b, "b"), (w, "w"), (b + w, "e"))))
    other = joined(run_samples(w, "b", category="chair"), run_samples(b, "w", category="chair"))
    alone = run_samples(b, "b", category="lamp")
    table = compare_runs(joined(samples, other, alone), PAPER, "chamfer")
    assert table["category"].tolist() == ["table"] * 3 + ["chair", "mean of 2"]
    assert tuple(table.iloc[-1][["a", "b"]]) == ("w", "b")
    assert table.iloc[-1]["difference"] == pytest.approx(0, abs=1e-12)


# --- what is compared -----------------------------------------------------------------------------


def test_numbers_of_templates_are_held_apart_or_compared():
    x = np.arange(12.0)
    samples = joined(
        *(run_samples(x * t + k, r, templates=t) for t in (2, 16) for k, r in enumerate("bw"))
    )
    table = compare_runs(samples, PAPER, "chamfer")
    assert table["templates"].tolist() == [2, 16]
    assert table["difference"].tolist() == [1.0, 1.0]
    table = compare_runs(samples, PAPER, "chamfer", by="templates")
    assert table["regime"].tolist() == ["b", "w"]
    assert (table["a"] + table["b"]).tolist() == ["T=16T=2", "T=16T=2"]
    table = compare_runs(samples, PAPER, "chamfer", by=["regime", "templates"])
    assert len(table) == 6
    assert tuple(table.iloc[0][["a", "b"]]) == ("b T=16", "b T=2")


def settings(samples, *rows):
    """Settings of the samples' runs as `load_settings` gives them."""
    common = {"schedule.steps": 300, "trainer.residency": "auto"}
    return pd.DataFrame([common | row for row in rows], index=samples["run"].unique())


def test_other_settings_must_be_equal():
    x = np.arange(9.0)
    samples = joined(run_samples(x), run_samples(x + 1, "w"))
    same = settings(samples, {"regime.name": "b", "seed": 0}, {"regime.name": "w", "seed": 0})
    same.iloc[0, same.columns.get_loc("trainer.residency")] = "disk"  # where, not what
    assert len(compare_runs(samples, PAPER, "chamfer", settings=same)) == 1
    other = settings(samples, {"schedule.steps": 1000}, {})
    with pytest.raises(DataError, match=r"schedule\.steps \(1000, 300\).* regime"):
        compare_runs(samples, PAPER, "chamfer", settings=other)
    table = compare_runs(samples, PAPER, "chamfer", by=["regime", "schedule.steps"], settings=other)
    assert tuple(table.iloc[0][["a", "b"]]) == ("w schedule.steps=300", "b schedule.steps=1000")
    with pytest.raises(DataError, match="no settings of"):
        compare_runs(samples, PAPER, "chamfer", settings=other.iloc[:1])


def test_a_regime_whose_seeds_have_other_weights_is_refused():
    x = np.arange(9.0)
    samples = joined(run_samples(x), run_samples(x, "e"), run_samples(x, "e", seed=1))
    weights = settings(
        samples, *({"regime.terms.negative_entropy.weight": v} for v in (0.0, 100.0, 10.0))
    )
    with pytest.raises(DataError, match=r"negative_entropy\.weight \(10\.0, 100\.0\)"):
        compare_runs(samples, PAPER, "chamfer", settings=weights)


def test_runs_of_a_group_with_one_seed_are_not_taken_for_two_seeds():
    x = np.arange(9.0)
    twin = run_samples(x).assign(run="elsewhere")
    samples = joined(run_samples(x), twin, run_samples(x, "w"))
    with pytest.raises(DataError, match=r"elsewhere .*another setting differs"):
        compare_runs(samples, PAPER, "chamfer")
    assert len(compare_runs(samples, PAPER, "chamfer", by="run")) == 1, (
        "runs are compared within a regime"
    )
    assert len(compare_runs(samples, PAPER, "chamfer", by=["run", "regime"])) == 3


def test_single_seeds_can_be_compared():
    b, w = skewed(0)
    table = compare_runs(
        joined(run_samples(b), run_samples(w, seed=1)), PAPER, "chamfer", by="seed"
    )
    assert tuple(table.iloc[0][["a", "b", "regime"]]) == ("seed 1", "seed 0", "b")


@pytest.mark.parametrize(
    ("samples", "measure", "message"),
    [
        (joined(run_samples([1.0, 2]), run_samples([1.0, 2], "w")), "folded", "no measure"),
        (joined(run_samples([1.0, 2]), run_samples([1.0, 2], "w")), "emd", "no column emd"),
        (joined(run_samples([1.0, 2]), run_samples([1.0, np.nan], "w")), "chamfer", "w/t16/seed0 "),
        (joined(run_samples([1.0]), run_samples([1.0], "w")), "chamfer", "share 1 test shapes"),
        (joined(run_samples([1.0, 2]), run_samples([1.0, 2])), "chamfer", "are there twice"),
        (run_samples([1.0, 2]), "chamfer", "same regime"),
        (
            joined(run_samples([1.0, 2]), run_samples([1.0, 2], "w").assign(id=["x", "y"])),
            "chamfer",
            "share 0 test shapes of table",
        ),
    ],
)
def test_what_cannot_be_compared_is_said(samples, measure, message):
    with pytest.raises(DataError, match=message):
        compare_runs(samples, PAPER, measure)


def test_measures_are_known_by_protocol_and_shape():
    modern, mesh_rcnn = map(ProtocolDescription.of, (SurfaceProtocol(), MeshRcnn()))
    assert measure_of("best_deformed_emd", PAPER).name == "emd"
    assert not measure_of("chamfer", PAPER).higher_is_better
    assert measure_of("undeformed_fscore_1", modern).higher_is_better
    assert measure_of("Chamfer", mesh_rcnn).factor == 1
    with pytest.raises(DataError, match=r"fscore_1 is no measure of .* paper: it has chamfer, emd"):
        measure_of("fscore_1", PAPER)


# --- sentences ------------------------------------------------------------------------------------


def sentence(b, w, measure="chamfer"):
    samples = joined(run_samples({measure: b}), run_samples({measure: w}, "w"))
    return compare_runs(samples, PAPER, measure).iloc[0]["statement"]


@pytest.mark.parametrize(
    ("seeds", "spread", "verb"),
    [(1, 0.0, "scores better than"), (2, 0.0, "beats"), (2, 3.0, "scores better than")],
)
def test_only_runs_trained_again_that_agree_beat_others(seeds, spread, verb):
    x = np.linspace(1, 2, 30) ** 2
    parts = [run_samples(x + spread * s, "b", seed=s) for s in range(seeds)]
    parts += [run_samples(x + spread * s - 0.5, "w", seed=s) for s in range(seeds)]
    row = compare_runs(joined(*parts), PAPER, "chamfer").iloc[0]
    assert row["statement"].startswith(f"w {verb} b on table (T=16): Chamfer lower by 500.0")
    assert row["shown"]
    assert row["mean_a"] - row["mean_b"] == pytest.approx(row["difference"])
    assert row["mean_b"] == pytest.approx((x + spread * np.arange(seeds)[:, None]).mean())


def test_no_difference_is_no_win():
    x = np.sin(np.arange(30.0))
    assert sentence(x, x[::-1]).startswith("no difference shown between w and b on table (T=16): ")
    samples = joined(run_samples(x), run_samples(x, "w"))
    row = compare_runs(samples, PAPER, "chamfer").iloc[0]
    assert (row["difference"], row["low"], row["high"], row["p"]) == (0, 0, 0, 1)


def test_mean_and_ranks_must_agree():
    x = np.full(40, 0.1) + 1e-3 * np.arange(40)
    outliers = np.where(np.arange(40) < 6, 2.0 + np.arange(40), 0)
    assert sentence(0 * x, x - outliers).startswith("no difference shown between w and b on table")


def test_equal_shifts_of_all_models_have_no_interval():
    row = compare_runs(
        joined(run_samples(np.arange(20.0)), run_samples(np.arange(20.0) + 0.5, "w")),
        PAPER,
        "chamfer",
    ).iloc[0]
    assert (row["low"], row["high"]) == (0.5, 0.5)
    assert row["statement"].startswith("b scores better than w")


def test_many_models_need_little_memory(monkeypatch):
    monkeypatch.setattr(compare, "RESAMPLES", 500)
    rng = np.random.default_rng(0)
    samples = joined(run_samples(rng.random(10_000)), run_samples(rng.random(10_000), "w"))
    tracemalloc.start()
    compare_runs(samples, PAPER, "chamfer")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 40e6


# --- means over seeds -----------------------------------------------------------------------------


def run_rows(values, **columns):
    return pd.DataFrame(
        {
            "run": [f"{columns}{k}" for k in range(len(values))],
            "category": "table",
            "regime": "b",
            "templates": 16,
            "seed": range(len(values)),
            "state": "finished",
            "protocol": "paper",
            "chamfer": values,
            **columns,
        }
    )


def test_means_and_deviations_over_seeds():
    runs = joined(run_rows([1.0, 2.0, 6.0]), run_rows([5.0], regime="w"))
    table = aggregate_seeds(runs, ["chamfer"])
    assert table["regime"].tolist() == ["b", "w"]
    assert table["num_seeds"].tolist() == [3, 1]
    assert table["chamfer"].tolist() == [3, 5]
    assert table["chamfer_std"][0] == pytest.approx(np.sqrt((4 + 1 + 9) / 2))
    assert np.isnan(table["chamfer_std"][1])


@pytest.mark.parametrize("column", ["category", "regime", "templates", "protocol"])
def test_seeds_are_never_mixed_over(column):
    other = {"category": "chair", "regime": "w", "templates": 2, "protocol": "modern"}[column]
    table = aggregate_seeds(
        joined(run_rows([1.0]), run_rows([3.0], **{column: other})), ["chamfer"]
    )
    assert table["chamfer"].tolist() == [1, 3]


def test_runs_that_failed_are_passed_over_and_gaps_are_said():
    failed = run_rows([np.nan], state="failed", seed=9)
    assert aggregate_seeds(joined(run_rows([1.0]), failed), ["chamfer"])["num_seeds"].tolist() == [
        1
    ]
    with pytest.raises(DataError, match="no run is finished"):
        aggregate_seeds(failed, ["chamfer"])
    with pytest.raises(DataError, match="has no chamfer"):
        aggregate_seeds(joined(run_rows([1.0]), failed.assign(state="finished")), ["chamfer"])
    with pytest.raises(DataError, match="has no emd"):
        aggregate_seeds(run_rows([1.0]), ["emd"])
    with pytest.raises(DataError, match="another setting differs"):
        aggregate_seeds(run_rows([1.0, 2.0]).assign(seed=0), ["chamfer"])


# --- runs that differ in more than regime and number of templates ---------------------------------


def test_setups_may_differ_in_anything_and_models_of_joint_runs_are_the_same_models():
    x = np.linspace(1, 2, 20)
    alone = run_samples(x + 0.5, templates=8).assign(setup="table alone")
    together = [
        run_samples(x, category=c, templates=4).assign(run="joint", setup="joint")
        for c in ("table", "sofa")
    ]
    for part in together:
        part["id"] = part["category"] + "/" + part["id"]
    samples = joined(alone, *together)
    settings = pd.DataFrame(
        {"schedule.steps": [100, 200]}, index=pd.Index([alone["run"][0], "joint"], name="run")
    )
    (row,) = compare_runs(samples, PAPER, "chamfer", by="setup", settings=settings).to_dict(
        "records"
    )
    assert (row["category"], row["a"], row["b"]) == ("table", "table alone", "joint")
    assert row["num_samples"] == 20
    assert row["difference"] == pytest.approx(0.5)
    with pytest.raises(DataError, match=r"schedule\.steps"):
        compare_runs(samples, PAPER, "chamfer", by="templates", settings=settings)


def test_seeds_of_a_setup_are_averaged():
    x = np.linspace(1, 2, 20)
    seeds = [run_samples(x + s, seed=s).assign(setup="long") for s in (0, 1)]
    other = run_samples(x, templates=2).assign(setup="short")
    (row,) = compare_runs(joined(*seeds, other), PAPER, "chamfer", by="setup").to_dict("records")
    assert (row["seeds_a"], row["seeds_b"]) == (1, 2)
    assert row["difference"] == pytest.approx(-0.5)


def test_a_network_is_held_against_what_it_retrieves():
    rng = np.random.default_rng(0)
    network, retrieved = rng.random((2, 2, 30))
    runs = [
        run_samples(network[k], "e", seed=k, feature_retrieval_chamfer=retrieved[k] + 0.5)
        for k in range(2)
    ]
    other = run_samples(network[0], "r", feature_retrieval_chamfer=network[0])
    table = compare_with_retrieval(joined(*runs, other), PAPER, "chamfer")
    assert table[["a", "b"]].drop_duplicates().to_numpy().tolist() == [["the network", "retrieval"]]
    row, same = (table[table["regime"] == name].iloc[0] for name in "er")
    differences = network.mean(0) - retrieved.mean(0) - 0.5
    assert row["difference"] == pytest.approx(differences.mean())
    assert row["low"] < differences.mean() < row["high"] < 0
    assert (row["num_samples"], row["seeds_a"], row["seeds_b"]) == (30, 2, 2)
    assert row["statement"].startswith("the network beats retrieval on table (e T=16): Chamfer")
    assert "no difference shown between the network and retrieval" in same["statement"]
    with pytest.raises(DataError, match="no column feature_retrieval_emd"):
        compare_with_retrieval(joined(*runs), PAPER, "emd")
    half = joined(runs[0], run_samples(network[1], "e", seed=1))
    with pytest.raises(DataError, match="samples without feature_retrieval_chamfer: ffd evaluate"):
        compare_with_retrieval(half, PAPER, "chamfer")
