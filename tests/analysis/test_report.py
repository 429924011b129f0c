import base64
import csv
import io
import json
import re
import shutil
import time
from collections import Counter
from contextlib import contextmanager
from functools import partial
from html.parser import HTMLParser
from statistics import mean, stdev

import numpy as np
import pandas as pd
import pytest
from PIL import Image
from rich.console import Console
from scipy.spatial import cKDTree

from ffd_lightning.analysis.compare import aggregate_seeds, compare_runs
from ffd_lightning.analysis.paper import beside_paper
from ffd_lightning.analysis.plot_layout import series_of
from ffd_lightning.analysis.plots import template_count_curves
from ffd_lightning.analysis.report import page as page_module
from ffd_lightning.analysis.report.gallery import (
    DEFORMED,
    choose_images,
    choose_runs,
    fit_of,
    read_input,
    reconstruct,
    still,
)
from ffd_lightning.analysis.report.meshes import lighten, pack, size
from ffd_lightning.analysis.report.page import write_report
from ffd_lightning.analysis.report.selection import bars
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.runs import load_runs, load_samples
from ffd_lightning.analysis.selection import selection_stability
from ffd_lightning.analysis.tables import summary_tables
from ffd_lightning.app.build import build_data, build_network
from ffd_lightning.app.commands import report
from ffd_lightning.app.open_run import open_run
from ffd_lightning.app.settings import read_settings
from ffd_lightning.app.training_run import train
from ffd_lightning.checkpoint import load_weights
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.candidates import TemplateShape
from ffd_lightning.evaluation.protocols import (
    Metric,
    PaperProtocol,
    ProtocolDescription,
)
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.run_folder import RunFolder

EVIL = "<script>alert('x')</script>&"
MEASURES = ("chamfer", "emd", "iou")
PAPER = ProtocolDescription.of(PaperProtocol())
CHAMFER, IOU = Metric("chamfer", ""), Metric("iou", "", higher_is_better=True)


def make_run(
    folder, regime="b", templates=4, seed=0, protocol=PAPER, count=8, retrieved=(), **columns
):
    """Write a finished run by hand, without a checkpoint; columns are functions of the row."""
    run = RunFolder(folder)
    run.path.mkdir(parents=True)
    run.config.write_text(
        f"category: {{name: table}}\nregime: {{name: {regime}, min_weight: 0.{len(regime)}}}\n"
        f"templates: {{count: {templates}}}\nseed: {seed}\ntrainer: {{devices: {seed}}}\n"
    )
    rng = np.random.default_rng([ord(regime[0]), templates, seed])
    rows = [
        {"id": f"m{k}", "category": "table", "family": "", "view": 0, "template": f"t{k % 3}"}
        | {"weight": 0.5}
        | {f"{p}{m}": float(rng.random()) for p in ("", "undeformed_", "floor_") for m in MEASURES}
        | {f"feature_retrieval_{m}": 2 + float(rng.random()) for m in retrieved}
        for k in range(count)
    ]
    for k, row in enumerate(rows):
        row |= {name: value(k) for name, value in columns.items()}
    path = run.evaluation(protocol.name) / "samples.csv"
    path.parent.mkdir(parents=True)
    (path.parent / "summary.json").write_text(json.dumps({"protocol": protocol.to_json()}))
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0])
        writer.writeheader()
        writer.writerows(rows)
    run.set_status("finished")
    return run


def read_rows(run, protocol="paper"):
    with (run.evaluation(protocol) / "samples.csv").open() as file:
        return list(csv.DictReader(file))


