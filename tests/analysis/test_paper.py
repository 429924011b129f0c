import io
import json
import re
import shutil

import numpy as np
import pytest
from omegaconf import OmegaConf
from rich.console import Console

from ffd_lightning.analysis.paper import FIVE, MEASURES, comparison_table, paper_table
from ffd_lightning.analysis.paper_settings import paper_settings
from ffd_lightning.analysis.paper_text import stacked, to_console
from ffd_lightning.analysis.paper_text import to_latex as latex
from ffd_lightning.analysis.paper_text import to_markdown as markdown
from ffd_lightning.analysis.runs import load_runs
from ffd_lightning.data.categories import PAPER_CATEGORIES, paper_templates
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import PROTOCOLS, ProtocolDescription
from ffd_lightning.run_folder import RunFolder

SETTINGS = {
    "data.name": "procedural",
    "data.num_models": 500,
    "schedule.steps": 300,
    "encoder.weights": None,
    "network.batch_norm_momentum": 0.1,
}


def nested(flat):
    """Settings as a run's config.yaml has them."""
    config = OmegaConf.create({})
    for key, value in flat.items():
        OmegaConf.update(config, key, value, force_add=True)
    return config


@pytest.fixture
def make(tmp_path):
    """Return a function that writes a finished run's folder, as the paper's but for `settings`."""

    def run(
        values, category="table", regime="b", *, seed=0, templates=30, settings=SETTINGS, **changes
    ):
        paper = paper_settings()
        own = paper.settings | {f"regime.{k}": v for k, v in paper.regimes[regime].items()}
        named = {"category.name": category, "regime.name": regime, "seed": seed}
        own |= {"data.images": "render", "paths.data": "data", "templates.count": templates}
        own |= named | dict(settings)
        folder = RunFolder(tmp_path / category / regime / f"t{own['templates.count']}/seed{seed}")
        folder.path.mkdir(parents=True)
        OmegaConf.save(nested(own), folder.config)
        folder.set_data(
            {
                "sources": {category: {"source": "shapenet", "version": 1}},
                "templates": list(paper_templates(category)),
                "shapes": {"train": 6785, "val": 0, "test": 1694},
            }
            | changes.pop("data", {})
        )
        summary = dict(zip(("chamfer", "emd", "iou"), values, strict=True)) | {
            "num_samples": 94.0,
            "step": own["schedule.steps"],
            "settings": {"all_views": False},
            "protocol": ProtocolDescription.of(PROTOCOLS["paper"]).to_json(),
        }
        folder.set_status("finished")
        place = folder.evaluation("paper")
        place.mkdir(parents=True)
        (place / "summary.json").write_text(json.dumps(summary | changes))
        return folder

    return run


def differences(*runs):
    """What the runs differ in from the paper, without what always is different."""
    told = comparison_table(load_runs(runs)).attrs["differences"]
    always = set(paper_settings().always)
    assert always < set(told)
    assert told[-1].startswith("the paper does not print its numbers of shapes; ours, ")
    assert any(x.startswith("the image source is ") for x in told)
    rest = [x for x in told[:-1] if x not in always]
    return [x for x in rest if x != IMAGES]


IMAGES = "the image source is this package's renderer (paper: the authors' renderings, by Blender)"


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


def test_the_means_are_the_papers_five_and_all_13(make):
    runs = [make((0.01 * k, 0.1, 0.5), c) for k, c in enumerate((*FIVE, "lamp"), 1)]
    table = comparison_table(load_runs(runs))
    assert numbers(table, "ours", "b", "mean of 5")[0] == pytest.approx(30)
    assert numbers(table, "ours", "b", "mean of 6")[0] == pytest.approx(35)
    assert numbers(table, "paper", "r", "mean of 5") == [48, 292, 329], "as printed"
    assert numbers(table, "paper", "DN", "mean of 5")[:2] == [130, 580]
    assert numbers(table, "paper", "PSGN", "mean of 5") == [200, 780, 353]
    assert numbers(table, "paper", "e", "mean of 6")[1] == (300 + 284 + 325 + 277 + 324 + 384) / 6
    caption = table.attrs["caption"]
    assert "Mean of 5, for both sides: plane, bench, car, chair, sofa." in caption
    assert "EMD of e and r, for which they give 302 and 300, and of PSGN, 569." in caption
    five = paper_table().query("category in @FIVE").groupby("method")["emd"].mean()
    assert [round(five[m]) for m in ("e", "r", "PSGN")] == [302, 300, 569]
    without = comparison_table(load_runs(runs[:4])).attrs["caption"]
    assert "Mean of 4" in without
    assert "569" not in without
    rest = [make((0.1, 0.1, 0.5), c) for c in PAPER_CATEGORIES if c not in (*FIVE, "lamp")]
    table = comparison_table(load_runs([*runs, *rest]))
    assert numbers(table, "paper", "PSGN", "mean of 13") == [250, 800, 360]
    ours = table[table["source"] == "ours"]["category"].tolist()
    assert ours == [*PAPER_CATEGORIES, "mean of 5", "mean of 13"]


def test_five_other_categories_have_a_mean_of_their_own(make):
    names = ("plane", "bench", "car", "chair", "table")
    table = comparison_table(load_runs([make((0.1, 0.1, 0.5), c) for c in names]))
    assert numbers(table, "paper", "b", "mean of 5")[0] == pytest.approx(
        (31 + 42 + 58 + 36 + 47) / 5
    )
    assert "DN" not in table[table["category"] == "mean of 5"]["method"].tolist()
    assert "Mean of 5, for both sides: plane, bench, car, chair, table." in table.attrs["caption"]


