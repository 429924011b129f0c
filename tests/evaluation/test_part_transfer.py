import csv
import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import torch

from ffd_lightning.app.build import build_data, build_network
from ffd_lightning.app.commands.evaluate import evaluate_run
from ffd_lightning.app.config import EvaluateConfig
from ffd_lightning.app.configuration import compose_config, typed_config
from ffd_lightning.app.identity import to_yaml
from ffd_lightning.checkpoint import model_entry
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import PartCloud
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation import evaluator
from ffd_lightning.evaluation.part_transfer import (
    known_points,
    part_of_points,
    part_scores,
    transferred_parts,
)
from ffd_lightning.evaluation.protocols import PROTOCOLS
from ffd_lightning.evaluation.references import SHAPES
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.evaluation.shapes import PreparedShape, TemplateShape
from ffd_lightning.evaluation.summaries import by_category, means
from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh
from ffd_lightning.run_folder import RunFolder

PARTS = PROTOCOLS["parts"]
CUBE = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float) - 0.5
CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
    + [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)


class Box:
    """A prepared set of one box: `low` below a height, `high` above it, points all over inside."""

    part_names = ("low", "high")
    num_points = 8000

    def __init__(self, border, size=(0.6, 0.6, 0.6), seed=0):
        points = np.random.default_rng(seed).uniform(-0.5, 0.5, (self.num_points, 3))
        self.parts = (points[:, 1] > border - 0.5).astype(np.uint8)
        self.points, self.size = (points * size).astype(np.float32), np.array(size)

    def cloud(self, row):
        return self.points

    def point_parts(self, row):
        return self.parts

    def part_names_of(self, row):
        return self.part_names

    @property
    def mesh(self):
        colors = np.full((12, 4), 200, np.uint8)
        return Mesh(CUBE * self.size, CUBE_FACES, colors)

    def bank(self, parts=None):
        own = self.parts if parts is None else parts
        points = torch.from_numpy(self.points[None])
        return TemplateBank(("box",), ("",), points, (self.mesh,), own[None], self.part_names)


def score(shape, truth):
    rng = np.random.default_rng(0)
    return PARTS.score(shape, PARTS.truth(PreparedShape(truth, 0), rng), rng)


def test_boxes_of_two_parts_with_a_known_iou():
    """Borders at 1/2 and 3/4 of the height: a quarter of the points is taken for `low`."""
    scores = score(TemplateShape(Box(0.75, seed=1).bank(), 0), Box(0.5))
    assert scores["part_accuracy"] == pytest.approx(3 / 4, abs=0.03)
    assert scores["part_iou_low"] == pytest.approx(2 / 3, abs=0.03)
    assert scores["part_iou_high"] == pytest.approx(1 / 2, abs=0.03)
    both = (scores["part_iou_low"] + scores["part_iou_high"]) / 2
    assert scores["part_iou"] == scores["shapenet_part_iou"] == pytest.approx(both)


def test_a_template_deformed_onto_the_truth_labels_it_right():
    """Flat and wide, its border at another height, until it is stretched and turned over."""
    template = Box(0.7, size=(0.6, 0.2, 0.7), seed=1)
    template.parts = 1 - template.parts
    bank, truth = template.bank(), Box(0.3)
    points = bank.control_points[0].numpy()
    onto = points * truth.size / template.size * [1, -1, 1]
    deformed = TemplateShape(bank, 0, (onto - points).astype(np.float32))
    assert score(deformed, truth)["part_iou"] > 0.95, "all but a few points near the border"
    assert score(TemplateShape(bank, 0), truth)["part_iou"] < 0.3


def test_the_floor_has_the_labels_of_other_points():
    box = Box(0.5)
    own, truth = (
        PreparedShape(box, 0).labelled_points(),
        PreparedShape(box, 0).truth_labelled_points(),
    )
    for cloud, half in ((truth, slice(4000)), (own, slice(4000, None))):
        np.testing.assert_array_equal(cloud.points, box.points[half])
        np.testing.assert_array_equal(cloud.labels, box.parts[half])
    assert 0.9 < score(PreparedShape(box, 0), box)["part_iou"] < 1