class Page(HTMLParser):
    """What a page holds: text, attributes, tables; and whether its tags are nested well."""

    VOID = frozenset(("meta", "link", "img", "br", "wbr"))

    def __init__(self, path):
        super().__init__()
        self.open, self.attributes, self.tables, self.said = [], [], [], []
        self.tags = Counter()
        self.feed(path.read_text(encoding="utf-8"))
        assert self.open == [], "all tags are closed"

    def handle_starttag(self, tag, attrs):
        self.tags[tag] += 1
        self.attributes += [(tag, *pair) for pair in attrs]
        if tag not in self.VOID:
            self.open.append(tag)
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.tables[-1][-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes another"

    def handle_data(self, data):
        if not {"script", "style"} & set(self.open):
            self.said.append(data)
        if {"td", "th"} & set(self.open[-2:]):
            self.tables[-1][-1][-1] += data

    @property
    def text(self):
        return " ".join(" ".join(self.said).split()).replace(" ,", ",")


def number_in(cell):
    """The first number of a cell: its value, before a mark and an interval."""
    return float(re.match(r"-?[\d.]+", cell)[0])


def two_regimes(folder):
    return [make_run(folder / regime, regime) for regime in "wb"]


@pytest.fixture
def blank(monkeypatch):
    """Do not draw figures, which takes most of the time: for tests of the words."""
    monkeypatch.setattr(page_module.plots, "to_svg", lambda figure: b"<svg/>")


@pytest.fixture
def sweep(tmp_path, blank):
    """Two regimes, finished, to be changed."""
    return two_regimes(tmp_path)


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """Two regimes, finished, and the path of their report."""
    folder = tmp_path_factory.mktemp("written")
    return two_regimes(folder), write_report(folder, open_run)


def table_of(page, heading):
    """The first table with a column of this name."""
    return next(table for table in page.tables if any(heading in cell for cell in table[0]))


def test_the_table_holds_the_means_in_the_paper_s_order(written):
    sweep, path = written
    page = Page(path)
    rows = table_of(page, "undeformed Chamfer")[1:]
    assert [row[0] for row in rows] == ["b, base", "w, log-weighted"]
    for row, run in zip(rows, sweep[::-1], strict=True):
        for cell, name in zip(row[1:5], (*MEASURES, "undeformed_chamfer"), strict=True):
            expected = mean(1000 * float(r[name]) for r in read_rows(run))
            assert number_in(cell) == pytest.approx(expected, rel=0.01)
    floor = next(row for table in page.tables for row in table if row[0] == "floor")
    floors = [float(r["floor_emd"]) for run in sweep for r in read_rows(run)]
    low, high = (float(x) for x in floor[2].split("\u2013"))
    assert low <= 1000 * mean(floors) <= high, "runs have floors of their own here"


def test_seeds_become_a_mean_and_a_deviation(tmp_path, blank):
    runs = [make_run(tmp_path / str(seed), seed=seed) for seed in range(3)]
    page = Page(write_report(tmp_path, open_run))
    head, row = table_of(page, "undeformed Chamfer")
    assert (row[:2], head[1]) == (["b, base", "3"], "seeds")
    means = [mean(1000 * float(r["chamfer"]) for r in read_rows(run)) for run in runs]
    shown = [number_in(number) for number in row[2].split(" ± ")]
    assert shown == pytest.approx([mean(means), stdev(means)], rel=0.01)
    assert "Agreement of seeds" in page.text


def test_only_runs_that_differ_in_nothing_but_their_seed_are_averaged(tmp_path, blank):
    runs = []
    for seed, steps in enumerate((300, 60_000, 60_000)):
        run = make_run(tmp_path / f"seed{seed}_steps-{steps}", seed=seed)
        run.config.write_text(f"{run.config.read_text()}schedule: {{steps: {steps}}}\n")
        runs.append(run)
    head, *rows = table_of(Page(write_report(tmp_path, open_run)), "undeformed Chamfer")
    assert [row[:2] for row in rows[:2]] == [["steps-300", "1"], ["steps-60000", "2"]]
    of_run = [mean(1000 * float(r["chamfer"]) for r in read_rows(run)) for run in runs]
    for row, expected in zip(rows, (of_run[0], mean(of_run[1:])), strict=False):
        assert number_in(row[head.index("Chamfer ↓ x 1000")]) == pytest.approx(expected, rel=0.01)
    table, samples = load_runs(runs, "paper"), load_samples(runs)
    table = table.assign(chamfer=of_run, emd=1.0, iou=0.5)
    other = table.iloc[1:].assign(templates=8)
    other["chamfer"] = of_run[1:]
    for average in (
        lambda: aggregate_seeds(table, ["chamfer"]),
        lambda: beside_paper(table),
        lambda: selection_stability(samples),
        lambda: compare_runs(samples.assign(half=samples["seed"] // 2), PAPER, "chamfer", "half"),
        lambda: template_count_curves(pd.concat([table, other]), PAPER),
    ):
        with pytest.raises(DataError, match=r"seed0\S* and \S*seed1\S* differ in schedule\.steps"):
            average()
    assert aggregate_seeds(table[1:], ["chamfer"])["chamfer"].tolist() == [mean(of_run[1:])]
    series, colors = series_of(samples)
    assert len(colors) == series["series"].nunique() == 3
    buffer = io.StringIO()
    Console(file=buffer, width=300).print(*summary_tables(runs))
    assert "seed0_steps-300" in buffer.getvalue()


# --- which is best -------------------------------------------------------------------------------


def scores_of(**shifts):
    """Columns of scores: the same shapes, shifted by a constant for each measure."""
    return {m: lambda k, s=s: 0.3 + s + 0.01 * (k % 7) * (1 + s) for m, s in shifts.items()}


def regimes(folder, seeds=(0,), **shifts):
    """Runs of regimes whose scores are shifted against each other."""
    for regime, shift in shifts.items():
        for seed in seeds:
            columns = scores_of(chamfer=shift, emd=shift, iou=-shift)
            make_run(folder / f"{regime}{seed}", regime, seed=seed, count=12, **columns)
    return Page(write_report(folder, open_run)).text


def test_the_page_opens_with_who_is_best_and_whether_it_is_shown(tmp_path, blank):
    text = regimes(tmp_path / "one", b=0.05, w=0.0, posterior=0.1)
    assert "Best Chamfer, EMD and IoU: w, log-weighted. Shown on these test shapes: 3 of 3" in text
    assert "shown for these trained networks" in text
    text = regimes(tmp_path / "two", (0, 1), b=0.05, w=0.0)
    assert "shown, and all pairs of seeds agree" in text
    assert "One training each" not in text


def test_the_marked_best_is_the_best_of_the_samples(tmp_path, blank):
    runs = {r: make_run(tmp_path / r, r, count=12, folded=lambda k: 0.1) for r in "bwer"}
    page = Page(write_report(tmp_path, open_run))
    by_regime = {row[0][0]: row for row in table_of(page, "undeformed Chamfer")[1:]}
    names = [*MEASURES, "undeformed_chamfer"]
    for place, name in enumerate(names, start=1):
        means = {r: mean(float(x[name]) for x in read_rows(run)) for r, run in runs.items()}
        best = (max if name == "iou" else min)(means, key=means.get)
        assert {r for r, row in by_regime.items() if "▲" in row[place]} == {best}, name
    folded = table_of(page, "folded %")
    assert not any("▲" in cell for row in folded for cell in row), "folded alike, none is best"


def test_categories_have_each_their_best_and_the_mean_speaks_for_all(tmp_path, blank):
    for category in ("table", "chair"):
        for regime, shift in (("b", 0.05), ("e", 0.0)):
            columns = scores_of(chamfer=shift, emd=shift, iou=shift)
            run = make_run(tmp_path / category / regime, regime, count=12, **columns)
            run.config.write_text(
                run.config.read_text().replace("name: table", f"name: {category}")
            )
            file = run.evaluation("paper") / "samples.csv"
            pd.read_csv(file).assign(category=category).to_csv(file, index=False)
    page = Page(write_report(tmp_path, open_run))
    assert "Best Chamfer and EMD: e, entropy. Best IoU: b, base." in page.text
    rows = [row for row in page.tables[0][1:] if row[0] == "Chamfer x 1000"]
    assert [(row[1], row[6]) for row in rows] == [
        *(("mean of 2", "24"), ("chair", "12"), ("table", "12"))
    ]
    assert all(row[2] == "e, entropy: 325.8" and row[5].startswith("shown") for row in rows)


# --- templates -----------------------------------------------------------------------------------


def test_shares_of_templates_add_up_in_one_order(tmp_path, blank):
    make_run(tmp_path / "b", count=9, template=lambda k: f"t{k % 3}")
    make_run(tmp_path / "w", "w", count=9, template=lambda k: "t2" if k else "t0")
    make_run(tmp_path / "e", "e", templates=40, count=80, template=lambda k: f"x{k % 40}")
    (group,) = bars(Results.read(tmp_path))["categories"]
    orders = {tuple(name for name, _ in setting["bars"]) for setting in group["settings"]}
    (order,) = orders
    assert order[:2] == ("t2", "t0"), "the most selected first"
    assert order[-1] == "others"
    for setting in group["settings"]:
        assert sum(share for _, share in setting["bars"]) == pytest.approx(1)
    assert group["settings"][2]["effective"] == "40.0 of 40"


def test_the_page_needs_nothing_from_elsewhere(written):
    _, path = written
    page, text = Page(path), path.read_text()
    links = [v for _, k, v in page.attributes if k in ("src", "href", "srcset", "action", "poster")]
    assert links
    assert all(link.startswith(("data:", "#")) for link in links)
    assert not re.search(r"@import|url\((?!data:)|fetch\(|XMLHttpRequest|import\(", text)
    policy = dict((t, v) for t, k, v in page.attributes if k == "content")["meta"]
    assert "default-src" in text
    assert policy
    assert not [k for _, k, _ in page.attributes if k.startswith("on")], "no inline handlers"
    anchors = [v[1:] for _, k, v in page.attributes if k == "href" and v.startswith("#")]
    ids = [v for _, k, v in page.attributes if k == "id"]
    assert set(anchors) <= set(ids)
    assert len(ids) == len(set(ids))


def test_pictures_say_what_they_show(written):
    sweep, path = written
    page = Page(path)
    alts = [v for t, k, v in page.attributes if (t, k) == ("img", "alt")]
    assert len(alts) == page.tags["img"] == 2
    medians = sorted(1000 * float(r["chamfer"]) for r in read_rows(sweep[0]))[3:5]
    assert f"w {mean(medians):.1f}" in alts[0]
    assert [t for t, k, _ in page.attributes if k == "lang"] == ["html"]
    assert page.tags["h1"] == 1


def test_what_comes_from_outside_is_escaped(tmp_path, blank):
    run = make_run(tmp_path / "a<b>&c")
    text = (run.evaluation("paper") / "samples.csv").read_text()
    (run.evaluation("paper") / "samples.csv").write_text(text.replace("t1", EVIL))
    make_run(tmp_path / "failed", seed=1).set_status("failed", reason=EVIL)
    (tmp_path / "study.yaml").write_text(
        json.dumps({"study": EVIL, "question": EVIL, "command": EVIL})
    )
    path = write_report(tmp_path, open_run)
    assert EVIL not in path.read_text()
    page = Page(path)
    assert page.text.count(EVIL) == 6, "title twice, question, command, reason, a template"
    assert page.tags["script"] == 2


def test_the_same_runs_give_the_same_bytes(written):
    first = written[1].read_bytes()
    assert write_report(written[1].parent, open_run).read_bytes() == first


def damage(run):
    (run.evaluation("paper") / "samples.csv").write_text("")


def spoil(run):
    file = run.evaluation("paper") / "samples.csv"
    rows = file.read_text().splitlines()
    file.write_text("\n".join([rows[0], rows[1].replace("0.", "x")]))


ODD = {
    "failed": (lambda run: run.set_status("failed", reason="disk full"), "failed", "disk full"),
    "killed": (lambda run: run.set_status("running"), "interrupted", "begun and is not finished"),
    "new": (lambda run: (run.path / "status.json").unlink(), "interrupted", "is not finished"),
    "none": (lambda run: shutil.rmtree(run.path / "evaluation"), "finished", "no evaluation"),
    "modern": (
        lambda run: run.evaluation("paper").rename(run.evaluation("modern")),
        "finished",
        "under protocol modern only: ffd evaluate run=",
    ),
    "empty": (damage, "finished", "samples.csv is damaged"),
    "words": (spoil, "finished", "chamfer is not a finite number"),
    "no yaml": (lambda run: run.config.write_text("{{"), "damaged", "config.yaml is damaged"),
    "unnamed": (lambda run: run.config.write_text("seed: 1"), "damaged", "names no category"),
}


def test_runs_without_results_are_told_and_break_nothing(sweep, tmp_path):
    for seed, (name, (change, _, _)) in enumerate(ODD.items()):
        change(make_run(tmp_path / name, "e", seed=seed))
    busy = make_run(tmp_path / "busy", "e", seed=len(ODD))
    busy.set_status("running")
    with busy.lock():
        page = Page(write_report(tmp_path, open_run))
    found = {row[0]: row[1:] for row in page.tables[-1][1:]}
    assert set(found) == {*ODD, "busy"}
    for name, (_, state, reason) in ODD.items():
        assert found[name][0] == state, name
        assert reason in found[name][1], name
    assert found["busy"][0] == "running"
    assert "it is at work" in found["busy"][1]
    assert [row[0][:1] for row in table_of(page, "undeformed Chamfer")[1:3]] == ["b", "w"]
    for words in ("2 damaged, 1 failed, 6 finished, 2 interrupted, 1 running", "10 more runs have"):
        assert words in page.text


@pytest.mark.parametrize("evaluated", [True, False])
def test_a_sweep_without_any_result(tmp_path, evaluated):
    run = make_run(tmp_path / "a")
    run.set_status("failed", reason="no memory")
    if not evaluated:
        shutil.rmtree(run.path / "evaluation")
    page = Page(write_report(tmp_path, open_run))
    assert "No run has results yet" in page.text
    assert "no memory" in page.text


def test_a_damaged_file_leaves_the_other_runs_their_tables(sweep):
    (sweep[0].evaluation("paper") / "samples.csv").write_text("")
    buffer = io.StringIO()
    for table in summary_tables(sweep):
        Console(file=buffer, width=400).print(table)
    (line,) = [line for line in buffer.getvalue().splitlines() if "damaged" in line]
    assert f"{sweep[0].evaluation('paper')}/samples.csv is damaged" in line
    assert "ffd evaluate run=" in line
    assert "Scores, protocol paper" in buffer.getvalue()


def test_results_of_one_name_that_were_measured_otherwise_are_not_mixed(sweep, tmp_path):
    for run, format_version in zip(sweep, (5, 6), strict=True):
        content = {"protocol": PAPER.to_json(), "settings": {"format": format_version}}
        (run.evaluation("paper") / "summary.json").write_text(json.dumps(content))
    for read in (load_samples, partial(load_runs, protocol="paper")):
        with pytest.raises(DataError, match="evaluated in another way under protocol paper"):
            read(sweep)
    page = Page(write_report(tmp_path, open_run))
    assert "evaluated under another protocol of this name" in page.text


def test_the_protocol_is_that_of_most_runs_unless_it_is_named(tmp_path, blank):
    warmth, weight = Metric("warmth", "of the shape", True, 1.0), Metric("weight_of", "grams")
    own = ProtocolDescription("own", "a protocol that is not installed here", (warmth, weight))
    for regime in "bwe":
        run = make_run(tmp_path / regime, regime, protocol=own)
        file = run.evaluation("own") / "samples.csv"
        pd.read_csv(file).assign(warmth=20.5, weight_of=0.3).to_csv(file, index=False)
    make_run(tmp_path / "r", "r")
    page = Page(write_report(tmp_path, open_run))
    assert "a protocol that is not installed here." in page.text
    head, row, *_ = table_of(page, "effective")
    assert head[:3] == ["regime", "warmth ↑", "weight_of ↓ x 1000"]
    assert [row[0], *map(number_in, row[1:3])] == ["b, base", 20.5, 300]
    page = Page(write_report(tmp_path, open_run, "paper"))
    assert [row[0] for row in table_of(page, "effective")[1:]] == ["r, regularized"]
    assert "3 more runs have no results" in page.text


def test_another_protocol_of_the_same_name_is_told_apart(sweep, tmp_path):
    file = make_run(tmp_path / "few", "e").evaluation("paper") / "summary.json"
    few = ProtocolDescription.of(PaperProtocol(points=64))
    file.write_text(json.dumps({"protocol": few.to_json()}))
    page = Page(write_report(tmp_path, open_run))
    assert [row[0][:1] for row in table_of(page, "effective")[1:3]] == ["b", "w"]
    assert "evaluated under another protocol of this name" in page.text


def test_settings_that_differ_are_told_but_not_those_of_the_machine(sweep, tmp_path):
    make_run(tmp_path / "e2", "e", seed=2)
    page = Page(write_report(tmp_path, open_run))
    table = page.tables[-1]
    assert sorted(table[0]) == ["regime.name", "run", "seed"]
    assert "templates.count=4" in page.text
    assert "regime.min_weight=0.1" in page.text
    assert "devices" not in page.text


def test_every_pair_of_settings_is_compared(tmp_path):
    for regime in "be":
        for templates in (4, 8):
            make_run(tmp_path / f"{regime}{templates}", regime, templates, count=12)
    page = Page(write_report(tmp_path, open_run))
    assert len(table_of(page, "pair")) == 1 + 6
    alts = [v for t, k, v in page.attributes if (t, k) == ("img", "alt")]
    assert "Chamfer against T" in alts


def test_one_setting_is_held_against_what_it_retrieves(tmp_path, blank):
    make_run(tmp_path / "b", count=12, retrieved=MEASURES)
    text = Page(write_report(tmp_path, open_run)).text
    assert "Best Chamfer and EMD: the network. Best IoU: what its encoder retrieves." in text


def test_the_study_s_question_is_asked(sweep, tmp_path):
    (tmp_path / "study.yaml").write_text("study: Entropy\nquestion: Does it help?\ncommand: make\n")
    page = Page(write_report(tmp_path, open_run))
    for words in ("Entropy", "Does it help?", "make"):
        assert words in page.text
    (tmp_path / "study.yaml").write_text("study: [")
    with pytest.raises(ConfigError, match=r"study.yaml cannot be read .*: mend or remove it"):
        write_report(tmp_path, open_run)


def test_results_beside_the_papers(tiny_run, sweep, tmp_path):
    page = Page(write_report(tmp_path, open_run))
    assert "Beside the paper" not in page.text, "where the study does not ask for it"
    (tmp_path / "study.yaml").write_text("beside_paper: true\n")
    page = Page(write_report(tmp_path, open_run))
    assert "There is nothing to set beside the paper's Table 3: " in page.text
    shutil.copytree(tiny_run.path, tmp_path / "runs" / "one")
    (tmp_path / "runs" / "study.yaml").write_text("beside_paper: true\n")
    page = Page(write_report(tmp_path / "runs", open_run))
    table = table_of(page, "PSGN")
    assert table[0] == ["category", "", "b", "w", "e", "r", "PSGN"]
    assert table[1][:2] == ["table", "ours"]
    assert re.fullmatch(r"\d+/\d+/\d+", table[1][5])
    assert table[2][:3] == ["", "paper", "47/352/447"]
    assert "schedule.steps: 8 (paper: 100000)" in page.text


def test_the_command(sweep, tmp_path, capsys):
    def run(*arguments):
        return report.main(read_settings(report.Settings, arguments, report.MAIN))

    assert run(str(tmp_path), "protocol=paper", "gallery=0") == 0
    assert capsys.readouterr().out == f"{tmp_path / 'report.html'}\n"
    assert "Examples" not in Page(tmp_path / "report.html").text
    for arguments, error, message in (
        ([f"runs={tmp_path / 'no'}"], DataError, "holds no run that can be read"),
        ([str(tmp_path), "protocol=papre"], ConfigError, "choose one of paper"),
        ([str(tmp_path), "protocl=paper"], ConfigError, "Did you mean protocol"),
        ([str(tmp_path), "gallery=all"], ConfigError, "gallery=all must be a whole number"),
        ([str(tmp_path), "gallery=-1"], ConfigError, "gallery=-1"),
        ([str(tmp_path), str(tmp_path)], ConfigError, "is no setting"),
    ):
        with pytest.raises(error, match=message):
            run(*arguments)
    (tmp_path / "report.html").unlink()
    (tmp_path / "report.html").mkdir()
    with pytest.raises(DataError, match="cannot write"):
        run(str(tmp_path), "gallery=0")


# --- examples ------------------------------------------------------------------------------------


def table(values, name="chamfer"):
    return pd.DataFrame({"id": [f"m{k}" for k in range(len(values))], "view": 0, name: values})


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([5, 1, 4, 2, 3], ["m1", "m4", "m0"]),
        ([5, 1, 4, 2], ["m1", "m3", "m0"]),
        ([2, 2, 2], ["m0", "m1", "m2"]),
        ([2, 1], ["m1", "m0"]),
        ([2], ["m0"]),
    ],
)
def test_best_median_and_worst(values, expected):
    chosen = choose_images(table(values).assign(run="a"), CHAMFER)
    assert [image["id"] for image in chosen.values()] == expected
    chosen = choose_images(table([-v for v in values], "iou").assign(run="a"), IOU)
    assert [image["id"] for image in chosen.values()] == expected
    assert next(iter(chosen)) == "best"


def test_images_are_chosen_by_all_runs_together():
    runs = [table([1, 2, 3, 9, 5.0]), table([1, 2, 9, 3, 5.1]), table([1, 3, 2, 8])]
    samples = pd.concat(part.assign(run=str(k)) for k, part in enumerate(runs))
    chosen = {rank: image["id"] for rank, image in choose_images(samples, CHAMFER).items()}
    assert chosen == {
        "best": "m0", "median": "m1", "worst": "m3", "where runs differ most": "m2"
    }  # fmt: skip
    assert list(choose_images(samples, CHAMFER, 1)) == ["median"]
    assert (
        choose_images(
            pd.concat([runs[0].assign(run="a"), table([1]).assign(id="x", run="b")]), CHAMFER
        )
        == {}
    )


def test_of_many_runs_some_are_shown():
    names = [f"{c:02}/{r}/{s}" for c in range(13) for r in "bwer" for s in (0, 1)]
    runs = pd.DataFrame({"run": names, "templates": 30})
    runs["category"], runs["regime"] = zip(*(n.split("/")[:2] for n in names), strict=True)
    chosen = choose_runs(runs, 12)
    assert len(chosen) == len(set(chosen)) == 12
    assert (chosen[0], chosen[-1]) == ("00/b/0", "12/r/0")
    assert all(name.endswith("/0") for name in chosen), "the first seed of each setting"
    assert choose_runs(runs[:8], 12) == ["00/b/0", "00/w/0", "00/e/0", "00/r/0"]


def sphere(divisions=70):
    """A sphere of radius 0.5, as a soup: each face has vertices of its own."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, divisions), np.linspace(0, np.pi, divisions))
    places = 0.5 * np.stack([np.sin(v) * np.cos(u), np.cos(v), np.sin(v) * np.sin(u)], -1)
    a, b, c, d = (
        places[i : divisions - 1 + i, j : divisions - 1 + j].reshape(-1, 3)
        for i, j in ((0, 0), (0, 1), (1, 0), (1, 1))
    )
    corners = np.concatenate([np.stack([a, b, c], 1), np.stack([b, d, c], 1)])
    return corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3)


@pytest.mark.parametrize(("limit", "lost"), [(60_000, 0.01), (8_000, 0.06), (3_000, 0.2)])
def test_meshes_become_small_and_keep_their_shape(limit, lost):
    vertices, faces = sphere()
    assert size(vertices, faces) > 200_000
    small, small_faces = lighten(vertices, faces, limit)
    assert limit / 6 < size(small, small_faces) <= limit, "no smaller than need be"
    a, b, c = (small[small_faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert (1 - lost) * np.pi < area < np.pi
    radius = np.linalg.norm(small, axis=1)
    assert (1 - lost) * 0.5 < radius.min() < radius.max() < 0.5001


def test_a_small_mesh_only_loses_what_is_double():
    vertices, faces = sphere(12)
    small, small_faces = lighten(vertices, faces)
    distance, _ = cKDTree(small).query(vertices)
    assert distance.max() < 1e-4
    assert len(small) == len(np.unique(np.round(vertices, 4), axis=0)) < len(vertices)
    twice = np.concatenate([faces, faces[:, ::-1]])
    assert len(lighten(vertices, twice)[1]) == len(small_faces)


def test_a_packed_mesh_is_read_back():
    vertices, faces = sphere(12)
    vertices, faces = lighten(vertices + [0.1, 0, 3], faces)
    packed = pack(vertices, faces).as_json()
    places = np.frombuffer(base64.b64decode(packed["vertices"]), "<i2").reshape(-1, 3)
    corners = np.frombuffer(base64.b64decode(packed["faces"]), "<u2").reshape(-1, 3)
    np.testing.assert_allclose(places / 32767 * packed["scale"], vertices, atol=3.5 / 65534)
    np.testing.assert_array_equal(corners, faces)


@pytest.fixture(scope="module")
def trained(tiny_config, tmp_path_factory):
    """A tiny run of 2 steps in a folder of its own, its configuration and the report's path."""
    folder = tmp_path_factory.mktemp("sweep")
    cfg = tiny_config("regime=e", "schedule.steps=2", "protocol.points=64")
    train(cfg, RunFolder(folder / "run"))
    return folder, cfg, write_report(folder, open_run)


def test_examples_are_the_network_s_own(trained):
    folder, cfg, _ = trained
    run = RunFolder(folder / "run")
    opened = open_run(run)
    samples = load_samples([run], "paper-points-64")
    order = sorted(read_rows(run, "paper-points-64"), key=lambda row: float(row["chamfer"]))
    expected = [order[0], order[(len(order) - 1) // 2], order[-1]]
    chosen = choose_images(samples, CHAMFER)
    assert [image["id"] for image in chosen.values()] == [row["id"] for row in expected]
    rows = [samples[samples["id"] == image["id"]].iloc[0] for image in chosen.values()]
    data = build_data(cfg)
    data.setup()
    network = build_network(cfg)
    load_weights(network, run.checkpoint)
    for output, row in zip(reconstruct(opened, rows), expected, strict=True):
        place, t = data.prepared.index(row["id"]), data.bank.ids.index(row["template"])
        seen = read_input(opened, row)
        shown = np.asarray(Image.open(io.BytesIO(seen.image)).convert("RGB"), int)
        assert np.abs(shown - data.prepared.image(place)[..., :3]).mean() < 3, "128 colours"
        offsets = predict(network, data.prepared, [Sample(place)]).offsets[0, t]
        dense, _ = TemplateShape(data.bank, t, offsets).mesh()
        truth = data.prepared.mesh(place)
        for packed, points in ((output.deformed, dense), (seen.truth, truth.vertices)):
            places = packed.vertices / 32767 * packed.scale
            assert cKDTree(points).query(places)[0].max() < 0.02, "the edge length of evaluation"
            used = points[np.unique(truth.faces)] if points is truth.vertices else points
            np.testing.assert_allclose(np.ptp(places, axis=0), np.ptp(used, axis=0), atol=5e-3)


def test_the_page_shows_them(trained):
    folder, _, path = trained
    page, text = Page(path), path.read_text()
    assert page.tags["canvas"] == 6, "three images: the network, and what is true"
    meshes = json.loads(re.search(r'id="meshes">(.*?)</script>', text, re.S)[1])
    assert {v for t, k, v in page.attributes if k == "data-mesh"} == set(meshes)
    row = read_rows(RunFolder(folder / "run"), "paper-points-64")[0]
    assert row["template"] in page.text, "named where its picture stands"
    assert page.tags["use"] > 3
    assert len(text) < 1_000_000
    assert write_report(folder, open_run).read_text() == text


def test_each_canvas_lies_over_a_still_of_the_same_mesh(trained):
    text = trained[2].read_text()
    stages = re.findall(r'<div class="stage"><img src="([^"]+)" alt="([^"]+)">\s*<canvas', text)
    assert len(stages) == text.count("<canvas") == 6
    for source, described in stages:
        assert described
        image = Image.open(io.BytesIO(base64.b64decode(source.partition(",")[2]))).convert("RGBA")
        shown = np.asarray(image)[..., 3] > 127
        assert 0.02 < shown.mean() < 0.9


def test_a_still_is_the_mesh_in_its_color_and_never_cut_off():
    vertices, faces = sphere(24)
    mesh = pack(*lighten(3 * vertices, faces))
    assert fit_of([mesh, pack(*lighten(vertices, faces))]) == pytest.approx(1 / 3, rel=1e-3)
    assert fit_of([pack(*lighten(0.5 * vertices, faces))]) == 1
    image = Image.open(io.BytesIO(still(mesh, DEFORMED, Camera(), fit_of([mesh])))).convert("RGBA")
    pixels = np.asarray(image).astype(int)
    shown = pixels[..., 3] > 127
    assert shown.any(0).sum() == pytest.approx(shown.any(1).sum(), abs=2), "it is round"
    assert shown.any(1).sum() == pytest.approx(len(pixels), abs=8), "and as high as the picture"
    red, green, blue = (pixels[..., k][shown].mean() for k in range(3))
    assert red < green < blue


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda run: shutil.rmtree(run.path / "checkpoints"), "there is no checkpoint"),
        (lambda run: run.checkpoint.write_bytes(b"x"), "damaged or no checkpoint"),
        (
            lambda run: run.config.write_text(run.config.read_text().replace("hidden: 32", "q: 3")),
            "config.yaml cannot be used here: no setting",
        ),
    ],
)
def test_why_there_are_no_examples(trained, tmp_path, change, reason, blank):
    shutil.copytree(trained[0], tmp_path / "copy")
    change(RunFolder(tmp_path / "copy" / "run"))
    page = Page(write_report(tmp_path / "copy", open_run))
    assert reason in page.text
    assert page.tags["canvas"] == 0


