import io
import json

import numpy as np
import pandas as pd
import pytest
from omegaconf import OmegaConf

from ffd_lightning.analysis.paper import MEASURES, comparison_table, paper_table
from ffd_lightning.analysis.paper_text import to_latex as latex
from ffd_lightning.analysis.paper_text import to_markdown as markdown
from ffd_lightning.analysis.runs import load_runs
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import PROTOCOLS, ProtocolDescription
from ffd_lightning.run_folder import RunFolder

SETTINGS = """
data: {name: procedural, num_models: 500}
schedule: {steps: 300, annealing_steps: 150.0, batch_size: 32, learning_rate: 0.001,
           learning_rate_decay: cosine}
encoder: {name: mobilenet, width: 0.25, weights: null}
network: {batch_norm_momentum: 0.1}
protocol: {name: paper, points: 1024}
template_strategy: {name: auto}
"""
AS_THE_PAPER = """
data: {name: shapenet}
schedule: {steps: 100000, annealing_steps: 10000.0, batch_size: 32, learning_rate: 0.001,
           learning_rate_decay: none}
encoder: {name: mobilenet, width: 0.25, weights: imagenet.h5}
network: {batch_norm_momentum: 0.01}
protocol: {name: paper, points: 1024}
template_strategy: {name: auto}
"""
REGIMES = {
    name: f"min_weight: {floor}, selection: {{name: weighted, function: {function}}}, "
    f"terms: {{negative_entropy: {{weight: {entropy}}}, offset_penalty: {{weight: 0.0}}}}"
    for name, floor, function, entropy in (
        ("b", 0.1, "identity", 0.0),
        ("w", 0.001, "log", 0.0),
        ("e", 0.1, "identity", 10.0),
    )
}


@pytest.fixture
def make(tmp_path):
    """Return a function that writes a finished run's folder."""

    def run(values, category="table", regime="b", *, seed=0, templates=16, settings=SETTINGS):
        folder = RunFolder(tmp_path / category / regime / f"t{templates}" / f"seed{seed}")
        folder.path.mkdir(parents=True)
        folder.config.write_text(
            f"category: {{name: {category}}}\nregime: {{name: {regime}, {REGIMES[regime]}}}\n"
            f"templates: {{count: {templates}}}\nseed: {seed}\n{settings}"
        )
        summary = dict(zip(("chamfer", "emd", "iou"), values, strict=True))
        summary |= {"protocol": ProtocolDescription.of(PROTOCOLS["paper"]).to_json()}
        folder.set_status("finished")
        place = folder.evaluation("paper")
        place.mkdir(parents=True)
        (place / "summary.json").write_text(json.dumps(summary | {"num_samples": 94.0}))
        return folder

    return run


def numbers(table, source, method, category):
    found = table[
        (table[["source", "method", "category"]] == [source, method, category]).all(axis=1)
    ]
    assert len(found) == 1
    return found[list(MEASURES)].iloc[0].tolist()


def test_the_papers_table():
    table = paper_table().set_index(["category", "method"])
    assert table.loc[("watercraft", "e")].tolist() == [49, 304, 361]
    assert table.loc[("car", "PSGN")].tolist() == [110, 380, 169]
    assert table.loc["table"].loc["PSGN"].isna().tolist() == [True, True, False]
    assert len(table) == 15 * 6
    rows = paper_table()
    rows = rows[~rows["category"].str.startswith("mean") & rows["method"].isin(list("bwer"))]
    means = rows.groupby("method")[list(MEASURES)].mean()
    printed = table.loc["mean13"].loc[means.index]
    np.testing.assert_allclose(means, printed, atol=0.5)


def test_one_category_and_one_regime(make):
    table = comparison_table(load_runs([make((0.05, 0.4, 0.7))]))
    assert numbers(table, "ours", "b", "table") == pytest.approx([50, 400, 300])
    assert numbers(table, "paper", "w", "table") == [46, 331, 432]
    assert table["method"].tolist() == ["b", "b", "w", "e", "r", "PSGN"], "DN has no tables"
    assert "mean" not in " ".join(table["category"]), "of one category there is no mean"


