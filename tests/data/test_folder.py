"""Miniature trees of good, messy and broken model files."""

import base64
import json
import os
import pickle
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from ffd_lightning.data.mesh import Mesh
from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.errors import DataError, RejectedModelError

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TEXTURED = TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nmtllib m.mtl\nusemtl m\nf 1/1 2/2 3/3\n"
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\n{colors}element face {count}\nproperty list uchar int vertex_indices\n"
    "end_header\n"
)


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


# --- where models are ---


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


# --- colours ---


def test_colours_and_transparency_of_mtl(tree: Tree) -> None:
    options = {
        "a": "d 0.5",
        "b": "Tr 0.25",
        "c": "d 0",
        "e": "d 1\nTr 1",
        "f": "d -halo 0.5",
        "g": "",
    }
    mtl = "".join(f"newmtl {name}\nKd 1 0 0.2\n{option}\n" for name, option in options.items())
    tree.write("chair/m/m.mtl", mtl + "newmtl no Kd\nNs 3\n")
    faces = "".join(f"usemtl {name}\nf 1 2 3\n" for name in [*options, "no Kd", "nowhere"])
    tree.write("chair/m/m.obj", "mtllib m.mtl\n" + TRIANGLE + faces)
    colors = sorted(map(tuple, tree.load().face_colors.tolist()))
    red = [(255, 0, 51, alpha) for alpha in (128, 128, 191, 255, 255, 255)]
    assert colors == sorted([*red, (178, 178, 178, 255), (178, 178, 178, 255)])


@pytest.mark.parametrize(
    "name",
    [
        "wood oak.png",
        "C:\\textures\\wood oak.png",
        "../elsewhere/WOOD OAK.PNG",
        "-s 1 1 1 -o 0 0 0 wood oak.png",
        "/abs/wood%20oak.png",
    ],
)
def test_textures_are_found_by_base_name_and_replace_kd(tree: Tree, name: str) -> None:
    tree.write("chair/m/m.mtl", f"newmtl m\nKd 0 0 0\nd 0.5\nmap_Kd {name}\n")
    tree.write("chair/m/m.obj", TEXTURED)
    tree.image("chair/m/images/wood oak.png", (10, 20, 30))
    mesh = tree.load()
    assert mesh.face_textures is not None
    assert mesh.face_uvs is not None
    np.testing.assert_array_equal(mesh.face_textures, [0])
    np.testing.assert_array_equal(mesh.textures[0][0, 0], [10, 20, 30, 128])
    np.testing.assert_array_equal(mesh.face_colors, [[10, 20, 30, 128]])
    corners = mesh.vertices[mesh.faces[0], :2]
    np.testing.assert_allclose(mesh.face_uvs[0], corners)  # uv = xy in this file


def test_the_namesake_nearest_to_the_named_path_is_taken(tree: Tree) -> None:
    tree.write("chair/m/m.mtl", "newmtl m\nmap_Kd b/x.png\n")
    tree.write("chair/m/m.obj", TEXTURED)
    tree.image("chair/m/x.png", (1, 1, 1))
    tree.image("chair/m/b/x.png", (2, 2, 2))
    assert tree.load().textures[0][0, 0, 0] == 2


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
    tree.write("chair/g.gltf", gltf(buffer=name.replace("png", "bin")))
    with pytest.raises(RejectedModelError, match="FileNotFoundError"):
        tree.load("g")


