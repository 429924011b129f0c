import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from box_source import BoxSource, box_mesh, box_module, boxes_of, loads, prepare_boxes

from ffd_lightning.data.preparation.prepared import MANIFEST
from ffd_lightning.data.preparation.variants import deformed, vary
from ffd_lightning.data.source import PartCloud, SourceShape
from ffd_lightning.data.splits import HashSplit
from ffd_lightning.data.templates.distances import template_rows
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.ffd import Lattice, deform, deformation_matrix


@pytest.fixture
def source(tmp_path):
    return BoxSource(6, tmp_path / "log", {"b01": "reject"})


def test_the_deformation_is_that_of_geometry_ffd():
    rng = np.random.default_rng(0)
    points, offsets = rng.normal(size=(50, 3)), rng.normal(size=(4, 3, 2, 3))
    points[:, 2] = 0.5  # flat
    box = Lattice.bounding(torch.from_numpy(points), (3, 2, 1))
    expected = deform(
        deformation_matrix(torch.from_numpy(points), box),
        box.control_points(),
        torch.from_numpy(offsets.reshape(-1, 3)),
    )
    found = deformed(points, points.min(0), np.ptp(points, axis=0), offsets)
    np.testing.assert_allclose(found, expected.numpy(), atol=1e-12)


def test_a_variant_is_deformed_symmetric_and_of_other_colours():
    mesh = box_mesh(1)  # it lies symmetrically to its box's middle
    middle = (mesh.vertices.min(0) + mesh.vertices.max(0)) / 2
    mesh = mesh.with_vertices(mesh.vertices - middle)
    parts = PartCloud(mesh.vertices.copy(), np.zeros(len(mesh.vertices), np.uint8), ("box",))
    shape = SourceShape(mesh, "plain", parts=parts, warning="bad: box")
    found = vary(shape, "box/b01~0")
    corners = {tuple(v) for v in np.round(found.mesh.vertices, 9) + 0.0}
    mirrored = np.round(found.mesh.vertices * (-1, 1, 1), 9) + 0.0
    assert corners == {tuple(v) for v in mirrored}
    np.testing.assert_allclose(found.parts.points, found.mesh.vertices)
    assert (found.family, found.warning) == ("plain", "")
    assert not np.array_equal(found.mesh.face_colors, mesh.face_colors)
    assert [t.shape for t in found.mesh.textures] == [t.shape for t in mesh.textures]
    again, other = vary(shape, "box/b01~0"), vary(shape, "box/b01~1")
    np.testing.assert_array_equal(again.mesh.vertices, found.mesh.vertices)
    assert not np.allclose(other.mesh.vertices, found.mesh.vertices)


def test_a_set_has_variants_beside_the_same_shapes(source, tmp_path):
    plain = prepare_boxes(source, tmp_path, progress=False)
    varied = prepare_boxes(source, tmp_path, progress=False, variants=2)
    assert varied.originals.ids == plain.ids == ("b00", "b02", "b03", "b04", "b05")
    assert set(varied.ids) == {*plain.ids, *varied.origins}
    assert varied.origins == {f"{i}~{k}": i for i in plain.ids for k in range(2)}
    for row, shape_id in enumerate(plain.ids):
        same = varied.file(varied.index(shape_id)).read_bytes()
        assert same == plain.file(row).read_bytes()
        cloud = varied.cloud(varied.index(f"{shape_id}~0"))
        assert not np.allclose(cloud, plain.cloud(row), atol=0.01)
    assert [varied.families[varied.index(f"b03~{k}")] for k in range(2)] == ["wooden"] * 2
    manifest = json.loads((plain.path / MANIFEST).read_text())
    assert "origins" not in manifest
    assert "variants" not in manifest["settings"]["source"]
    assert loads(source.log)[0].count("b01") == 2  # its variants are not tried


def test_a_lost_variant_is_made_again(source, tmp_path):
    prepared = prepare_boxes(source, tmp_path, progress=False, variants=1)
    file = prepared.file(prepared.index("b03~0"))
    before = file.read_bytes()
    file.unlink()
    prepare_boxes(source, tmp_path, progress=False, variants=1)
    assert file.read_bytes() == before


def test_variants_that_cannot_be_are_refused(source, tmp_path, monkeypatch):
    with pytest.raises(ConfigError, match="variants=-1 must be 0 or more"):
        boxes_of(source, tmp_path, variants=-1)
    monkeypatch.setattr(BoxSource, "own_images", True)
    with pytest.raises(ConfigError, match=r"images of their own .* leave data.variants out"):
        boxes_of(source, tmp_path, variants=1)


def test_auto_brings_few_shapes_to_some_hundreds(source, tmp_path):
    auto = boxes_of(source, tmp_path, variants="auto")
    assert len(auto.origins) == 6 * 15
    many = replace(auto, source=replace(source, count=300))
    assert many.settings == replace(many, variants=0).settings


def test_variants_are_trained_on_and_nothing_else(source, tmp_path):
    source = replace(source, count=12)
    given = {"num_templates": 2, "split": HashSplit(0.7), "val_fraction": 0.2, "batch_size": 4}
    data = box_module(boxes_of(source, tmp_path, variants=2), **given)
    assert not set(data.bank.ids) & set(data.prepared.origins)
    assert not {i for ids in data.split for i in ids} & set(data.prepared.origins)
    barred = {*data.split.val, *data.split.test}
    assert data.split.val
    assert {data.prepared.origins[i] for i in data.variants} >= set(data.split.train)
    assert not {data.prepared.origins[i] for i in data.variants} & barred
    assert data.record()["shapes"]["variants"] == len(data.variants)
    drawn = {int(row) for batch in data.train_dataloader() for row in batch.rows}
    assert drawn == set(data.rows((*data.split.train, *data.variants)))
    covered, _ = template_rows(data.prepared, data.bank)
    shares = np.array([row["share"] for row in covered]) * len(data.prepared.originals)
    np.testing.assert_allclose(shares, shares.round())  # variants do not count
