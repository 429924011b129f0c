"""Miniature trees of models."""

import json
import os
import pickle
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ffd_lightning.data.mesh import Mesh
from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.errors import DataError, RejectedModelError

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TEXTURED = TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nmtllib m.mtl\nusemtl m\nf 1/1 2/2 3/3\n"
GLTF = '{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36, "uri": "%s"}]}'


class Tree:
    """Writes files below a root and loads models from it."""

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
    assert tree.source.model_ids("chair") == ids
    source = pickle.loads(pickle.dumps(tree.source))
    for model in ids:
        loaded = source.load("chair", model)
        assert area(loaded.mesh) == pytest.approx(0.5)
        assert loaded.family == ""
        assert loaded.mesh.face_parts is None


def test_category_may_be_named_by_its_synset(tree: Tree) -> None:
    tree.write("03001627/m.obj", TRIANGLE + "f 1 2 3\n")
    assert tree.source.model_ids("chair") == ["m"]
    assert len(tree.load().faces) == 1


def test_what_is_missing_is_named_with_what_there_is(tree: Tree) -> None:
    with pytest.raises(DataError, match="models does not exist"):
        tree.source.model_ids("chair")
    tree.write("04379243/m.obj", "")
    tree.write("vase/m.obj", "")
    for ask in (tree.source.model_ids, tree.source.fingerprint):
        with pytest.raises(DataError, match=r"'chair' or '03001627'.*table \(04379243\), vase"):
            ask("chair")
    for outside in ("..", "../models/vase", "", "."):
        with pytest.raises(DataError, match="has no folder"):
            tree.source.model_ids(outside)
    tree.write("lamp/readme.txt", "")
    with pytest.raises(DataError, match=r"lamp holds no models.*glb, gltf, obj"):
        tree.source.model_ids("lamp")
    with pytest.raises(RejectedModelError, match="no model 'nobody'"):
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
    with pytest.raises(RejectedModelError, match=f"^{Path(chosen).name} is empty$"):
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
    np.testing.assert_array_equal(mesh.face_colors, [[0, 255, 0, 255]])
    tree.write("secret.bin", bytes(36))
    tree.write("chair/g.gltf", GLTF % name.replace("png", "bin"))
    with pytest.raises(RejectedModelError, match="FileNotFoundError"):
        tree.load("g")


def test_a_file_that_vanished_is_rejected(tree: Tree) -> None:
    path = tree.write("chair/m.obj", TRIANGLE + "f 1 2 3\n")
    assert tree.source.model_ids("chair") == ["m"]
    path.unlink()
    with pytest.raises(RejectedModelError, match=r"^m\.obj cannot be read"):
        tree.source.load("chair", "m")
