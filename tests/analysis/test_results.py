import csv
import io
import shutil

import pytest
from analysis.folders import write_run

from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.tables import scores
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.protocols import Metric, ProtocolDescription

OWN = ProtocolDescription("own", "no unit", (Metric("warmth", "degrees", True, 1.0),))


def test_runs_are_read_in_order_with_their_means(tmp_path):
    write_run(tmp_path / "1", "e", chamfer=[0.1, 0.3])
    write_run(tmp_path / "2", "b", 16, category="02818832", template=["x", "y"])
    failed = write_run(tmp_path / "3", "b", 4, category="02818832")
    failed.set_status("failed", reason="the disk is full")
    empty = write_run(tmp_path / "4", "r").evaluation("paper") / "samples.csv"
    empty.write_text("")
    results = Results.read(tmp_path)
    assert results.runs["run"].tolist() == ["3", "2", "1", "4"]
    assert results.runs["state"].tolist() == ["failed", *["finished"] * 3]
    failed, damaged = results.unscored["reason"]
    assert failed == "the disk is full"
    assert "samples.csv is damaged" in damaged
    two, one = results.scored.to_dict("records")
    assert one["chamfer"] == pytest.approx(0.2)
    assert (two["effective_templates"], one["effective_templates"]) == pytest.approx((2, 1))
    assert (one["num_samples"], one["seconds_per_step"]) == (2, 0.5)
    assert results.samples["id"].tolist() == ["000", "001"] * 2, "not numbers"
    assert two["category"] == results.samples["category"].iloc[0] == "02818832", "nor is this one"
    assert results.settings.loc["1", "regime.name"] == "e"
    assert results.where(regime="b").scored["run"].tolist() == ["2"]
    with pytest.raises(DataError, match="no results with"):
        results.where(regime="w")


def test_shapes_of_other_data_are_others_whatever_their_ids(tmp_path):
    for seed in (0, 0, 1):
        name = f"{len(list(tmp_path.iterdir()))}"
        run = write_run(tmp_path / name, settings=f"data: {{name: procedural, seed: {seed}}}\n")
        (run.path / "template_ranking.csv").write_text("rank,id,family\n0,x,desk\n")
    results = Results.read(tmp_path)
    expected = {"0": "table", "1": "table", "2": "table (data.seed=1)"}
    for table in (results.samples, results.runs):
        assert dict(zip(table["run"], table["category"], strict=True)) == expected
    assert results.families["2"] == {"x": "table (data.seed=1)/desk"}


@pytest.mark.parametrize(("files", "place"), [("1", ""), ("2", " (data.root=/b/meshes)")])
def test_folders_of_one_name_may_hold_other_files(tmp_path, files, place):
    for root, known in (("/a/meshes", "1"), ("/a/meshes", "1"), ("/b/meshes", files)):
        name = f"{len(list(tmp_path.iterdir()))}"
        run = write_run(tmp_path / name, settings=f"data: {{name: folder, root: {root}}}\n")
        run.set_data({"sources": {"table": {"sha256": known}}})
    categories = Results.read(tmp_path).runs.set_index("run")["category"].to_dict()
    assert categories == {"0": "table", "1": "table", "2": f"table{place}"}


@pytest.mark.parametrize("rows", [1, 3])
def test_scores_of_fewer_images_or_of_one_twice_are_damaged(tmp_path, rows):
    run = write_run(tmp_path / "1")
    file = run.evaluation("paper") / "samples.csv"
    lines = file.read_text().splitlines()
    file.write_text("\n".join([*lines, lines[1]][: rows + 1]))
    assert "not one for each of 2 images" in Results.read(tmp_path).unscored["reason"].item()


def test_scores_less_copies_of_training_shapes_stand_beside(tmp_path):
    chamfers = [0.1, 0.2, 0.9]
    write_run(tmp_path / "1", "e", chamfer=chamfers)
    assert "copies" not in scores(Results.read(tmp_path)).csv()
    write_run(tmp_path / "2", "b", chamfer=chamfers, twin=[False, False, True])
    results = Results.read(tmp_path)
    assert results.scored["without_twins_chamfer"].tolist() == pytest.approx([0.15, 0.4])
    assert results.scored["chamfer"].tolist() == pytest.approx([0.4, 0.4])
    head, *rows = csv.reader(io.StringIO(scores(results).csv()))
    place = next(k for k, title in enumerate(head) if "copies Chamfer" in title)
    assert [row[place] for row in rows] == ["150.0", "400.0"]


