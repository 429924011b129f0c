"""Part labels that templates bring along: what naive loops find."""

import csv

import numpy as np
import pytest

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import PartCloud
from ffd_lightning.errors import DataError
from ffd_lightning.evaluation import evaluator
from ffd_lightning.evaluation.protocols import PartProtocol
from ffd_lightning.evaluation.samples import Sample, predict
from ffd_lightning.geometry.mesh import UNKNOWN_PART


def naive_parts(source, points):
    """The part of the nearest point, one after the other."""
    found = []
    for point in points:
        distances = [((point - other) ** 2).sum() for other in source.points]
        found.append(source.names[source.labels[int(np.argmin(distances))]])
    return found


@pytest.fixture
def parts(case, fits, tmp_path):
    """Return a function that evaluates under protocol parts, and gives its rows."""
    evaluation = case(protocol=PartProtocol(), tested_on=tuple(range(6, 16)))

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