def test_what_is_as_in_the_paper_is_not_called_different(make):
    run = make((0.05, 0.4, 0.7), settings={})
    assert differences(run) == []
    table = comparison_table(load_runs([run]))
    caption = table.attrs["caption"]
    for words in (
        "protocol paper (1,024 points, hemisphere of radius 3.2",
        "(94 a run)",
        "table 6,785 + 0 + 1,694 (about 8,510)",
    ):
        assert words in caption, words
    compared, equal = re.search(r"Compared were (\d+) .* of which (\d+) are", caption).groups()
    assert int(compared) == int(equal) + 1, "but for the images"
    assert "are the same" not in caption


def other(value):
    """Another value of the same kind."""
    match value:
        case None:
            return 7
        case bool():
            return not value
        case int() | float():
            return 2 * value + 1
        case list():
            return [2 * x for x in value]
    return f"another-{value}"


@pytest.mark.parametrize("key", paper_settings().settings)
def test_each_setting_that_is_not_the_papers_is_listed(make, key):
    told = differences(
        make((0.05, 0.4, 0.7), settings={key: other(paper_settings().settings[key])})
    )
    assert len(told) == 1
    assert told[0].startswith(f"{key} is ")
    assert "(paper: " in told[0]


@pytest.mark.parametrize("regime", "bwer")
def test_each_setting_of_a_regime_that_is_not_the_papers_is_listed(make, regime):
    for seed, (key, value) in enumerate(paper_settings().regimes[regime].items()):
        run = make(
            (0.05, 0.4, 0.7), "table", regime, seed=seed, settings={f"regime.{key}": other(value)}
        )
        told = differences(run)
        assert len(told) == 1, told
        assert told[0].startswith(f"regime {regime}: {key} is ")


def test_runs_that_differ_from_each_other_are_told_together(make):
    first = make((0.05, 0.4, 0.7), settings={})
    second = make((0.05, 0.4, 0.7), regime="e", settings={"schedule.steps": 900})
    assert differences(first, second) == ["schedule.steps is 100000 or 900 (paper: 100000)"]


def test_a_regime_that_the_paper_does_not_have(make):
    run = make((0.05, 0.4, 0.7), settings={"regime.name": "mine"})
    (told,) = differences(run)
    assert told.startswith("regime mine is min_weight=0.1, selection.name=weighted, ")
    assert told.endswith("(paper: none of this name)")


def test_settings_are_read_whatever_wrote_them(make):
    run = make((0.05, 0.4, 0.7), settings={})
    config = OmegaConf.load(run.config)
    config.schedule.annealing_steps = 10_000.0
    config.encoder.weights = f"/somewhere/{config.encoder.weights}"
    del config["network"]["batch_norm_momentum"]
    OmegaConf.save(config, run.config)
    assert differences(run) == ["network.batch_norm_momentum is not set (paper: 0.01)"]


def test_templates_are_compared_by_their_ids_not_by_how_they_were_chosen(make):
    ids = paper_templates("table")
    same = make(
        (0.05, 0.4, 0.7),
        settings={"template_strategy.name": "listed"},
        data={"templates": ids[::-1]},
    )
    assert differences(same) == []
    fewer = make(
        (0.05, 0.4, 0.7), regime="w", settings={}, data={"templates": [*ids[:28], "x", "y"]}
    )
    assert differences(same, fewer) == [
        "the templates are not the paper's 30 (table 30, of which 28 are the paper's)"
    ]


def test_results_of_validation_shapes_are_not_taken_for_results(make):
    good, searched = make((0.05, 0.4, 0.7)), make((0.01, 0.1, 0.9), seed=1)
    place = searched.evaluation("paper")
    place.rename(searched.path / "val")
    shutil.move(searched.path / "val", searched.evaluation("paper", "val"))
    searched.set_status("finished", summary={"chamfer": 0.01, "emd": 0.1, "iou": 0.9})
    table = comparison_table(load_runs([good, searched]))
    assert numbers(table, "ours", "b", "table")[0] == pytest.approx(50)
    with pytest.raises(DataError, match="no finished run"):
        comparison_table(load_runs([searched]))


def test_what_a_terminal_shows(make):
    runs = load_runs([make((0.0504, 0.4, 0.7)), make((0.05, 0.4, 0.7), "a_[b]")])
    table = comparison_table(runs)
    head, rows = stacked(table)
    assert head == ["category", "", "b", "w", "e", "r", "PSGN"]
    assert rows[0] == ["table", "ours", "50/400/300", "-", "-", "-", "-"]
    assert rows[1][:4] == ["", "paper", "47/352/447", "46/331/432"]
    assert rows[2] == ["a_[b]", "ours", "50/400/300", "-", "-", "-", "-"]
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(to_console(table))
    shown = console.export_text()
    assert "a_[b]" in shown
    assert "- schedule.steps is 300 (paper: 100000)" in shown
    assert table.attrs["compared"] in shown
    table.attrs.clear()
    with pytest.raises(DataError, match="lost its caption"):
        to_console(table)


def test_latex(make):
    runs = load_runs([make((0.05, 0.4, 0.7)), make((0.05, 0.4, 0.7), "100%_a&b#")])
    text = latex(comparison_table(runs))
    rows = text.split(r"\midrule")[1].split(r"\bottomrule")[0].strip().splitlines()
    assert rows[0].startswith("table & 50/400/300 & 47/352/447 & ")
    assert rows[1].startswith(r"100\%\_a\&b\# & 50/400/300 & - & ")
    assert r"32\textasciicircum{}3 voxels" in text.split(r"\caption")[1]


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
