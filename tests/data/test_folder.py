import errno
import json
import os
import pickle
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from trees import TEXTURED, TRIANGLE, area, png, write_folder

from ffd_lightning.data.reading.orientation import Up, turn
from ffd_lightning.data.sources.folder import FolderSource, MeshFiles, name_files
from ffd_lightning.errors import DataError, RejectedShapeError

OBJ = TRIANGLE + "f 1 2 3\n"
GLTF = '{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36, "uri": "%s"}]}'


@pytest.fixture
def root(tmp_path):
    return tmp_path / "shapes"


def load(root, shape="m"):
    return FolderSource(root).load("chair", shape).mesh


def test_shapes_are_folders_and_files_at_any_depth(root):
    found = ["UPPER.OBJ", "flat.obj", "in folder/a.obj", "nested/models/x.obj", "stühle 椅子/ü.obj"]
    found += ["nested.obj", "st\udcfchle.obj"]  # a folder's name; bytes of an older system
    passed_over = ["textures/wood.png", ".hidden.obj", "__MACOSX/._flat.obj", "readme.txt"]
    write_folder(root, {f"chair/{name}": OBJ for name in found + passed_over})
    source = FolderSource(root)
    ids = ["UPPER", "flat", "in folder", "nested", "nested.obj", r"st\udcfchle", "stühle 椅子"]
    assert source.shape_ids("chair") == ids
    for shape_id in ids:
        assert area(pickle.loads(pickle.dumps(source)).load("chair", shape_id).mesh) == 0.5


def test_categories_are_named_by_the_project_or_by_their_synsets(root):
    names = ("03001627", "vase", "table", "04379243", "99999999", ".git", "__MACOSX")
    write_folder(root, {f"{name}/m.obj": OBJ for name in names} | {"readme.txt": ""})
    source = FolderSource(root)
    assert source.categories() == ["99999999", "chair", "table", "vase"]
    assert all(source.shape_ids(name) == ["m"] for name in source.categories())


def test_what_is_missing_is_named_with_what_there_is(root):
    source = FolderSource(root)
    for ask in (lambda _: source.categories(), source.shape_ids):
        with pytest.raises(DataError, match="shapes does not exist"):
            ask("chair")
    write_folder(root, {"04379243/m.obj": "", "vase/m.obj": "", "lamp/readme.txt": ""})
    for ask in (source.shape_ids, source.fingerprint):
        with pytest.raises(DataError, match=r"'03001627'; it has: table \(04379243\), lamp, vase"):
            ask("chair")
    for outside in ("..", "../shapes/vase", "", "."):
        with pytest.raises(DataError, match="has no folder"):
            source.shape_ids(outside)
    with pytest.raises(DataError, match=r"lamp holds no shapes.*glb, gltf, obj"):
        source.shape_ids("lamp")
    with pytest.raises(RejectedShapeError, match="no shape 'nobody'"):
        source.load("vase", "nobody")
    with pytest.raises(DataError, match=rf"set data\.root={root}$"):
        FolderSource(root / "vase").shape_ids("vase")


@pytest.mark.parametrize(
    ("names", "chosen"),
    [
        (["a.glb", "model_normalized.obj"], "model_normalized.obj"),
        (["models/model.obj", "a.obj"], "model.obj"),
        (["a.stl", "m.ply"], "m.ply"),
        (["a.obj", "b.gltf"], "b.gltf"),
        (["b.stl", "a.stl"], "a.stl"),
    ],
)
def test_of_several_files_the_documented_one_is_taken(root, names, chosen):
    write_folder(root, {f"chair/m/{name}": "" for name in names})
    with pytest.raises(RejectedShapeError, match=f"^{chosen} is empty$"):
        load(root)


def test_one_of_several_meshes_is_taken_with_a_warning_unless_it_is_named(root):
    write_folder(root, {f"chair/{x}.obj": OBJ for x in ("m/b", "m/a", "n/b", "n/n", "n", "c", "d")})
    shapes = ("m", "n", "n.obj", "c", "d")
    said = {i: FolderSource(root).load("chair", i).warning for i in shapes}
    assert said.pop("m") == "folders of several meshes, of which one is taken: a.obj"
    assert not any(said.values())