def test_damaged_and_huge_textures(tree: Tree) -> None:
    tree.write("chair/m/m.mtl", "newmtl m\nKd 0 1 0\nmap_Kd x.png\n")
    tree.write("chair/m/m.obj", TEXTURED)
    tree.image("chair/m/x.png", (5, 6, 7), size=(3000, 30))
    assert tree.load().textures[0].shape == (10, 1024, 4)
    whole = (tree.root / "chair/m/x.png").read_bytes()
    tree.write("chair/m/x.png", whole[: len(whole) // 2])
    np.testing.assert_array_equal(tree.load().face_colors, [[0, 255, 0, 255]])
    tree.image("chair/m/x.png", (5, 6, 7, 0))
    np.testing.assert_array_equal(tree.load().textures[0][0, 0], [5, 6, 7, 255])


def test_texture_without_uvs_gives_the_colour(tree: Tree) -> None:
    tree.write("chair/m/m.mtl", "newmtl m\nKd 0 1 0\nmap_Kd x.png\n")
    tree.write("chair/m/m.obj", "mtllib m.mtl\n" + TRIANGLE + "usemtl m\nf 1 2 3\n")
    tree.image("chair/m/x.png", (5, 6, 7))
    mesh = tree.load()
    np.testing.assert_array_equal(mesh.face_colors, [[0, 255, 0, 255]])
    assert mesh.textures == ()


def test_flat_models_share_the_textures_next_to_them(tree: Tree) -> None:
    tree.write("chair/m.obj", TEXTURED)
    tree.write("chair/m.mtl", "newmtl m\nmap_Kd x.png\n")
    tree.image("chair/textures/x.png", (5, 6, 7))
    np.testing.assert_array_equal(tree.load().face_colors, [[5, 6, 7, 255]])


def test_vertex_colours_are_averaged(tree: Tree) -> None:
    colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    rows = "0 0 0 30 0 0\n1 0 0 60 0 0\n0 1 0 90 30 0\n3 0 1 2\n"
    tree.write("chair/m.ply", PLY.format(colors=colors, count=1) + rows)
    np.testing.assert_array_equal(tree.load().face_colors, [[60, 10, 0, 255]])


def gltf(
    buffer: str | None = None, texture: str | None = None, nodes: list | None = None, **material
) -> str:
    """Return a glTF of one triangle with uv = (x, 1 - y), that is (x, y) with v upwards."""
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    data = b"".join(struct.pack("<3f", *c) for c in corners)
    data += b"".join(struct.pack("<2f", c[0], 1 - c[1]) for c in corners)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    views = [{"buffer": 0, "byteOffset": 0, "byteLength": 36}]
    views += [{"buffer": 0, "byteOffset": 36, "byteLength": 24}]
    accessors = [
        {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5126, "count": 3, "type": "VEC2"},
    ]
    pbr = {"baseColorFactor": material.pop("factor", [1, 1, 1, 1])}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": nodes or [{"mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}
        ],
        "materials": [{"pbrMetallicRoughness": pbr, **material}],
        "buffers": [{"byteLength": 60, "uri": buffer or uri}],
        "bufferViews": views,
        "accessors": accessors,
    }
    if texture:
        pbr["baseColorTexture"] = {"index": 0}
        tree |= {"textures": [{"source": 0}], "images": [{"uri": texture}]}
    return json.dumps(tree)


def test_gltf_colours(tree: Tree) -> None:
    # The factor is linear: 0.2140 is sRGB 0.5. Alpha counts only where the mode says so.
    tree.write("chair/opaque.gltf", gltf(factor=[0.2140, 0, 1, 0.4]))
    tree.write("chair/blend.gltf", gltf(factor=[0.2140, 0, 1, 0.4], alphaMode="BLEND"))
    np.testing.assert_array_equal(tree.load("opaque").face_colors, [[128, 0, 255, 255]])
    np.testing.assert_array_equal(tree.load("blend").face_colors, [[128, 0, 255, 102]])
    tree.write("chair/tex/a.gltf", gltf(texture="x.png", factor=[1, 0, 1, 1], alphaMode="MASK"))
    tree.image("chair/tex/x.png", (100, 100, 100, 140))
    mesh = tree.load("tex")
    np.testing.assert_array_equal(mesh.textures[0][0, 0], [100, 0, 100, 255])
    assert mesh.face_uvs is not None
    np.testing.assert_allclose(mesh.face_uvs[0], mesh.vertices[mesh.faces[0], :2])