def test_seeds_are_averaged(make):
    runs = [make((c, 0.4, 0.7), seed=k) for k, c in enumerate((0.05, 0.06, 0.1))]
    table = comparison_table(load_runs([*runs, make((0.02, 0.2, 0.9), regime="w")]))
    assert numbers(table, "ours", "b", "table")[0] == pytest.approx(70)
    ours = table[table["source"] == "ours"]
    assert ours["num_seeds"].tolist() == [3, 1]
    assert "seeds (1 to 3)" in table.attrs["caption"]


def test_the_mean_is_over_the_same_categories_on_both_sides(make):
    runs = load_runs(
        [
            *(make((0.01 * k, 0.1, 0.5), c) for k, c in enumerate(("table", "chair", "plane"), 1)),
            *(make((0.02 * k, 0.1, 0.5), c, "w") for k, c in enumerate(("table", "chair"), 1)),
            make((9.0, 9.0, 0.0), "stool"),
            make((9.0, 9.0, 0.0), "stool", "w"),
        ]
    )
    table = comparison_table(runs)
    assert numbers(table, "ours", "b", "mean of 2")[0] == pytest.approx(15)
    assert numbers(table, "ours", "w", "mean of 2")[0] == pytest.approx(30)
    assert numbers(table, "paper", "w", "mean of 2") == [(35 + 46) / 2, (275 + 331) / 2, 412.5]
    psgn = numbers(table, "paper", "PSGN", "mean of 2")
    assert np.isnan(psgn[0]), "no mean without the tables' Chamfer distance"
    assert psgn[2] == (456 + 394) / 2
    means = table[table["category"] == "mean of 2"]
    assert "DN" not in means["method"].tolist()
    ours = table[(table["source"] == "ours") & (table["method"] == "b")]
    assert ours["category"].tolist() == ["plane", "chair", "table", "stool", "mean of 2"]
    caption = table.attrs["caption"]
    assert "Mean of 2, for both sides: chair, table." in caption
    assert "The paper does not have stool." in caption


def test_all_13_categories_give_the_papers_printed_mean(make):
    printed = paper_table().set_index(["category", "method"])
    names = [c for c in printed.index.unique("category") if not c.startswith("mean")]
    table = comparison_table(load_runs([make((0.1, 0.1, 0.1), name) for name in names]))
    for method in "bwer":
        mean = numbers(table, "paper", method, "mean of 13")
        np.testing.assert_allclose(mean, printed.loc[("mean13", method)], atol=0.5)


def test_numbers_of_templates_are_told_apart(make):
    runs = load_runs([make((0.05, 0.4, 0.7), templates=t) for t in (16, 2)])
    table = comparison_table(runs)
    assert table["method"].tolist()[:2] == ["b T=2", "b T=16"]


def test_the_caption_says_in_what_the_experiments_differ(make):
    first = make((0.05, 0.4, 0.7))
    caption = comparison_table(load_runs([first])).attrs["caption"]
    for words in (
        "protocol paper (1,024 points, hemisphere of radius 3.2",
        "(94 a category)",
        "data.name is procedural (paper: shapenet)",
        "templates.count is 16 (paper: 30)",
        "template_strategy.name is auto (paper: the authors' list)",
        "schedule.steps is 300 (paper: 100000)",
        "encoder.weights is unset (paper: of ImageNet)",
        "the split is ours",
    ):
        assert words in caption, words
    assert "batch_size" not in caption, "that is the same"
    assert "regime b" not in caption
    other = make((0.05, 0.4, 0.7), regime="e", settings=SETTINGS.replace("300", "900"))
    caption = comparison_table(load_runs([first, other])).attrs["caption"]
    assert "schedule.steps is 300 or 900" in caption
    assert "regime e is {" in caption
    assert "'terms.negative_entropy.weight': '10.0'" in caption