def test_a_report_prepares_no_data(trained, tmp_path, blank):
    shutil.copytree(trained[0], tmp_path / "c")
    report.main(report.Settings(str(tmp_path / "c"), data_root=str(tmp_path / "d")))
    assert "data_root=DIR names the folder" in Page(tmp_path / "c" / "report.html").text
    assert not (tmp_path / "d").exists()


def test_samples_of_other_weights_are_noticed(trained, tmp_path, blank):
    run = RunFolder(shutil.copytree(trained[0], tmp_path / "copy") / "run")
    file = run.evaluation("paper-points-64") / "samples.csv"
    table = pd.read_csv(file)
    table["template"] = [sorted(set(read_ranking(run)) - {t})[0] for t in table["template"]]
    table.to_csv(file, index=False)
    assert "evaluate the run again" in Page(write_report(tmp_path / "copy", open_run)).text


def read_ranking(run):
    with (run.path / "template_ranking.csv").open() as file:
        return [row["id"] for row in csv.DictReader(file)]


# --- in a browser --------------------------------------------------------------------------------


class Browser:
    """A page in Chromium without a window; what it asks for and complains of is kept."""

    def __init__(self, page):
        self._page, self._tools = page, page.context.new_cdp_session(page)
        self.complaints, self.requests = [], []
        page.on("console", lambda message: self.complaints.append(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))

    def call(self, method, **params):
        return self._tools.send(method, params)

    def ask(self, expression):
        """Return what JavaScript says; a promise is waited for."""
        return self._page.evaluate(expression)

    def open(self, path, width):
        self.complaints.clear()
        self.requests.clear()
        self._page.set_viewport_size({"width": width, "height": 900})
        self._page.goto(path.as_uri())

    def wait_for(self, expression, value):
        """Ask until the answer is this value."""
        end = time.monotonic() + 60  # only ends a test that would hang
        while (found := self.ask(expression)) != value:
            assert time.monotonic() < end, found
            self._page.wait_for_timeout(50)


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip("playwright.sync_api")
    programs = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
    program = next(filter(None, map(shutil.which, programs)), None)
    if program is None:
        pytest.skip("no Chromium here")
    flags = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    with playwright.sync_playwright() as started:
        chromium = started.chromium.launch(executable_path=program, args=flags)
        yield Browser(chromium.new_page())
        chromium.close()