def naive_parts(source, points):
    """The part of the nearest point whose part is known, one after the other."""
    found = []
    for point in points:
        best, part = np.inf, ""
        for other, label in zip(source.points, source.labels, strict=True):
            distance = ((point - other) ** 2).sum()
            if label != UNKNOWN_PART and distance < best:
                best, part = distance, source.names[label]
        found.append(part)
    return found


def test_the_nearest_labelled_point_gives_its_part():
    rng = np.random.default_rng(0)
    labels = rng.choice(np.array([0, 1, 2, UNKNOWN_PART], np.uint8), 60)
    source = PartCloud(rng.normal(size=(60, 3)), labels, ("a", "b", "longer"))
    points = rng.normal(size=(40, 3))
    found = transferred_parts(source, points)
    assert found.tolist() == naive_parts(source, points)
    assert len(set(found)) == 3
    unknown = replace(source, labels=np.full(60, UNKNOWN_PART, np.uint8))
    assert transferred_parts(unknown, points).tolist() == [""] * 40


def test_the_same_part_may_have_another_number_elsewhere():
    """Sets number their parts as they come: names are compared."""
    points = np.random.default_rng(0).normal(size=(30, 3))
    here = PartCloud(points, (np.arange(30) % 3).astype(np.uint8), ("leg", "top", "shelf"))
    there = PartCloud(points, ((np.arange(30) + 1) % 3).astype(np.uint8), ("shelf", "leg", "top"))
    truth = part_of_points(here)
    assert truth[:3].tolist() == ["leg", "top", "shelf"]
    scores = part_scores(truth, transferred_parts(there, points), here.names)
    assert scores["part_accuracy"] == scores["part_iou"] == 1


def test_parts_that_are_absent():
    truth = np.array(["top"] * 6 + ["leg"] * 4)
    category = ("top", "leg", "shelf", "drawer")
    found = np.array(["top"] * 5 + ["shelf"] + ["leg"] * 4)
    scores = part_scores(truth, found, category)
    assert scores == pytest.approx(
        {
            "part_iou": (5 / 6 + 1 + 0) / 3,  # the shelf is not there
            "shapenet_part_iou": (5 / 6 + 1 + 0 + 1) / 4,  # no drawer, and none was said to be
            "part_accuracy": 0.9,
            "part_iou_top": 5 / 6,
            "part_iou_leg": 1.0,
        }
    )
    of_another_category = np.array(["top"] * 5 + ["wing"] + ["leg"] * 4)
    scores = part_scores(truth, of_another_category, category)
    assert scores["part_iou"] == pytest.approx((5 / 6 + 1 + 0) / 3)
    assert scores["shapenet_part_iou"] == pytest.approx((5 / 6 + 1 + 1 + 1) / 4)
    nothing = part_scores(truth, np.full(10, ""), category)
    assert nothing["part_iou"] == nothing["part_accuracy"] == nothing["part_iou_leg"] == 0


def test_points_of_unknown_parts_are_neither_asked_nor_do_they_answer():
    truth, template = Box(0.5), Box(0.75, seed=1)
    truth.parts = np.where(truth.points[:, 1] > 0.2, UNKNOWN_PART, truth.parts).astype(np.uint8)
    # The template's upper half says nothing, so its lower half is asked: all of that is low.
    parts = np.where(template.points[:, 1] > 0, UNKNOWN_PART, template.parts).astype(np.uint8)
    scores = score(TemplateShape(template.bank(parts), 0), truth)
    known = known_points(PreparedShape(truth, 0).truth_labelled_points())
    low = float(np.mean(known.labels == 0))
    assert scores["part_accuracy"] == pytest.approx(low)
    assert scores["part_iou"] == pytest.approx(low / 2)


def test_the_parts_of_a_category_among_several(prepared):
    (own,) = prepared.manifests
    settings = {**own["settings"], "category": "plane"}
    plane = {**own, "settings": settings, "part_names": [*prepared.part_names, "wing"]}
    other = PreparedSet(prepared.paths, (plane,))
    joined = PreparedSet(prepared.paths * 2, (own, plane))
    assert PreparedShape(joined, 0).category_parts == prepared.part_names
    assert PreparedShape(joined, len(prepared)).category_parts == other.part_names
    assert "wing" in joined.part_names