def test_scene_graph_is_applied(tree: Tree) -> None:
    nodes = [
        {"children": [1, 2], "translation": [10, 0, 0]},
        {"mesh": 0},
        {"mesh": 0, "translation": [0, 5, 0], "scale": [2, 2, 2]},
    ]
    tree.write("chair/m.gltf", gltf(nodes=nodes))
    mesh = tree.load()
    assert area(mesh) == pytest.approx(0.5 + 2)
    np.testing.assert_allclose(mesh.vertices.min(0), [10, 0, 0])
    np.testing.assert_allclose(mesh.vertices.max(0), [12, 7, 0])


# --- geometry that can be mended ---

STL = "solid s\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
STL += "endloop\nendfacet\nendsolid s\n"
OFF = "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"

GOOD = {
    "n-gons": ("obj", "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n", 3, 4.0),
    "mixed": ("obj", TRIANGLE + "v 1 1 0\nv 0 0 1\nf 1 2 4 3\nf 1 2 5\n", 3, 1.5),
    "NaN face": ("obj", TRIANGLE + "v nan 0 0\nf 1 2 3\nf 1 2 4\n", 1, 0.5),
    "unused NaN": ("obj", TRIANGLE + "v nan inf 0\nf 1 2 3\n", 1, 0.5),
    "degenerate": ("obj", TRIANGLE + "f 1 2 3\nf 1 1 2\nf 3 3 3\n", 1, 0.5),
    "lines too": ("obj", TRIANGLE + "l 1 2\nf 1 2 3\n", 1, 0.5),
    "no newline": ("obj", TRIANGLE + "f 1 2 3", 1, 0.5),
    "latin-1": ("obj", b"# st\xfchle\ng l\xe4nge\n" + (TRIANGLE + "f 1 2 3\n").encode(), 1, 0.5),
    "utf-16": ("obj", (TRIANGLE + "f 1 2 3\n").encode("utf-16"), 1, 0.5),
    "OFF run in": ("off", "OFF" + OFF, 1, 0.5),
    "OFF": ("off", "OFF\n# c\n\n" + OFF, 1, 0.5),
    "STL": ("stl", STL, 1, 0.5),
    "PLY index": (
        "ply",
        PLY.format(colors="", count=2) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n3 0 1 9\n",
        1,
        0.5,
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", GOOD)
def test_good_enough_models_come_through(tree: Tree, name: str) -> None:
    extension, content, faces, expected = GOOD[name]
    tree.write(f"chair/m.{extension}", content)
    mesh = tree.load()
    assert len(mesh.faces) == faces
    assert area(mesh) == pytest.approx(expected)
    assert np.isfinite(mesh.vertices).all()
    assert (mesh.vertices.dtype, mesh.faces.dtype) == (np.float64, np.int64)
    assert (mesh.face_colors.shape, mesh.face_colors.dtype) == ((faces, 4), np.uint8)


def test_negative_indices_count_from_their_line(tree: Tree) -> None:
    first = TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nf -3/-3 -2/-2 -1/-1\n"
    second = "v 0 0 5\nv 3 0 5\nv 0 3 5\nvt 0 0\nf -3/-3 -2/-2 \\\n -1/-1\n"
    tree.write("chair/m.obj", first + second)
    mesh = tree.load()
    assert area(mesh) == pytest.approx(0.5 + 4.5)
    assert set(mesh.vertices[mesh.faces][..., 2].sum(1)) == {0, 15}


# --- geometry that cannot ---

BAD: dict[str, tuple[str, str | bytes, str]] = {
    "zero bytes": ("obj", b"", "m.obj is empty"),
    "only blanks": ("stl", " \n ", "is empty"),
    "text": ("obj", "It was a dark and stormy night.\n", "m.obj"),
    "text as glb": ("glb", "It was a dark and stormy night.\n" * 9, "m.glb"),
    "text as gltf": ("gltf", "{]", "m.gltf"),
    "text as ply": ("ply", "It was a dark night.\n", "m.ply"),
    "text as off": ("off", "It was a dark night.\n", "m.off"),
    "text as stl": ("stl", "It was a dark night.\n", "m.stl"),
    "noise": ("glb", bytes(range(256)) * 40, "m.glb"),
    "noise stl": ("stl", bytes(range(256)) * 40, "m.stl"),
    "image": ("obj", b"\x89PNG\r\n\x1a\n" + bytes(200), "m.obj"),
    "wrong extension": ("off", TRIANGLE + "f 1 2 3\n", "m.off"),
    "all NaN": ("obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "no face with a finite area"),
    "point": ("obj", "v 1 1 1\n" * 3 + "f 1 2 3\n", "no face with a finite area"),
    "line": ("obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", "no face with a finite area"),
    "infinite": ("obj", "v 1e300 0 0\nv 0 1e300 0\nv 0 0 1\nf 1 2 3\n", "no face with a finite"),
    "only lines": ("obj", TRIANGLE + "l 1 2 3\n", "no faces"),
    "only points": ("obj", TRIANGLE, "no faces"),
    "point cloud": ("ply", PLY.format(colors="", count=0) + "0 0 0\n1 0 0\n0 1 0\n", "no faces"),
    "ply promises": ("ply", PLY.format(colors="", count=10**12) + "0 0 0\n", "m.ply"),
    "truncated ply": ("ply", PLY.format(colors="", count=9) + "0 0 0\n1 0 0\n", "m.ply"),
    "promises": ("off", "OFF\n999999999999 9 0\n0 0 0\n", "m.off"),
    "bad index": ("obj", TRIANGLE + "f 1 2 9\n", "m.obj"),
    "Draco": ("gltf", '{"extensionsUsed": ["KHR_draco_mesh_compression"]}', "Draco"),
    "empty scene": ("gltf", '{"asset": {"version": "2.0"}}', "m.gltf"),
    "missing": ("gltf", gltf(buffer="lost.bin"), "FileNotFoundError"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_models_are_rejected_with_a_reason(tree: Tree, name: str) -> None:
    extension, content, reason = BAD[name]
    tree.write(f"chair/m.{extension}", content)
    with pytest.raises(RejectedModelError, match=reason) as caught:
        tree.load()
    assert "\n" not in str(caught.value)


WHOLE: dict[str, Callable[[], bytes]] = {
    "gltf": lambda: gltf().encode(),
    "ply": lambda: (PLY.format(colors="", count=1) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").encode(),
    "stl": lambda: bytes(80) + struct.pack("<I12fH", 1, *[0.0] * 3, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0),
    "off": lambda: ("OFF\n" + OFF).encode(),
    "obj": lambda: TEXTURED.encode(),
}


@pytest.mark.parametrize("extension", WHOLE)
def test_a_file_cut_anywhere_loads_or_is_rejected(tree: Tree, extension: str) -> None:
    whole = WHOLE[extension]()
    tree.write(f"chair/m.{extension}", whole)
    assert area(tree.load()) == pytest.approx(0.5)
    rejected = 0
    for end in range(1, len(whole), max(1, len(whole) // 40)):
        tree.write(f"chair/m.{extension}", whole[:end])
        try:
            tree.load()
        except RejectedModelError:
            rejected += 1
    assert rejected > 20


def test_a_file_that_vanished_is_rejected(tree: Tree) -> None:
    path = tree.write("chair/m.obj", TRIANGLE + "f 1 2 3\n")
    assert tree.source.model_ids("chair") == ["m"]
    path.unlink()
    with pytest.raises(RejectedModelError, match=r"^m\.obj cannot be read"):
        tree.source.load("chair", "m")
