"""Miniature trees of shapes."""

import errno
import json
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.data.reading.orientation import orient, turn
from ffd_lightning.data.source import Source
from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.errors import DataError, RejectedShapeError
from ffd_lightning.geometry.mesh import Mesh

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TEXTURED = TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nmtllib m.mtl\nusemtl m\nf 1/1 2/2 3/3\n"
GLTF = '{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36, "uri": "%s"}]}'


class Tree:
    """Writes files below a root and loads shapes from it."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.source = FolderSource(root)

    def write(self, name: str, content: str | bytes) -> Path:
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return path

    def image(self, name: str, color: tuple[int, ...], size: tuple[int, int] = (4, 4)) -> None:
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        Image.new("RGB" if len(color) == 3 else "RGBA", size, color).save(path)

    def load(self, model: str = "m", category: str = "chair") -> Mesh:
        return FolderSource(self.root).load(category, model).mesh


@pytest.fixture
def tree(tmp_path: Path) -> Tree:
    return Tree(tmp_path / "models")


def area(mesh: Mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_models_are_folders_and_files_at_any_depth(tree: Tree) -> None:
    obj = TRIANGLE + "f 1 2 3\n"
    tree.write("chair/flat.obj", obj)
    tree.write("chair/UPPER.OBJ", obj)
    tree.write("chair/in folder/a.obj", obj)
    tree.write("chair/nested/models/model_normalized.obj", obj)
    tree.write("chair/stühle 椅子/ü.obj", obj)
    tree.write("chair/textures/wood.png", b"")
    tree.write("chair/.hidden.obj", obj)
    tree.write("chair/__MACOSX/._flat.obj", obj)
    tree.write("chair/readme.txt", "")
    ids = ["UPPER", "flat", "in folder", "nested", "stühle 椅子"]
    assert tree.source.shape_ids("chair") == ids
    source = pickle.loads(pickle.dumps(tree.source))
    for model in ids:
        loaded = source.load("chair", model)
        assert area(loaded.mesh) == pytest.approx(0.5)
        assert loaded.family == ""
        assert loaded.mesh.face_parts is None


def test_category_may_be_named_by_its_synset(tree: Tree) -> None:
    tree.write("03001627/m.obj", TRIANGLE + "f 1 2 3\n")
    assert tree.source.shape_ids("chair") == ["m"]
    assert len(tree.load().faces) == 1


def test_what_is_missing_is_named_with_what_there_is(tree: Tree) -> None:
    with pytest.raises(DataError, match="models does not exist"):
        tree.source.shape_ids("chair")
    tree.write("04379243/m.obj", "")
    tree.write("vase/m.obj", "")
    for ask in (tree.source.shape_ids, tree.source.fingerprint):
        with pytest.raises(DataError, match=r"'chair' or '03001627'.*table \(04379243\), vase"):
            ask("chair")
    for outside in ("..", "../models/vase", "", "."):
        with pytest.raises(DataError, match="has no folder"):
            tree.source.shape_ids(outside)
    tree.write("lamp/readme.txt", "")
    with pytest.raises(DataError, match=r"lamp holds no shapes.*glb, gltf, obj"):
        tree.source.shape_ids("lamp")
    with pytest.raises(RejectedShapeError, match="no shape 'nobody'"):
        tree.source.load("vase", "nobody")


@pytest.mark.parametrize(
    ("names", "chosen"),
    [
        (["a.glb", "model_normalized.obj"], "model_normalized.obj"),
        (["models/model.obj", "a.obj"], "models/model.obj"),
        (["a.stl", "m.ply"], "m.ply"),
        (["a.obj", "b.gltf"], "b.gltf"),
        (["deep/a.off", "b.off"], "b.off"),
        (["b.stl", "a.stl"], "a.stl"),
    ],
)
def test_of_several_files_the_documented_one_is_taken(tree: Tree, names, chosen) -> None:
    for name in names:
        tree.write(f"chair/m/{name}", b"")
    with pytest.raises(RejectedShapeError, match=f"^{Path(chosen).name} is empty$"):
        tree.load()


def test_fingerprint_follows_every_change(tree: Tree) -> None:
    mesh = tree.write("chair/m/m.obj", "one")
    tree.write("table/t.obj", "")
    seen = [tree.source.fingerprint("chair")]

    def changed() -> bool:
        seen.append(tree.source.fingerprint("chair"))
        return seen[-1] not in seen[:-1]

    os.utime(tree.write("table/u.obj", ""), ns=(1, 1))
    assert not changed()
    os.utime(mesh, ns=(5, 5))
    assert changed()
    mesh.write_text("longer")
    assert changed()
    side = tree.write("chair/m/textures/wood.png", "")
    assert changed()
    side.rename(side.with_name("oak.png"))
    assert changed()
    (side.with_name("oak.png")).unlink()
    tree.write("chair/n.obj", "")
    assert changed()
    json.dumps(seen)


def test_flat_models_share_the_textures_next_to_them(tree: Tree) -> None:
    tree.write("chair/m.obj", TEXTURED)
    tree.write("chair/m.mtl", "newmtl m\nmap_Kd x.png\n")
    tree.image("chair/textures/x.png", (5, 6, 7))
    np.testing.assert_array_equal(tree.load().face_colors, [[5, 6, 7, 255]])


@pytest.mark.parametrize(
    "name", ["../../../secret.png", "{root}/../secret.png", "http://localhost:9/secret.png"]
)
def test_nothing_outside_the_model_is_read(tree: Tree, name: str) -> None:
    tree.image("../secret.png", (1, 2, 3))
    tree.image("chair/other/secret.png", (1, 2, 3))
    tree.write("chair/other/o.obj", TEXTURED)
    name = name.format(root=tree.root)
    tree.write("chair/m/m.mtl", f"newmtl m\nKd 0 1 0\nmap_Kd {name}\n")
    tree.write("chair/m/m.obj", TEXTURED)
    mesh = tree.load()
    assert mesh.textures == ()
    assert mesh.face_textures is None
    np.testing.assert_array_equal(mesh.face_colors, [[178, 178, 178, 255]])
    tree.write("secret.bin", bytes(36))
    tree.write("chair/g.gltf", GLTF % name.replace("png", "bin"))
    with pytest.raises(RejectedShapeError, match="FileNotFoundError"):
        tree.load("g")


@pytest.mark.parametrize("name", ["m.obj", "m.mtl", "x.png"])
def test_a_disk_that_fails_is_no_fault_of_the_shape(tree: Tree, monkeypatch, name) -> None:
    """Whatever the file: trimesh passes over errors with materials and textures."""
    tree.write("chair/m/m.obj", TEXTURED)
    tree.write("chair/m/m.mtl", "newmtl m\nmap_Kd x.png\n")
    tree.image("chair/m/x.png", (5, 6, 7))
    read = Path.read_bytes

    def fail(path):
        if path.name == name:
            raise OSError(errno.EIO, "Input/output error", str(path))
        return read(path)

    monkeypatch.setattr(Path, "read_bytes", fail)
    with pytest.raises(OSError, match="Input/output"):
        tree.load()


def test_folders_of_shapes_may_be_links(tree: Tree) -> None:
    elsewhere = tree.write("elsewhere/m.obj", TRIANGLE + "f 1 2 3\n").parent
    (tree.root / "chair").mkdir()
    (tree.root / "chair/linked").symlink_to(elsewhere, target_is_directory=True)
    assert tree.source.shape_ids("chair") == ["linked"]
    before = tree.source.fingerprint("chair")
    tree.write("elsewhere/m.mtl", "")
    assert tree.source.fingerprint("chair") != before
    assert len(tree.load("linked").faces) == 1


def test_the_folder_of_the_category_itself_is_recognised(tree: Tree) -> None:
    tree.write("chair/a/m.obj", TRIANGLE + "f 1 2 3\n")
    with pytest.raises(DataError, match=rf"set data\.root={tree.root}$"):
        FolderSource(tree.root / "chair").shape_ids("chair")


def test_categories_are_named_by_the_project(tree: Tree) -> None:
    assert isinstance(tree.source, Source)
    with pytest.raises(DataError, match="models does not exist"):
        tree.source.categories()
    for name in ("03001627", "vase", "table", "04379243", "99999999", ".git", "__MACOSX"):
        tree.write(f"{name}/m.obj", TRIANGLE + "f 1 2 3\n")
    tree.write("readme.txt", "")
    assert tree.source.categories() == ["99999999", "chair", "table", "vase"]
    assert all(tree.source.shape_ids(name) == ["m"] for name in tree.source.categories())
    assert tree.source.split("chair") == {}


# --- the frame ---

CORNERS = np.array([[0.1, 0.2, 0.3], [1 / 3, -5, 1e-9], [-7e8, 0.7, np.pi]])


def test_models_are_turned_as_asked(tree: Tree) -> None:
    file = tree.write("chair/m.obj", "v 1 2 3\nv 4 5 6\nv 7 8 1\nf 1 2 3\n")
    given, _ = read_mesh(file)
    np.testing.assert_array_equal(tree.load().vertices, given.vertices)
    x, y, z = given.vertices.T
    for up, yaw, expected in [
        ("y", 90, (z, y, -x)),
        ("y", -90, (-z, y, x)),
        ("y", 180, (-x, y, -z)),
        ("z", 0, (x, z, -y)),
        ("z", 450.0, (-y, z, -x)),
    ]:
        mesh = FolderSource(tree.root, up, yaw).load("chair", "m").mesh
        np.testing.assert_array_equal(mesh.vertices, np.stack(expected, 1))
        np.testing.assert_array_equal(mesh.faces, given.faces)
    settings = [("y", 0.0), ("z", 0.0), ("y", 1.0)]
    seen = [json.dumps(FolderSource(tree.root, *s).fingerprint("chair")) for s in settings]
    assert len(set(seen)) == 3


def test_nothing_is_touched_where_nothing_is_to_be_turned() -> None:
    colors = np.full((1, 4), 9, np.uint8)
    mesh = Mesh(CORNERS, np.array([[0, 1, 2]]), colors, np.array([0], np.uint8), ("seat",))
    for yaw in (0.0, 360.0, -720.0):
        assert orient(mesh, "y", yaw) is mesh
    turned = orient(mesh, "z", 30.0)
    assert turned.part_names == ("seat",)
    assert turned.face_parts is mesh.face_parts
    assert turned.face_colors is colors


def test_turns_are_anticlockwise_from_above_and_do_not_mirror() -> None:
    front = [0, 0, -1]
    assert turn(front, "y", 90).tolist() == [-1, 0, 0]
    x, _, z = turn(front, "y", 30)
    assert (x, z) == pytest.approx((-0.5, -np.sqrt(0.75)))
    np.testing.assert_allclose(turn(CORNERS, "y", 90), turn(CORNERS, "y", 90 + 1e-13), rtol=1e-6)
    quarters = CORNERS
    for _ in range(4):
        quarters = turn(quarters, "y", 90)
    np.testing.assert_array_equal(quarters, CORNERS)
    for up in ("y", "z"):
        for yaw in (0, 90, 180, 270, 33.3):
            matrix = turn(np.eye(3), up, yaw)
            np.testing.assert_allclose(matrix @ matrix.T, np.eye(3), atol=1e-15)
            assert np.linalg.det(matrix) == pytest.approx(1)
    assert turn([0, 0, 1], "z", 77).tolist() == [0, 1, 0]
    for up, yaw in (("x", 0.0), ("y", np.nan)):
        with pytest.raises(ValueError, match="must be"):
            FolderSource(Path(), up=up, yaw=yaw)
