import numpy as np
import pytest

from ffd_lightning.data.templates import summary
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.distances import CANDIDATES, shape_distances
from ffd_lightning.data.templates.summary import template_rows


def test_rows_say_what_each_template_covers(prepared):
    ids = [prepared.ids[k] for k in (7, 3, 11)]
    rows, coverage = template_rows(prepared, TemplateBank.of(prepared, ids))
    table = shape_distances(prepared).table[[7, 3, 11]]
    others = [k for k in range(len(prepared)) if k not in (7, 3, 11)]
    assert [(row["order"], row["id"]) for row in rows] == list(enumerate(ids, 1))
    assert [row["family"] for row in rows] == [prepared.families[k] for k in (7, 3, 11)]
    nearest = table.argmin(0)
    assert [row["share"] for row in rows] == pytest.approx(np.bincount(nearest, minlength=3) / 24)
    for t, row in enumerate(rows):
        own = [table[t, k] for k in others if nearest[k] == t]
        assert row["chamfer"] == pytest.approx(np.mean(own), rel=1e-5)
    assert coverage == pytest.approx(table[:, others].min(0).mean(), rel=1e-5)


def test_templates_of_a_large_set_count_whether_they_were_looked_at_or_not(prepared, monkeypatch):
    assert len(prepared) < CANDIDATES
    monkeypatch.setattr(summary, "CANDIDATES", 4)
    rows, _ = template_rows(prepared, TemplateBank.of(prepared, [prepared.ids[1]]))
    assert rows[0]["share"] == 1
