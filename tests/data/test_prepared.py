import hashlib
import json
import os
import pickle
import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from box_source import RENDER, BoxSource, box_mesh, prepare_boxes

from ffd_lightning.data.preparation import prepared
from ffd_lightning.data.preparation.packing import POINT_STEP
from ffd_lightning.data.preparation.prepared import PreparedSet, file_digest, manifest_digest
from ffd_lightning.errors import DataError
from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render


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
    images, meshes = boxes.arrays["image_offsets"][-1], boxes.arrays["mesh_offsets"][-1]
    assert shapes == {
        "images": ((images,), "uint8"),
        "image_offsets": ((4 * 2 + 1,), "int64"),
        "cameras": ((4, 2, 7), "float64"),
        "points": ((4, 50, 3), "int16"),
        "meshes": ((meshes,), "uint8"),
        "mesh_offsets": ((5,), "int64"),
    }
    assert boxes.image_shape == (2, 24, 32, 4)
    assert boxes.num_points == 50
    assert all(isinstance(a, np.memmap) and not a.flags.writeable for a in boxes.arrays.values())


def test_views_spread_over_rows(boxes):
    for rows, count, expected in (
        ([0, 1, 2, 3], 9, [(0, 0), (1, 1), (2, 0), (3, 1)]),
        (np.array([3, 1, 0]), 2, [(3, 0), (0, 1)]),
    ):
        assert boxes.spread_views(rows, count) == expected


def test_arrays_agree_with_the_model_and_each_other(boxes):
    for row in range(len(boxes)):
        model, mesh = box_mesh(row), boxes.mesh(row)
        vertices = normalize(model.vertices, model.faces)
        np.testing.assert_allclose(mesh.vertices, vertices, atol=1e-6)
        np.testing.assert_array_equal(mesh.faces, model.faces)
        names = [model.part_names[p] for p in model.face_parts]
        assert [mesh.part_names[p] for p in mesh.face_parts] == names
        cloud, parts = boxes.cloud(row), boxes.point_parts(row)
        off = planes(mesh, cloud)
        assert off.min(axis=1).max() < 2 * POINT_STEP, "every point lies on a face"
        for point, part in zip(off, parts, strict=True):
            near = mesh.face_parts[point < 2 * POINT_STEP]
            assert part in near, "and has the part of one that it lies on"
        for view, azimuth in enumerate(RENDER.azimuths):
            camera = boxes.camera(row, view)
            assert camera == Camera(azimuth, 30.0)
            shape = model.with_vertices(vertices)
            image = render(shape, camera, height=24, width=32, samples=1)
            np.testing.assert_array_equal(boxes.image(row, view), image)


def test_index(boxes):
    assert [boxes.index(i) for i in boxes.ids] == [0, 1, 2, 3]
    with pytest.raises(DataError, match="no shape 'b9'"):
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
    np.save(path, np.load(path).view(np.uint16))


def flip(path):
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def swap(path):
    """Put another array of the set in its place."""
    path.write_bytes((path.parent / "images.npy").read_bytes())


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
        ("mesh_offsets.npy", lambda path: path.write_bytes(b"?" * path.stat().st_size)),
        ("points.npy", swap),
        ("manifest.json", lambda path: path.unlink()),
        ("manifest.json", lambda path: path.write_text("[]")),
        ("manifest.json", lambda path: path.write_text('{"ids": []')),
        ("manifest.json", edit(files={})),
        ("manifest.json", edit(ids=["b00"])),
        ("manifest.json", edit(models=3)),
        ("points.npy", flip),
        ("images.npy", flip),
        ("meshes.npy", flip),
        ("rejected.csv", lambda path: path.write_text("id,whyyy\n")),
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
    file = copy / "points.npy"
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    manifest["files"]["points.npy"] = {"bytes": file.stat().st_size, "sha256": digest}
    manifest["sha256"] = manifest_digest(manifest)
    (copy / "manifest.json").write_text(json.dumps(manifest))
    with pytest.raises(DataError, match=r"points\.npy is damaged"):
        PreparedSet.open(copy)
    assert not Path("sprung").exists()


def test_checksums_are_compared_again_only_where_files_changed(copy, monkeypatch):
    counted = []

    def digest(path):
        counted.append(path.name)
        return file_digest(path)

    monkeypatch.setattr(prepared, "file_digest", digest)
    PreparedSet.open(copy)
    assert sorted(counted) == sorted(prepared.FILES)
    counted.clear()
    PreparedSet.open(copy)
    assert counted == []
    os.utime(copy / "points.npy", (0, 0))
    PreparedSet.open(copy)
    assert sorted(counted) == sorted(prepared.FILES)


def test_a_set_that_others_own_is_checked_all_the_same(copy, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError

    monkeypatch.setattr(Path, "write_text", refuse)
    PreparedSet.open(copy)
    flip(copy / "meshes.npy")
    with pytest.raises(DataError, match=r"meshes\.npy is damaged"):
        PreparedSet.open(copy)


def test_damage_after_opening_is_named_on_reading(copy):
    opened = PreparedSet.open(copy)
    for name, read in (("images.npy", opened.image), ("meshes.npy", opened.mesh)):
        with (copy / name).open("r+b") as file:
            file.seek(140)
            file.write(bytes(40))
        with pytest.raises(DataError, match=rf"{name} is damaged"):
            read(0)


def planes(mesh, points):
    """Return how far each point is from each triangle, (N, F)."""
    distances = []
    for face in mesh.faces:
        triangle = np.repeat(mesh.vertices[face][None], len(points), 0)
        nearest = trimesh.triangles.closest_point(triangle, points)
        distances.append(np.linalg.norm(nearest - points, axis=1))
    return np.stack(distances, axis=1)