# --- whole runs ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def trained(tiny_config, tmp_path_factory):
    """A run as it is after no step of training, its network, and its data."""
    run = RunFolder(tmp_path_factory.mktemp("run"))
    cfg = tiny_config("split.train_fraction=0.4")
    torch.manual_seed(0)
    network = build_network(cfg)
    weights = {f"network.{name}": value for name, value in network.state_dict().items()}
    run.config.write_text(to_yaml(cfg))
    run.checkpoint.parent.mkdir()
    data = build_data(cfg)
    data.setup()
    content = {"state_dict": weights, "global_step": 0, **model_entry(network, data, {})}
    torch.save(content, run.checkpoint)
    run.set_status("finished")
    return run, network, data


@pytest.fixture
def copy(trained, tmp_path):
    """The run's folder, free to be written to."""
    return RunFolder(shutil.copytree(trained[0].path, tmp_path / "run"))


def evaluate(run, *overrides):
    given = [f"run={run.path}", "protocol=parts", "progress_bar=false", *overrides]
    composed = compose_config("evaluate", EvaluateConfig, given)
    return evaluate_run(typed_config(composed, EvaluateConfig))[0]


def written(run):
    folder = run.evaluation("parts")
    return list(csv.DictReader((folder / "samples.csv").read_text().splitlines())), json.loads(
        (folder / "summary.json").read_text(), parse_constant=pytest.fail
    )


def test_a_run_in_numbers(copy, trained):
    summary = evaluate(copy)
    data = trained[2]
    rows, content = written(copy)
    assert [row["id"] for row in rows] == list(data.split.test)
    for row in rows:
        parts = data.prepared.point_parts(data.prepared.index(row["id"]))[:128]
        there = {data.prepared.part_names[k] for k in parts}
        for shape in (s for s in SHAPES if s != "resampled"):  # of protocols that carry points
            prefix = f"{shape}_" if shape else ""
            named = {p for p in data.prepared.part_names if row.get(f"{prefix}part_iou_{p}")}
            assert named == there, "empty where the query has no such part"
    for name in ("part_iou", "undeformed_part_accuracy", "part_iou_shelf", "floor_part_iou_leg"):
        values = [float(row[name]) for row in rows if row[name]]
        assert summary[name] == content[name] == pytest.approx(np.mean(values))
        assert content["category_mean"][name] == pytest.approx(summary[name])
    assert 0 < len([row for row in rows if not row["part_iou_shelf"]]) < len(rows)
    assert summary["floor_part_iou"] > summary["retrieval_part_iou"] > summary["part_iou"]
    assert evaluate(copy) == summary, "read back"


def test_a_sample_again_by_hand(copy, trained):
    evaluate(copy, "evaluation.references=false")
    rows, _ = written(copy)
    _, network, data = trained
    for row in rows[:2]:
        place, t = data.prepared.index(row["id"]), data.bank.ids.index(row["template"])
        offsets = predict(network, data.prepared, [Sample(place)]).offsets[0, t]
        moved = (data.bank.deformation_matrix[t] @ (data.bank.control_points[t] + offsets)).numpy()
        names = np.array(data.prepared.part_names)
        source = PartCloud(moved[128:], data.bank.point_parts[t][128:], tuple(names))
        found = naive_parts(source, data.prepared.cloud(place)[:128].astype(float))
        truth = names[data.prepared.point_parts(place)[:128]].tolist()
        ious = []
        for part in sorted({*truth, *found}):
            pairs = [(a == part, b == part) for a, b in zip(truth, found, strict=True)]
            ious.append(sum(a and b for a, b in pairs) / sum(a or b for a, b in pairs))
        assert float(row["part_iou"]) == pytest.approx(np.mean(ious))
        right = np.mean([a == b for a, b in zip(truth, found, strict=True)])
        assert float(row["part_accuracy"]) == pytest.approx(right)


