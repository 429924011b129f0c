"""Part labels that templates bring along: against naive loops, and boxes whose scores are known."""

import csv

import numpy as np
import pytest
import torch

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import PartCloud
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation import evaluator
from ffd_lightning.evaluation.candidates import PreparedShape, TemplateShape
from ffd_lightning.evaluation.protocols import PartProtocol
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh

PROTOCOL = PartProtocol()
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
    return PROTOCOL.score(shape, PROTOCOL.truth(PreparedShape(truth, 0), rng), rng)


def test_boxes_of_two_parts_with_a_known_iou():
    """Borders at 1/2 and 3/4 of the height: a quarter of the points is taken for `low`."""
    scores = score(TemplateShape(Box(0.75, seed=1).bank(), 0), Box(0.5))
    assert scores["part_accuracy"] == pytest.approx(3 / 4, abs=0.03)
    assert scores["part_iou_low"] == pytest.approx(2 / 3, abs=0.03)
    assert scores["part_iou_high"] == pytest.approx(1 / 2, abs=0.03)
    both = (scores["part_iou_low"] + scores["part_iou_high"]) / 2
    assert scores["part_iou"] == scores["shapenet_part_iou"] == pytest.approx(both)


def test_a_template_that_is_stretched_and_turned_over_onto_the_truth_labels_it_right():
    template = Box(0.7, size=(0.6, 0.2, 0.7), seed=1)
    template.parts = 1 - template.parts
    bank, truth = template.bank(), Box(0.3)
    points = bank.control_points[0].numpy()
    onto = points * truth.size / template.size * [1, -1, 1]
    deformed = TemplateShape(bank, 0, (onto - points).astype(np.float32))
    assert score(deformed, truth)["part_iou"] > 0.95, "all but a few points near the border"
    assert score(TemplateShape(bank, 0), truth)["part_iou"] < 0.3


def naive_parts(source, points):
    """The part of the nearest point, one after the other."""
    found = []
    for point in points:
        distances = [((point - other) ** 2).sum() for other in source.points]
        found.append(source.names[source.labels[int(np.argmin(distances))]])
    return found


# --- whole evaluations ----------------------------------------------------------------------------


@pytest.fixture
def parts(case, fits, tmp_path):
    """Return a function that evaluates under protocol parts, and gives its rows."""
    evaluation = case(protocol=PROTOCOL, tested_on=tuple(range(6, 16)))

    def run(**options):
        text = evaluation.run(tmp_path / "run", **options)
        return list(csv.DictReader(text.splitlines()))

    run.case = evaluation
    return run


def test_a_sample_again_by_hand(parts, prepared):
    rows, evaluated = parts(references=False), parts.case.evaluated
    bank, names = evaluated.bank, np.array(prepared.part_names)
    for row in rows[:2]:
        place, t = prepared.index(row["id"]), bank.ids.index(row["template"])
        offsets = predict(evaluated.network, prepared, [Sample(place)]).offsets[0, t]
        moved = (bank.deformation_matrix[t] @ (bank.control_points[t] + offsets)).numpy()
        source = PartCloud(moved[128:], bank.point_parts[t][128:], tuple(names))
        given = naive_parts(source, prepared.cloud(place)[:128].astype(float))
        truth = names[prepared.point_parts(place)[:128]].tolist()
        ious = []
        for part in sorted({*truth, *given}):
            pairs = [(a == part, b == part) for a, b in zip(truth, given, strict=True)]
            ious.append(sum(a and b for a, b in pairs) / sum(a or b for a, b in pairs))
        assert float(row["part_iou"]) == pytest.approx(np.mean(ious))
        right = np.mean([a == b for a, b in zip(truth, given, strict=True)])
        assert float(row["part_accuracy"]) == pytest.approx(right)


@pytest.fixture
def unlabelled(monkeypatch):
    """Return a function that lets shapes have no part labels."""
    point_parts = PreparedSet.point_parts

    def without(ids):
        def patched(self, row):
            found = point_parts(self, row)
            return np.full_like(found, UNKNOWN_PART) if self.ids[row] in ids else found

        monkeypatch.setattr(PreparedSet, "point_parts", patched)

    return without


def test_data_without_labels_is_said_before_anything_is_done(
    parts, unlabelled, prepared, monkeypatch, caplog
):
    predict = evaluator.predict
    monkeypatch.setattr(evaluator, "predict", None)
    for rows, message in (
        (range(24), r"no test shape of .*data.parts_root=.*another protocol"),
        (range(2), "none of the templates has part labels"),
        (range(2, 6), r"no training shape .* evaluation\.references=false"),
    ):
        unlabelled([prepared.ids[k] for k in rows])
        with pytest.raises(DataError, match=message):
            parts()
    monkeypatch.setattr(evaluator, "predict", predict)
    unlabelled(prepared.ids[:1])
    rows = parts()
    assert "1 of 2 templates have no part labels, so all" in caplog.text
    for row in rows:
        assert (float(row["part_iou"]) == 0) == (row["template"] == prepared.ids[0])


def test_shapes_without_labels_are_left_out(parts, unlabelled, prepared):
    before = {row["id"]: row for row in parts()}
    gone = [prepared.ids[k] for k in (6, 9, 2)]
    unlabelled(gone)
    rows = parts(restart=True)
    assert [row["id"] for row in rows] == [name for name in before if name not in gone]
    assert all(row["part_iou"] == before[row["id"]]["part_iou"] for row in rows)
    assert min(float(row["retrieval_part_accuracy"]) for row in rows) > 0, "others are retrieved"