def test_formats_that_are_not_read_are_named_with_the_way_out(root):
    texture, mtl = png((5, 6, 7)), "newmtl m\nmap_Kd x.png\n"
    foreign = {"a b.AC": "AC3D\0", "in folder/x.dae": "<", "c.skp": "?", "m.blend": "?"}
    files = {"m.obj": TEXTURED, "m.mtl": mtl, "in folder/x.png": texture, **foreign}
    source = FolderSource(write_folder(root, {f"chair/{name}": files[name] for name in files}))
    assert source.shape_ids("chair") == ["a b", "c", "in folder", "m"]
    np.testing.assert_array_equal(load(root).face_colors, [[5, 6, 7, 255]])
    said = source.rejected("chair")
    assert "`assimp export 'a b.AC' 'a b.obj'`" in said["a b"]
    assert "`assimp export x.dae x.obj`" in said["in folder"]
    assert set(said) == {"a b", "c", "in folder"}
    for shape_id, why in said.items():
        with pytest.raises(RejectedShapeError) as raised:
            source.load("chair", shape_id)
        assert str(raised.value) == why


def test_what_is_white_all_over_is_drawn_in_grey(root):
    colored = "newmtl m\nKd 1 1 1\nd 0.5\nnewmtl n\nKd 1 1 0.99\n"
    faces = "mtllib m.mtl\n" + TRIANGLE + "usemtl m\nf 1 2 3\n"
    files = {"chair/m.obj": faces, "chair/n.obj": faces + "usemtl n\nf 1 2 3\n"}
    source = FolderSource(write_folder(root, files | {"chair/m.mtl": colored}))
    white, other = (source.load("chair", name) for name in "mn")
    np.testing.assert_array_equal(white.mesh.face_colors, [[178, 178, 178, 128]])
    assert "grey" in white.warning
    assert (other.mesh.face_colors.max(), other.warning) == (255, "")


def test_fingerprint_follows_every_change(root):
    write_folder(root, {"chair/m/m.obj": "one", "table/t.obj": ""})
    source, mesh = FolderSource(root), root / "chair" / "m" / "m.obj"
    seen = [source.fingerprint("chair")]
    wood = root / "chair/m/textures/wood.png"
    for change, changes in (
        (lambda: write_folder(root, {"table/u.obj": "", "chair/m/readme.txt": ""}), False),
        (lambda: os.utime(mesh, ns=(5, 5)), True),
        (lambda: mesh.write_text("longer"), True),
        (lambda: write_folder(root, {"chair/m/textures/wood.png": ""}), True),
        (lambda: wood.rename(wood.with_name("oak.png")), True),
        (lambda: write_folder(root, {"chair/n.obj": ""}), True),
    ):
        change()
        found = source.fingerprint("chair")
        assert (found not in seen) == changes
        seen.append(found)
    json.dumps(seen)


@pytest.mark.parametrize(
    "name", ["../../../secret.png", "{root}/../secret.png", "http://localhost:9/secret.png"]
)
def test_nothing_outside_the_shape_is_read(root, name):
    name = name.format(root=root)
    files = {path: png() for path in ("../secret.png", "chair/other/secret.png")}
    files |= {"chair/other/o.obj": TEXTURED, "chair/m/m.obj": TEXTURED, "secret.bin": bytes(36)}
    files["chair/m/m.mtl"] = f"newmtl m\nKd 0 1 0\nmap_Kd {name}\n"
    files["chair/g.gltf"] = GLTF % name.replace("png", "bin")
    mesh = load(write_folder(root, files))
    assert mesh.textures == ()
    np.testing.assert_array_equal(mesh.face_colors, [[178, 178, 178, 255]])
    with pytest.raises(RejectedShapeError, match="FileNotFoundError"):
        load(root, "g")


@pytest.mark.parametrize("name", ["m.obj", "m.mtl", "x.png"])
def test_a_disk_that_fails_is_no_fault_of_the_shape(root, monkeypatch, name):
    """Whatever the file: trimesh passes over errors with materials and textures."""
    files = {"m.obj": TEXTURED, "m.mtl": "newmtl m\nmap_Kd x.png\n", "x.png": png()}
    write_folder(root / "chair" / "m", files)
    opened = Path.open

    def fail(path, *args, **kwargs):
        if path.name == name:
            raise OSError(errno.EIO, "Input/output error", str(path))
        return opened(path, *args, **kwargs)

    monkeypatch.setattr(Path, "open", fail)
    with pytest.raises(OSError, match="Input/output"):
        load(root)


def test_folders_of_shapes_may_be_links(root):
    write_folder(root, {"elsewhere/m.obj": OBJ})
    (root / "chair").mkdir()
    (root / "chair/linked").symlink_to(root / "elsewhere", target_is_directory=True)
    (root / "elsewhere/circular.obj").symlink_to(root / "elsewhere/circular.obj")
    before = FolderSource(root).fingerprint("chair")
    write_folder(root, {"elsewhere/m.mtl": ""})
    assert FolderSource(root).fingerprint("chair") != before
    assert len(load(root, "linked").faces) == 1