def test_what_is_as_in_the_paper_is_not_called_different(make):
    run = make((0.05, 0.4, 0.7), templates=30, settings=AS_THE_PAPER)
    caption = comparison_table(load_runs([run])).attrs["caption"]
    assert caption.endswith("cannot be drawn again; the settings are the same.")


def test_markdown(make):
    runs = load_runs([make((0.0504, 0.4, 0.7)), make((0.05, 0.4, 0.7), "a_b|c")])
    text = markdown(comparison_table(runs))
    lines = text.splitlines()
    assert lines[0] == (
        "| category | ours b | paper b | paper w | paper e | paper r | paper PSGN |"
    )
    assert lines[2].startswith("| table | 50/400/300 | 47/352/447 | ")
    assert lines[2].endswith("| -/-/394 |")
    assert lines[3] == r"| a\_b/c | 50/400/300 | - | - | - | - | - |"
    assert "batch\\_norm\\_momentum" in lines[5]


def unescaped(text, characters):
    return [k for k, c in enumerate(text) if c in characters and text[k - 1] != "\\"]


def test_latex(make):
    runs = load_runs([make((0.05, 0.4, 0.7)), make((0.05, 0.4, 0.7), "100%_a&b#")])
    text = latex(comparison_table(runs))
    body = text.split(r"\midrule")[1].split(r"\bottomrule")[0].strip().splitlines()
    assert body[0].startswith("table & 50/400/300 & 47/352/447 & ")
    assert body[1].startswith(r"100\%\_a\&b\# & 50/400/300 & - & ")
    assert all(len(unescaped(line, "&")) == 6 and line.endswith(r" \\") for line in body)
    assert r"\multicolumn{1}{c}{ours} & \multicolumn{5}{c}{paper}" in text
    assert r"\cmidrule(lr){2-2} \cmidrule(lr){3-7}" in text
    caption = text.split(r"\caption")[1]
    assert not unescaped(caption, "_%&#^$")
    assert text.count("{") == text.count("}")
    assert r"32\textasciicircum{}3 voxels" in caption


def test_csv(make):
    table = comparison_table(load_runs([make((0.05, 0.4, 0.7))]))
    again = pd.read_csv(io.StringIO(table.to_csv(index=False)))
    pd.testing.assert_frame_equal(again[list(MEASURES)], table[list(MEASURES)])
    assert again["source"].tolist() == table["source"].tolist()


def test_what_cannot_be_set_beside_the_paper_is_said(make):
    run = make((0.05, 0.4, 0.7))
    runs = load_runs([run])
    with pytest.raises(DataError, match=r"again, with protocol=paper"):
        comparison_table(runs.assign(protocol="modern"))
    with pytest.raises(DataError, match="no finished run"):
        comparison_table(runs.assign(state="failed"))
    with pytest.raises(DataError, match="has no emd"):
        comparison_table(runs.drop(columns="emd"))
    with pytest.raises(DataError, match="no column protocol"):
        comparison_table(runs.drop(columns="protocol"))
    table = comparison_table(runs)
    run.config.unlink()
    with pytest.raises(ConfigError, match=r"it has no config\.yaml"):
        comparison_table(runs)
    table.attrs.clear()
    with pytest.raises(DataError, match="lost its caption"):
        markdown(table)


def test_settings_are_read_whatever_wrote_them(make):
    run = make((0.05, 0.4, 0.7), templates=30, settings=AS_THE_PAPER)
    config = OmegaConf.load(run.config)
    config.schedule.annealing_steps = 10_000  # not 10000.0
    del config["network"]
    OmegaConf.save(config, run.config)
    caption = comparison_table(load_runs([run])).attrs["caption"]
    assert "annealing" not in caption
    assert "network.batch_norm_momentum is unset (paper: 0.01)" in caption
