import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from box_source import RENDER, BoxSource, box_mesh, loads, prepare_boxes

from ffd_lightning.data.preparation import prepared
from ffd_lightning.data.preparation.packing import POINT_STEP
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.errors import DataError
from ffd_lightning.geometry.mesh import normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    root = tmp_path_factory.mktemp("boxes")
    return prepare_boxes(BoxSource(4, root / "log"), root, workers=1, num_points=50)


@pytest.fixture
def copy(boxes, tmp_path):
    """A copy of the set that a test may damage."""
    return PreparedSet.open(shutil.copytree(boxes.path, tmp_path / "copy"))


def test_arrays_agree_with_the_shape_and_each_other(boxes):
    for row in range(len(boxes)):
        shape, mesh = box_mesh(row), boxes.mesh(row)
        vertices = normalize(shape.vertices, shape.faces)
        np.testing.assert_allclose(mesh.vertices, vertices, atol=1e-6)
        np.testing.assert_array_equal(mesh.faces, shape.faces)
        names = [shape.part_names[p] for p in shape.face_parts]
        assert [mesh.part_names[p] for p in mesh.face_parts] == names
        near = faces_at(mesh, boxes.cloud(row))
        assert near.any(axis=1).all(), "every point lies on a face"
        for faces, part in zip(near, boxes.point_parts(row), strict=True):
            assert part in mesh.face_parts[faces], "and has the part of one that it lies on"
        for view, azimuth in enumerate(RENDER.azimuths):
            camera = boxes.camera(row, view)
            assert camera == Camera(azimuth, 30.0)
            image = render(shape.with_vertices(vertices), camera, height=24, width=32, samples=1)
            np.testing.assert_array_equal(boxes.image(row, view), image)


def faces_at(mesh, points):
    """Return which triangles each point lies on, (N, F)."""
    nearest = [
        trimesh.triangles.closest_point(np.repeat(triangle[None], len(points), 0), points)
        for triangle in mesh.vertices[mesh.faces]
    ]
    return (np.linalg.norm(np.array(nearest) - points, axis=2) < 2 * POINT_STEP).T


def test_a_set_without_some_shapes_is_a_set(boxes):
    some = boxes.without({"b01", "nobody"}).without({"b02"})
    assert some.ids == ("b00", "b03")
    assert some.families == ("plain", "wooden")
    assert some.digest != boxes.digest == some.whole.digest
    np.testing.assert_array_equal(some.cloud(1), boxes.cloud(3))
    np.testing.assert_array_equal(some.image(1, 1), boxes.image(3, 1))
    with pytest.raises(IndexError):
        some.cloud(2)
    with pytest.raises(DataError, match="no shape"):
        some.index("b01")


def test_damage_of_a_shape_is_named_on_reading_and_mended_alone(copy, boxes, tmp_path):
    file = copy.file(2)
    data = bytearray(file.read_bytes())
    data[len(data) // 3] ^= 1
    file.write_bytes(data)
    with pytest.raises(DataError, match=rf"{file} is damaged .* delete it and run the same"):
        [copy.cloud(2), copy.mesh(2), copy.image(2, 0), copy.image(2, 1)]
    np.testing.assert_array_equal(copy.cloud(1), boxes.cloud(1))
    file.unlink()
    with pytest.raises(DataError, match="is missing"):
        PreparedSet.open(copy.path)
    target = tmp_path / "prepared" / boxes.path.name
    target.parent.mkdir()
    copy.path.rename(target)
    log = tmp_path / "log"
    mended = prepare_boxes(BoxSource(4, log), tmp_path, workers=1, num_points=50)
    assert loads(log)[0] == ["b02"]
    assert mended.file(2).read_bytes() == boxes.file(2).read_bytes()


def test_a_file_that_was_made_anew_is_read_by_a_set_that_is_open(copy):
    before, file = copy.packed_cloud(0), copy.file(0)
    with np.load(file) as arrays:
        content = {name: arrays[name] for name in sorted(arrays.files, reverse=True)}
    file.unlink()
    np.savez(file, **(content | {"points": before[::-1]}))
    np.testing.assert_array_equal(copy.packed_cloud(0), before[::-1])


def test_what_is_measured_of_a_set_is_measured_once(copy, monkeypatch):
    def length(of, known):
        monkeypatch.setattr(prepared, "_measured", {})  # as in another process
        return of.measured("length", lambda: {"n": np.array([known])})["n"].tolist()

    assert length(copy, 1) == length(copy, 2) == [1]
    assert length(copy.without(["b00"]), 3) == [3]
    file = next(copy.path.glob(f"length-{copy.digest[:16]}.npz"))
    file.write_bytes(file.read_bytes()[:-30])
    assert length(copy, 4) == length(copy, 5) == [4]
    file.unlink()
    file.mkdir()  # as in a folder that cannot be written to
    assert length(copy, 6) == [6]


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (None, "is not a prepared set: it has no"),
        ("[]", "is damaged"),
        ({"ids": ["b00"]}, "its checksum does not fit"),
        ({"settings": {"format": 3}}, "another version: ffd prepare makes it anew"),
    ],
)
def test_damage_of_a_manifest_is_named(copy, damage, words):
    path = copy.path / "manifest.json"
    if isinstance(damage, dict):
        damage = json.dumps(json.loads(path.read_text()) | damage)
    path.unlink() if damage is None else path.write_text(damage)
    with pytest.raises(DataError, match=words):
        PreparedSet.open(copy.path)


class Trap:
    def __reduce__(self):
        return Path.touch, (Path("sprung"),)


def test_pickled_objects_are_refused_and_never_run(copy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.savez(copy.file(0), points=np.array([Trap()], object))
    with pytest.raises(DataError, match=r"npz is damaged"):
        copy.cloud(0)
    assert not Path("sprung").exists()