def test_protocols_are_known_from_the_runs_alone(tmp_path):
    """That of another package, say, which is not here."""
    run = write_run(tmp_path / "b")
    write_run(tmp_path / "b2" / "my own", protocol=OWN, warmth=0.7)
    shutil.copytree(tmp_path / "b2/my own/evaluation/own", run.evaluation("own"))
    results = Results.read(tmp_path, "own")
    assert results.protocol == ProtocolDescription(**vars(OWN))
    assert results.scored["warmth"].tolist() == [0.7, 0.7]
    (reason,) = Results.read(tmp_path).unscored["reason"]
    assert reason.startswith("it has no results of protocol paper: ffd evaluate 'run=")
    with pytest.raises(DataError, match=r"under protocol mine: b: .* protocol=mine$"):
        Results.read(tmp_path, "mine")
    (run.evaluation("paper") / "summary.json").write_text('{"protocol": {"metrics": [{}]}}')
    assert Results.read(run.path).samples.empty, "damaged"


def variants(folder):
    return Results.read(folder).runs.set_index("run")["variant"].to_dict()


def test_what_else_differs_is_a_variant(tmp_path):
    for seed, steps in ((0, 300), (1, 300), (0, 600)):
        settings = f"schedule: {{steps: {steps}, rate: {steps / 100}}}\n"
        write_run(tmp_path / f"seed{seed}_{steps}", seed=seed, settings=settings)
    write_run(tmp_path / "e", "e", settings="schedule: {steps: 9}\n")
    refused = write_run(tmp_path / "x", "e", settings="schedule: {steps: null}\n")
    refused.set_status("failed", reason="steps=null")
    steps = {f"seed{k}_{n}": f"schedule.steps={n}" for k, n in ((0, 300), (1, 300), (0, 600))}
    assert variants(tmp_path) == {**steps, "e": "", "x": ""}
    write_run(tmp_path / "wide", settings="schedule: {steps: 300, rate: 3}\nnetwork: {hidden: 9}\n")
    rest = dict.fromkeys(("seed0_300", "seed1_300"), "common settings")
    assert variants(tmp_path) == {**steps, **rest, "wide": "network.hidden=9", "e": "", "x": ""}


def test_networks_of_several_categories_are_settings_of_their_own(tmp_path):
    for name, members in {"two": "table, lamp", "three": "table, lamp, sofa"}.items():
        write_run(tmp_path / name, category=f"joint, members: [{members}]")
    one = {"table": "category=single", "lamp": "category=single"}
    for name in one:
        write_run(tmp_path / name, category=name)
    several = {"two": "category=[table, lamp]", "three": "category=[table, lamp, sofa]"}
    assert variants(tmp_path) == one | several
    shutil.rmtree(tmp_path / "three")
    assert variants(tmp_path) == one | {"two": "category=joint"}


def test_what_all_other_runs_have_is_usual_where_a_regime_has_no_majority(tmp_path):
    for regime in "bwer":
        settings = "data: {limit: 8}\nheads: {name: per_template}\n"
        write_run(tmp_path / regime, regime, settings=settings)
    told = "data: {limit: 4}\nheads: {name: conditioned}\n"
    write_run(tmp_path / "told", settings=told)
    two = settings + "schedule: {steps: 9}\n"
    write_run(tmp_path / "two", category="joint, members: [table, lamp]", settings=two)
    names = {"told": "heads.name=conditioned", "two": "category=joint", "b": "common settings"}
    assert variants(tmp_path) == dict.fromkeys("wer", "") | names


def test_runs_that_are_alike_are_told_apart_by_their_names(tmp_path):
    for name in ("slow", "fast"):
        write_run(tmp_path / name)
    assert variants(tmp_path) == {"slow": "slow", "fast": "fast"}


def test_families_come_with_the_ranking_of_the_templates(tmp_path):
    def families(name, rows, members=""):
        run = write_run(tmp_path / name, category="table" + members)
        (run.path / "template_ranking.csv").write_text(f"rank,id,family\n{rows}")
        return Results.read(run.path).families.get(".")

    expected = {"001": "table/desk", "2": "", "NA": "table/nan"}
    assert families("alone", "0,001,desk\n1,2,\n2,NA,nan\n") == expected
    joint = {"lamp/1": "lamp/desk", "table/1": "table/desk"}
    assert families("joint", "0,lamp/1,desk\n1,table/1,desk\n", ", members: [table, lamp]") == joint
    assert families("unknown", "0,a,\n") is None
    assert families("damaged", '"') is None