def test_materials_are_found_beside_a_file_and_decide_what_is_prepared(tmp_path):
    files = {"a.obj": TEXTURED, "m.mtl": "newmtl m\nmap_Kd maps/wood.png\n"}
    write_folder(tmp_path, {**files, "maps/wood.png": png((200, 30, 30)), "far/away/x.png": ""})
    source = MeshFiles(name_files([tmp_path / "a.obj"]), yaw=180)
    shape = pickle.loads(pickle.dumps(source)).load("any", "a")
    assert shape.mesh.textures[0][0, 0].tolist() == [200, 30, 30, 255]
    assert shape.mesh.vertices.min(axis=0).tolist() == [-1, 0, 0]
    before = source.fingerprint("any")
    write_folder(tmp_path, {"far/away/x.png": "of no shape", "log.txt": "what is printed"})
    assert source.fingerprint("any") == before
    write_folder(tmp_path, {"maps/wood.png": png((30, 200, 30), (4, 4))})
    assert source.fingerprint("any") != before


CORNERS = np.array([[0.1, 0.2, 0.3], [1 / 3, -5, 1e-9], [-7e8, 0.7, np.pi]])


def test_turns_are_exact_by_quarters_and_do_not_mirror():
    x, y, z = CORNERS.T
    for up, yaw, expected in [
        ("y", 0, (x, y, z)),
        ("y", 90, (z, y, -x)),
        ("y", -90, (-z, y, x)),
        ("z", 0, (x, z, -y)),
        ("z", 450.0, (-y, z, -x)),
    ]:
        np.testing.assert_array_equal(turn(CORNERS, up, yaw), np.stack(expected, 1))
    np.testing.assert_allclose(turn(CORNERS, "y", 90), turn(CORNERS, "y", 90 + 1e-13), rtol=1e-6)
    quarters = CORNERS
    for _ in range(4):
        quarters = turn(quarters, "y", 90)
    np.testing.assert_array_equal(quarters, CORNERS)
    for up, axis in zip(get_args(Up), ("y", "z", "x", "-y", "-z", "-x"), strict=True):
        matrix = turn(np.eye(3), up, 33.3)
        np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-15)
        assert np.linalg.det(matrix) == pytest.approx(1)
        upwards = np.eye(3)["xyz".index(axis[-1])] * (-1 if axis[0] == "-" else 1)
        np.testing.assert_array_equal(turn(upwards, up, 33.3), [0, 1, 0])


def test_single_shapes_stand_as_their_table_says(root):
    names = ("a", "b", "c d", "e")
    write_folder(
        root, {f"chair/{name}.obj": "v 1 2 3\nv 4 5 6\nv 7 8 1\nf 1 2 3\n" for name in names}
    )
    table = root / "chair/orientations.csv"
    before = FolderSource(root, "z", 90).fingerprint("chair")
    others = [FolderSource(root, *pose).fingerprint("chair") for pose in ((), ("z",))]
    assert before != others[0] != others[1] != before
    with pytest.raises(ValueError, match="must be"):
        FolderSource(root, up="w")
    table.write_text("\ufeffid, up, yaw\na, y, 180\n\nb,,270\nc d,-x,\n", encoding="utf-8")
    source = FolderSource(root, "z", 90)
    expected = {"a": ("y", 180), "b": ("z", 270), "c d": ("-x", 90), "e": ("z", 90)}
    for name, pose in expected.items():
        turned = turn([[1, 2, 3], [4, 5, 6], [7, 8, 1]], *pose)
        np.testing.assert_array_equal(source.load("chair", name).mesh.vertices, turned)
    seen = source.fingerprint("chair")
    assert {**seen, "orientations": None} == {**before, "orientations": None}
    os.utime(table, ns=(5, 5))
    assert source.fingerprint("chair") == seen
    table.write_text("id,yaw\na,180\n")
    assert source.fingerprint("chair")["orientations"] == {"a": ("z", 180)}


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("id;yaw\na;90\n", "line 1: "),
        ("id,yaw\n\nbeta,90\n", r"line 3: .*'beta'\. Did you mean betty\?"),
        ("id,yaw\na,9O\n", "line 2: .*9O"),
        ("id,yaw\na,1\na,1\n", "line 3: a is there twice"),
    ],
)
def test_what_is_wrong_in_the_table_is_named_with_its_line(root, table, said):
    write_folder(root, {"chair/a.obj": OBJ, "chair/betty.obj": OBJ})
    write_folder(root, {"chair/orientations.csv": table})
    for ask in (FolderSource(root).shape_ids, FolderSource(root).fingerprint):
        with pytest.raises(DataError, match=rf"orientations\.csv, {said}"):
            ask("chair")
