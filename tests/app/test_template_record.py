"""What a run folder says of its templates."""

import csv
import logging
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from ffd_lightning.app import template_record
from ffd_lightning.app.template_record import record_templates
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.run_folder import RunFolder


@pytest.fixture
def data(prepared):
    """What `record_templates` reads of a data module."""
    ids = prepared.ids[3:8]
    bank = TemplateBank.of(prepared, ids)
    return SimpleNamespace(prepared=prepared, bank=bank, drop_outliers=False)


def test_ids_and_pictures_are_in_the_folder_and_in_the_log(data, tmp_path, caplog):
    run = RunFolder(tmp_path)
    with caplog.at_level(logging.INFO):
        record_templates(run, data)
    rows = list(csv.DictReader(run.templates.open()))
    assert list(rows[0]) == ["order", "id", "family", "share", "chamfer"]
    assert tuple(row["id"] for row in rows) == data.bank.ids
    assert np.asarray(Image.open(run.templates_picture)).std() > 0
    assert not run.outliers.exists()
    assert f"ids: {', '.join(data.bank.ids)}" in caplog.text


def test_outliers_are_written_named_and_gone_when_there_are_none(
    data, tmp_path, caplog, monkeypatch
):
    run = RunFolder(tmp_path)
    strange = [{"id": data.bank.ids[0], "times_usual": 9.5}, {"id": "other", "times_usual": 4.0}]
    monkeypatch.setattr(template_record, "outlier_rows", lambda prepared: strange)
    record_templates(run, data)
    assert run.outliers.read_text() == f"id,times_usual\n{data.bank.ids[0]},9.5\nother,4.0\n"
    assert f"2 of 24 shapes are like nothing else in their category: {strange[0]['id']}, other" in (
        caplog.text
    )
    assert "split.drop_outliers=true leaves them out" in caplog.text
    assert "1 of them are templates" in caplog.text
    monkeypatch.setattr(template_record, "outlier_rows", lambda prepared: [])
    record_templates(run, data)
    assert not run.outliers.exists()
