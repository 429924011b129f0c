import json
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
from box_source import RENDER, BoxSource, box_mesh, planes, prepare_boxes

from ffd_lightning.data.prepared import PreparedSet
from ffd_lightning.data.rendering import render
from ffd_lightning.errors import DataError
from ffd_lightning.geometry.normalization import normalize


@pytest.fixture(scope="module")
def boxes(tmp_path_factory):
    root = tmp_path_factory.mktemp("boxes")
    return prepare_boxes(BoxSource(4, root / "log"), root, workers=1, num_points=50)


@pytest.fixture
def copy(boxes, tmp_path):
    """A copy of the set that a test may damage."""
    return shutil.copytree(boxes.path, tmp_path / "copy")


def test_what_a_set_holds(boxes):
    assert boxes.ids == ("b00", "b01", "b02", "b03")
    assert len(boxes) == 4
    assert boxes.families == ("plain", "wooden", "plain", "wooden")
    assert set(boxes.part_names) == {"lid", "body"}
    shapes = {name: (a.shape, a.dtype.name) for name, a in boxes.arrays.items()}
    assert shapes == {
        "images": ((4, 2, 24, 32, 4), "uint8"),
        "points": ((4, 50, 3), "float32"),
        "face_ids": ((4, 50), "int32"),
        "point_parts": ((4, 50), "uint8"),
        "vertices": ((4 * len(box_mesh(0).vertices), 3), "float32"),
        "faces": ((4 * 24, 3), "int32"),
        "face_parts": ((4 * 24,), "uint8"),
        "face_colors": ((4 * 24, 4), "uint8"),
        "mesh_offsets": ((5, 2), "int64"),
    }
    assert all(isinstance(a, np.memmap) and not a.flags.writeable for a in boxes.arrays.values())


def test_arrays_agree_with_the_model_and_each_other(boxes):
    for row in range(len(boxes)):
        model, mesh = box_mesh(row), boxes.mesh(row)
        vertices = normalize(model.vertices, model.faces)
        np.testing.assert_allclose(mesh.vertices, vertices, atol=1e-6)
        np.testing.assert_array_equal(mesh.faces, model.faces)
        names = [model.part_names[p] for p in model.face_parts]
        assert [mesh.part_names[p] for p in mesh.face_parts] == names
        np.testing.assert_array_equal(boxes.point_parts[row], mesh.face_parts[boxes.face_ids[row]])
        off = planes(mesh.vertices, mesh.faces, boxes.points[row], boxes.face_ids[row])
        np.testing.assert_allclose(off, 0, atol=1e-6)
        for view, azimuth in enumerate(RENDER.azimuths):
            image = render(
                model.with_vertices(vertices),
                height=24,
                width=32,
                elevation=RENDER.elevation,
                azimuth=azimuth,
                samples=1,
            )
            np.testing.assert_array_equal(boxes.images[row, view], image)


def test_index(boxes):
    assert [boxes.index(i) for i in boxes.ids] == [0, 1, 2, 3]
    with pytest.raises(DataError, match="no model 'b9'"):
        boxes.index("b9")


def test_another_process_gets_the_path_and_not_the_arrays(boxes):
    data = pickle.dumps(boxes)
    assert len(data) < 1000
    assert pickle.loads(data).ids == boxes.ids


def test_nothing_is_pickled(boxes):
    for file in boxes.path.glob("*.npy"):
        assert np.load(file, allow_pickle=False).dtype != object
    suffixes = {file.suffix for file in boxes.path.iterdir()}
    assert suffixes == {".npy", ".json", ".csv"}


def truncate(path):
    path.write_bytes(path.read_bytes()[:-1])


def change_dtype(path):
    np.save(path, np.load(path).view(np.int32))


def swap(path):
    """Put another array of the set in its place."""
    path.write_bytes((path.parent / "vertices.npy").read_bytes())


def edit(**changes):
    def change(path):
        path.write_text(json.dumps(json.loads(path.read_text()) | changes))

    return change


@pytest.mark.parametrize(
    ("name", "damage"),
    [
        ("images.npy", truncate),
        ("images.npy", lambda path: path.unlink()),
        ("points.npy", change_dtype),
        ("face_ids.npy", lambda path: path.write_bytes(b"?" * path.stat().st_size)),
        ("points.npy", swap),
        ("manifest.json", lambda path: path.unlink()),
        ("manifest.json", lambda path: path.write_text("[]")),
        ("manifest.json", lambda path: path.write_text('{"ids": []')),
        ("manifest.json", edit(files={})),
        ("images.npy", edit(ids=["b00"])),
        ("rejected.csv", lambda path: path.unlink()),
    ],
)
def test_damage_is_named_on_opening(copy, name, damage):
    damage(copy / ("manifest.json" if damage.__name__ == "change" else name))
    with pytest.raises(DataError) as error:
        PreparedSet.open(copy)
    assert str(copy / name) in str(error.value)
    assert f"delete the folder {copy} and run the same command again" in str(error.value)


class Trap:
    def __reduce__(self):
        return Path.touch, (Path("sprung"),)


def test_pickled_objects_are_refused_and_never_run(copy, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save(copy / "points.npy", np.array([Trap()], object), allow_pickle=True)
    manifest = json.loads((copy / "manifest.json").read_text())
    manifest["files"]["points"]["bytes"] = (copy / "points.npy").stat().st_size
    (copy / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(DataError, match=r"points\.npy is damaged"):
        PreparedSet.open(copy)
    assert not Path("sprung").exists()


def test_verify_sees_a_changed_byte(copy):
    prepared = PreparedSet.open(copy)
    prepared.verify()
    data = bytearray((copy / "points.npy").read_bytes())
    data[-1] ^= 1
    (copy / "points.npy").write_bytes(data)
    with pytest.raises(DataError, match=r"points\.npy is damaged"):
        PreparedSet.open(copy).verify()