def test_an_evaluation_that_was_cut_off_goes_on(copy, monkeypatch):
    evaluate(copy)
    files = [copy.evaluation("parts") / name for name in ("samples.csv", "summary.json")]
    expected = [file.read_text() for file in files]
    shutil.rmtree(copy.evaluation("parts"))
    scored, score_shapes = [], evaluator.score_shapes

    def cut_off(*arguments):
        scored.append(arguments)
        if len(scored) == 4:
            raise KeyboardInterrupt
        return score_shapes(*arguments)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(evaluator, "score_shapes", cut_off)
        with pytest.raises(KeyboardInterrupt):
            evaluate(copy, "evaluation.workers=1")
    done = len((copy.evaluation("parts") / "samples.partial").read_text().splitlines()) - 1
    assert done == 3
    evaluate(copy, "evaluation.workers=2")
    assert [file.read_text() for file in files] == expected


def unlabelled(monkeypatch, ids=None):
    """Let shapes (all of them for None) have no part labels."""
    point_parts = PreparedSet.point_parts

    def patched(self, row):
        parts = point_parts(self, row)
        if ids is None:
            return None
        return np.full_like(parts, UNKNOWN_PART) if self.ids[row] in ids else parts

    monkeypatch.setattr(PreparedSet, "point_parts", patched)


def test_data_without_labels_is_said_before_anything_is_done(copy, monkeypatch):
    unlabelled(monkeypatch)
    monkeypatch.setattr(evaluator, "predict", None)
    with pytest.raises(DataError, match=r"no test shape of .*data.parts_root=.*another protocol"):
        evaluate(copy)
    assert not copy.evaluation("parts").exists()


def test_templates_or_training_models_without_labels(copy, trained, monkeypatch, caplog):
    data = trained[2]
    with pytest.MonkeyPatch.context() as patch:
        unlabelled(patch, data.bank.ids)
        with pytest.raises(DataError, match="none of the templates has part labels"):
            evaluate(copy)
    with pytest.MonkeyPatch.context() as patch:
        unlabelled(patch, data.split.train)
        with pytest.raises(DataError, match=r"no training shape .* evaluation\.references=false"):
            evaluate(copy)
        assert evaluate(copy, "evaluation.references=false")["part_iou"] > 0
    unlabelled(monkeypatch, data.bank.ids[:1])
    summary = evaluate(copy)
    assert "1 of 2 templates have no part labels, so all" in caplog.text
    assert data.bank.ids[0] in caplog.text
    rows = written(copy)[0]
    for row in rows:
        assert (float(row["part_iou"]) == 0) == (row["template"] == data.bank.ids[0])
    assert 0 in [float(row["best_undeformed_part_iou"]) for row in rows]
    assert summary["best_undeformed_part_iou"] > 0


def test_models_without_labels_are_left_out(copy, trained, monkeypatch):
    data = trained[2]
    evaluate(copy)
    before = {row["id"]: row for row in written(copy)[0]}
    gone = data.split.test[:2]
    unlabelled(monkeypatch, {*gone, *data.split.train[::2]})
    summary = evaluate(copy, "restart=true")
    rows, _ = written(copy)
    assert [row["id"] for row in rows] == [i for i in data.split.test if i not in gone]
    assert summary["num_samples"] == len(rows) < len(before)
    assert all(row["part_iou"] == before[row["id"]]["part_iou"] for row in rows)
    assert min(float(row["retrieval_part_accuracy"]) for row in rows) > 0, "others are retrieved"


def test_means_are_over_the_rows_that_have_a_number():
    rows = [
        {"id": "a", "category": "sofa", "iou": 0.0, "iou_seat": 0.5, "iou_wing": None},
        {"id": "b", "category": "car", "iou": 0.5, "iou_seat": None, "iou_wing": None},
    ]
    assert means(rows) == {"iou": 0.25, "iou_seat": 0.5}, "no number is no column, and never NaN"
    assert by_category(rows)["category_mean"] == {"iou": 0.25, "iou_seat": 0.5}