# How much of the first two 3D pictures is drawn on, and a number that stands for both.
PIXELS = """new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => {
  const drawn = [];
  let hash = 0;
  for (const c of [...document.querySelectorAll("canvas[data-mesh]")].slice(0, 2)) {
    const {width, height} = c, d = c.getContext("2d").getImageData(0, 0, width, height).data;
    let on = 0;
    for (let i = 0; i < d.length; i += 4) {
      if (d[i + 3]) on += 1 / (width * height);
      hash = (hash * 31 + d[i] + 7 * d[i + 3]) >>> 0;
    }
    drawn.push(on, hash);
  }
  done(drawn);
})))"""


@contextmanager
def opened(browser, path, width):
    browser.open(path, width)
    browser.ask("document.querySelector('canvas[data-mesh]').scrollIntoView({block: 'center'})")
    browser.wait_for(f"({PIXELS}).then(pixels => pixels[0] > 0)", True)
    yield


@pytest.mark.parametrize("width", [1280, 400])
def test_a_browser_shows_it_without_a_word(browser, trained, width):
    path = trained[2]
    browser.open(path, width)
    assert browser.ask("innerWidth") == width
    assert browser.ask("document.documentElement.scrollWidth") <= width
    browser.wait_for("document.querySelectorAll('canvas[data-mesh]').length", 6)
    assert browser.complaints == []
    assert [u for u in browser.requests if not u.startswith("data:")] == [path.as_uri()]


