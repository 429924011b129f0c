"""The picture of a run's templates."""

import numpy as np
import pytest

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.evaluation import figures
from ffd_lightning.evaluation.figures import template_figure
from ffd_lightning.imaging.sheet import text_width

SHAPENET = "1a6f615e8b1b5ae4dbbc9440457e303e"


@pytest.fixture(scope="module")
def bank(prepared):
    return TemplateBank.of(prepared, prepared.ids[:2])


@pytest.fixture
def labels(bank, monkeypatch):
    """Return a function from ids to the labels below their cells, and whether each line fits."""
    sheets = []
    true = figures.contact_sheet

    def sheet(cells, columns, labels, font_size):
        sheets.append(labels)
        return true(cells, columns, labels, font_size=font_size)

    def make(*ids, **notes):
        named = replace_ids(bank, ids)
        template_figure(named, **notes)
        return sheets[-1]

    monkeypatch.setattr(figures, "contact_sheet", sheet)
    return make


def replace_ids(bank, ids):
    copy = TemplateBank.from_state(bank.state())
    copy.ids = tuple(ids)
    return copy


def test_every_template_has_a_cell_with_its_picture(bank):
    one = TemplateBank.from_state(bank.state())
    one.ids, one.meshes = bank.ids[:1], bank.meshes[:1]
    height, width = template_figure(one).shape[:2]
    pair = template_figure(bank)
    assert pair.shape[0] == height
    assert 1.8 * width < pair.shape[1] <= 2 * width
    halves = pair[:, : width - 8], pair[:, width:]
    assert all((half < 200).any() for half in halves)
    np.testing.assert_array_equal(template_figure(one)[: height - 30, : width - 8], halves[0][:-30])


@pytest.mark.parametrize(
    ("count", "columns"), [(1, 1), (2, 2), (4, 4), (8, 4), (16, 4), (26, 6), (30, 6)]
)
def test_templates_stand_in_rows(bank, monkeypatch, count, columns):
    many = TemplateBank.from_state(bank.state())
    many.ids, many.meshes = tuple("x" * count), bank.meshes[:1] * count
    monkeypatch.setattr(figures, "_CELL", (12, 16))
    shape = template_figure(many).shape
    rows = -(-count // columns)
    assert shape[1] == pytest.approx(20 * columns, abs=4)
    assert (shape[0] - 4) % rows == 0


def test_labels_say_number_id_and_note(labels):
    assert labels("a", "b", notes=["x", "y"]) == ["1  a\nx", "2  b\ny"]


def test_ids_are_whole(labels):
    first, second = labels(SHAPENET, f"watercraft/{SHAPENET}")
    assert first.replace("\n", "").removeprefix("1  ") == SHAPENET
    assert second == f"2  watercraft\n{SHAPENET}"


def test_no_line_is_wider_than_a_cell(labels):
    lines = [
        line for label in labels(SHAPENET, f"watercraft/{SHAPENET}") for line in label.split("\n")
    ]
    assert max(text_width(line, figures._FONT) for line in lines) <= figures._CELL[1]