def key(browser, name, code):
    for kind in ("keyDown", "keyUp"):
        browser.call("Input.dispatchKeyEvent", type=kind, key=name, windowsVirtualKeyCode=code)


def test_meshes_are_drawn_and_turn_together(browser, trained):
    with opened(browser, trained[2], 1000):
        first = browser.ask(PIXELS)
        for share in first[::2]:
            assert 0.02 < share < 0.9
        box = browser.ask(
            "(({x, y}) => [x, y])(document.querySelector('canvas').getBoundingClientRect())"
        )
        x, y = box[0] + 40, box[1] + 40
        mouse = {"button": "left", "clickCount": 1}
        for kind, dx in (("mousePressed", 0), ("mouseMoved", 60), ("mouseReleased", 60)):
            browser.call("Input.dispatchMouseEvent", type=kind, x=x + dx, y=y, buttons=1, **mouse)
        turned = browser.ask(PIXELS)
        assert turned[1] != first[1]
        assert turned[3] != first[3], "the other one turns with it"
        key(browser, "ArrowLeft", 37)
        assert browser.ask(PIXELS)[1] != turned[1]
        browser.call("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-200)
        assert browser.ask(PIXELS)[0] > turned[0], "nearer"
        key(browser, "0", 48)
        assert browser.ask(PIXELS) == first


VISIBLE = """[...document.querySelectorAll(".stage")].map(stage => [...stage.children].map(
  e => getComputedStyle(e).visibility == "visible" && getComputedStyle(e).display != "none"))"""


def test_stills_show_where_nothing_can_be_drawn(browser, trained):
    path = trained[2]
    with opened(browser, path, 1000):
        assert browser.ask(VISIBLE)[0] == [False, True]
        browser.call("Emulation.setEmulatedMedia", media="print")
        assert browser.ask(VISIBLE) == [[True, False]] * 6
        browser.call("Emulation.setEmulatedMedia", media="")
    browser.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        browser.open(path, 1000)
        browser.wait_for(VISIBLE, [[True, False]] * 6)
    finally:
        browser.call("Emulation.setScriptExecutionDisabled", value=False)


def test_nothing_is_cut_off_on_paper(browser, trained):
    browser.open(trained[2], 1040)  # a landscape A4 page within its margins
    browser.call("Emulation.setEmulatedMedia", media="print")
    wide = browser.ask(
        "[...document.querySelectorAll('main *')].filter(e => "
        "e.getBoundingClientRect().right > innerWidth + 1).map(e => e.outerHTML.slice(0, 80))"
    )
    browser.call("Emulation.setEmulatedMedia", media="")
    assert wide == []


def test_fingers_turn_and_pinch(browser, trained):
    with opened(browser, trained[2], 400):
        before = browser.ask(PIXELS)
        x, y = browser.ask(
            "(({x, y}) => [x, y])(document.querySelector('canvas').getBoundingClientRect())"
        )
        steps = [(40, 60), (30, 70), (20, 80), (10, 90)]
        for k, (a, b) in enumerate(steps):
            points = [{"x": x + a, "y": y + 40, "id": 0}, {"x": x + b, "y": y + 40, "id": 1}]
            kind = "touchMove" if k else "touchStart"
            browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        pinched = browser.ask(PIXELS)
        assert pinched[0] > before[0], "nearer"
        for k, kind in enumerate(("touchStart", "touchMove", "touchMove", "touchMove")):
            points = [{"x": x + 40 + 25 * k, "y": y + 40, "id": 0}]
            browser.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
        assert browser.ask(PIXELS)[1] != pinched[1]
