"""Miniature mesh files: colours, geometry that can be mended, and geometry that cannot."""

import base64
import copy
import json
import struct
from pathlib import PurePath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image
from trees import TEXTURED, TRIANGLE, area, encoded, png, write_folder

from ffd_lightning.data.reading import mesh_file
from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.errors import RejectedShapeError

GREY = [178, 178, 178, 255]
PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\n{colors}element face {count}\nproperty list uchar int vertex_indices\n"
    "end_header\n"
)


class Folder:
    """Writes files and reads meshes with all the others at hand."""

    def __init__(self, root):
        self.root = root

    def write(self, name, content):
        write_folder(self.root, {name: content})

    def read(self, name="m.obj"):
        return read_mesh(self.root / name, [p for p in self.root.rglob("*") if p.is_file()])

    def load(self, name="m.obj"):
        return self.read(name)[0]

    def textured(self, mtl, **images):
        """Write a triangle with a material of this text, and textures by stem."""
        self.write("m.mtl", mtl)
        self.write("m.obj", TEXTURED)
        for stem, color in images.items():
            self.write(f"{stem}.png", png(color))


@pytest.fixture
def folder(tmp_path):
    return Folder(tmp_path)


def test_a_bug_of_ours_is_not_called_a_damaged_file(folder, monkeypatch):
    folder.write("m.obj", TRIANGLE + "f 1 2 3\n")
    monkeypatch.setattr(mesh_file, "face_colors", None)
    with pytest.raises(TypeError, match="not callable"):
        folder.load()


def test_colours_and_transparency_of_mtl(folder):
    options = {"a": "d 0.5", "b": "Tr 0.25", "c": "d 0", "e": "d 1\nTr 1", "f": "d -halo 0.5"}
    mtl = "".join(f"newmtl {name} # red\nKd 1 0 .2 # red\n{options[name]}\n" for name in options)
    mtl += "newmtl Material #25\nKd 0 .5 0\nd .5 #half\nnewmtl no Kd\nNs 3\n"
    folder.write("m.mtl", mtl + "newmtl short\nKd 0.5\nmap_Kd -s 2 2 1 absent.png\n")
    names = [*options, "Material #25", "no Kd", "short", "nowhere"]
    faces = "".join(f"usemtl {name} # {name}\nf 1 2 3\n" for name in names)
    folder.write("m.obj", "mtllib m.mtl # colours\n" + TRIANGLE + faces)
    mesh, warnings = folder.read()
    assert warnings[0] == "materials that faces name are in no material file: nowhere"
    assert [w.split()[-1] for w in warnings[1:]] == ["absent.png", "m.mtl"]
    red = [[255, 0, 51, alpha] for alpha in (128, 128, 191, 255, 255)]
    assert sorted(mesh.face_colors.tolist()) == sorted([*red, [0, 128, 0, 128], *[GREY] * 3])


@pytest.mark.parametrize(
    "lines", ["mtllib my a.mtl\nmtllib gone.mtl b.mtl\n", "mtllib b.mtl my a.mtl\n"]
)
def test_every_material_library_counts(folder, lines):
    folder.write("my a.mtl", "newmtl a\nKd 1 0 0")
    folder.write("b.mtl", "newmtl b\nKd 0 0 1\n")
    folder.write("m.obj", lines + TRIANGLE + "usemtl a\nf 1 2 3\nusemtl b\nf 1 2 3\n")
    mesh, warnings = folder.read()
    assert sorted(mesh.face_colors.tolist()) == [[0, 0, 255, 255], [255, 0, 0, 255]]
    assert warnings == ("material files are absent: gone.mtl",) * ("gone" in lines)


@pytest.mark.parametrize(
    "name",
    [
        "C:\\textures\\wood oak.png",
        "../elsewhere/WOOD OAK.PNG",
        "-blendu off -bm 0.5 -clamp on -o 0 0 0 -texres 512 maps\\wood oak.png  ",
        "/abs/wood%20oak.png",
    ],
)
def test_textures_are_found_by_base_name_and_replace_kd(folder, name):
    folder.textured(f"newmtl m\nKd 0 0 0\nd 0.5\n  MAP_KD {name}\n")
    folder.write("images/wood oak.png", png((10, 20, 30)))
    mesh = folder.load()
    np.testing.assert_array_equal(mesh.face_textures, [0])
    np.testing.assert_array_equal(mesh.textures[0][0, 0], [10, 20, 30, 128])
    np.testing.assert_array_equal(mesh.face_colors, [[10, 20, 30, 128]])
    corners = mesh.vertices[mesh.faces[0], :2]
    np.testing.assert_allclose(mesh.face_uvs[0], corners)  # uv = xy in this file


def test_the_namesake_nearest_to_the_named_path_is_taken(folder):
    folder.textured("newmtl m\nmap_Kd b/x.png\n", x=(1, 1, 1))
    folder.write("b/x.png", png((2, 2, 2)))
    assert folder.load().textures[0][0, 0, 0] == 2


PALETTE = Image.new("P", (8, 6), 1)
PALETTE.putpalette([0, 0, 0, 200, 100, 50])
KINDS = {
    "16-bit grey": (encoded(Image.new("I;16", (8, 6), 128 * 257), "png"), [128, 128, 128, 255]),
    "see-through palette": (encoded(PALETTE, "png", transparency=b"\xff\x40"), [200, 100, 50, 64]),
    "transparent": (png((5, 6, 7, 0), (8, 6)), [5, 6, 7, 255]),
}


@pytest.mark.parametrize("kind", KINDS)
def test_textures_of_all_kinds_are_read_whatever_their_name(folder, kind):
    content, color = KINDS[kind]
    folder.textured("newmtl m\nKd 0 1 0\nmap_Kd x.png\n")
    folder.write("x.png", content)
    mesh = folder.load()
    assert mesh.textures[0].shape == (6, 8, 4)
    np.testing.assert_array_equal(mesh.textures[0][3, 3], color)
    np.testing.assert_array_equal(mesh.face_colors, [color])
    folder.write("x.png", png((5, 6, 7), (3000, 30)))
    assert folder.load().textures[0].shape == (10, 1024, 4)


UNUSABLE = {
    "missing": None,
    "EPS": encoded(Image.new("RGB", (8, 6)), "eps"),
    "cut off": encoded(Image.effect_noise((64, 64), 50), "png")[:900],
}


@pytest.mark.parametrize("name", UNUSABLE)
def test_a_material_whose_texture_cannot_be_used_is_grey_and_noted(folder, capfd, name):
    folder.textured("newmtl m\nKd 1 1 1\nd 0.5\nmap_Kd C:\\maps\\x.png\n")
    if UNUSABLE[name] is not None:
        folder.write("x.png", UNUSABLE[name])
    mesh, warnings = folder.read()
    assert (mesh.textures, mesh.face_textures, mesh.face_uvs) == ((), None, None)
    np.testing.assert_array_equal(mesh.face_colors, [[178, 178, 178, 128]])
    what = "that the materials name are absent" if name == "missing" else "cannot be decoded"
    assert warnings == (f"textures {what}: x.png",)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("mtl", "warning"),
    [
        (None, "material files are absent: m.mtl"),
        (b"\xff\xfe\0", "materials that faces name are in no material file: m"),
        (b"newmtl m\nimage x\n", ""),
    ],
)
def test_a_missing_or_useless_mtl_gives_grey(folder, mtl, warning):
    folder.write("m.obj", TEXTURED)
    if mtl is not None:
        folder.write("m.mtl", mtl)
    mesh, warnings = folder.read()
    np.testing.assert_array_equal(mesh.face_colors, [GREY])
    assert warnings == ((warning,) if warning else ())


@pytest.mark.parametrize("uvs", ["", "vt 0\nvt 1\nvt 0\n", "vt nan 0\nvt 1e400 0\nvt 0 -inf\n"])
def test_bad_uvs_do_not_reject_a_shape(folder, uvs):
    """Without any that can be used, the texture cannot be shown."""
    folder.textured("newmtl m\nKd 0 1 0\nmap_Kd x.png\n", x=(0, 255, 0))
    obj = TEXTURED.replace("vt 0 0\nvt 1 0\nvt 0 1\n", uvs)
    folder.write("m.obj", obj if uvs else obj.replace("1/1 2/2 3/3", "1 2 3"))
    mesh = folder.load()
    shown = [0, 255, 0, 255] if "nan" in uvs else GREY
    np.testing.assert_array_equal(mesh.face_colors, [shown])
    assert mesh.face_uvs is None or np.isfinite(mesh.face_uvs).all()


def test_vertex_colours_are_averaged(folder):
    colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    rows = "0 0 0 30 0 0\n1 0 0 60 0 0\n0 1 0 90 30 0\n3 0 1 2\n"
    folder.write("m.ply", PLY.format(colors=colors, count=1) + rows)
    np.testing.assert_array_equal(folder.load("m.ply").face_colors, [[60, 10, 0, 255]])


def gltf(buffer=None, texture=None, nodes=None, **material):
    """Return a glTF of one triangle with uv = (x, 1 - y), that is (x, y) with v upwards."""
    data = struct.pack("<15f", *(0, 0, 0, 1, 0, 0, 0, 1, 0), *(0, 1, 1, 1, 0, 0))
    data += struct.pack("<12H", *3 * [65535, 25800, 0, 65535])  # a colour, for who asks for it
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    places = {"VEC3": (0, 36, 5126), "VEC2": (36, 24, 5126), "VEC4": (60, 24, 5123)}
    views = [
        {"buffer": 0, "byteOffset": start, "byteLength": length}
        for start, length, _ in places.values()
    ]
    accessors = [
        {"bufferView": k, "componentType": number, "count": 3, "type": kind}
        for k, (kind, (_, _, number)) in enumerate(places.items())
    ]
    accessors[2]["normalized"] = True
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
        "buffers": [{"byteLength": 84, "uri": buffer or uri}],
        "bufferViews": views,
        "accessors": accessors,
    }
    if texture:
        pbr["baseColorTexture"] = {"index": 0}
        tree |= {"textures": [{"source": 0}], "images": [{"uri": texture}]}
    return json.dumps(tree)


def test_gltf_colours(folder):
    # The factor is linear: 0.2140 is sRGB 0.5. Alpha counts only where the mode says so.
    for mode, alpha in (("OPAQUE", 255), ("BLEND", 102)):
        folder.write("m.gltf", gltf(factor=[0.2140, 0, 1, 0.4], alphaMode=mode))
        np.testing.assert_array_equal(folder.load("m.gltf").face_colors, [[128, 0, 255, alpha]])
    painted = json.loads(gltf())
    (primitive,) = painted["meshes"][0]["primitives"]
    primitive["attributes"]["COLOR_0"] = 2
    for _ in ("with a material", "without"):
        folder.write("m.gltf", json.dumps(painted))
        np.testing.assert_array_equal(folder.load("m.gltf").face_colors, [[255, 100, 0, 255]])
        primitive.pop("material", None)
    folder.write("tex.gltf", gltf(texture="x.png", factor=[1, 0, 1, 1], alphaMode="MASK"))
    folder.write("x.png", png((100, 100, 100, 140)))
    mesh = folder.load("tex.gltf")
    np.testing.assert_array_equal(mesh.textures[0][0, 0], [100, 0, 100, 255])
    np.testing.assert_allclose(mesh.face_uvs[0], mesh.vertices[mesh.faces[0], :2])
    (folder.root / "x.png").unlink()
    np.testing.assert_array_equal(folder.load("tex.gltf").face_colors, [[178, 0, 178, 255]])


def glb(text):
    """Return a glTF of one file's text as a GLB without a binary part."""
    text = text.encode() + b" " * (-len(text) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON") + text


@pytest.mark.parametrize("pack", [str, glb])
def test_gltf_that_trimesh_would_show_wrongly(folder, pack):
    folder.write("x.png", png((10, 20, 200)))
    plain = json.loads(gltf(texture="x.png"))

    def read(change):
        tree = copy.deepcopy(plain)
        change(tree)
        name = f"m.{'gltf' if pack is str else 'glb'}"
        folder.write(name, pack(json.dumps(tree)))
        return folder.read(name)

    def glossy(tree):
        (material,) = tree["materials"]
        texture = material.pop("pbrMetallicRoughness")["baseColorTexture"]
        gloss = {"specularFactor": [0.4] * 3, "diffuseFactor": [1, 1, 0, 1]}
        material["extensions"] = {
            "KHR_materials_pbrSpecularGlossiness": gloss | {"diffuseTexture": texture}
        }

    mesh, _ = read(glossy)
    np.testing.assert_array_equal(mesh.textures[0][0, 0], [10, 20, 0, 255])

    def second(tree):
        tree["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["texCoord"] = 1
        attributes = tree["meshes"][0]["primitives"][0]["attributes"]
        attributes |= {"TEXCOORD_0": 0, "TEXCOORD_1": attributes["TEXCOORD_0"]}

    mesh, _ = read(second)
    np.testing.assert_allclose(mesh.face_uvs[0], mesh.vertices[mesh.faces[0], :2])
    other = {"extensions": {"KHR_texture_basisu": {"source": 0}}}
    mesh, (warning,) = read(lambda tree: tree.update(textures=[other]))
    assert warning.endswith("absent: KHR_texture_basisu.png")
    np.testing.assert_array_equal(mesh.face_colors, [GREY])
    _, (warning,) = read(lambda tree: tree.update(extensionsUsed=["KHR_texture_transform"]))
    assert warning == "textures are misplaced: KHR_texture_transform"
    _, (warning,) = read(lambda tree: tree["accessors"][1].update(normalized=True))
    assert warning == "textures are misplaced: normalized UVs"
    with pytest.raises(RejectedShapeError, match="has normalized positions"):
        read(lambda tree: tree["accessors"][0].update(normalized=True))
    with pytest.raises(RejectedShapeError, match="has triangle fans"):
        read(lambda tree: tree["meshes"][0]["primitives"][0].update(mode=6))


def test_scene_graph_is_applied(folder):
    nodes = [
        {"children": [1, 2], "translation": [10, 0, 0]},
        {"mesh": 0},
        {"mesh": 0, "translation": [0, 5, 0], "scale": [2, 2, 2]},
    ]
    folder.write("m.gltf", gltf(nodes=nodes))
    mesh = folder.load("m.gltf")
    assert area(mesh) == pytest.approx(0.5 + 2)
    np.testing.assert_allclose(mesh.vertices.min(0), [10, 0, 0])
    np.testing.assert_allclose(mesh.vertices.max(0), [12, 7, 0])


STL = "solid st\xfchle\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
STL += "endloop\nendfacet\nendsolid s\n"
OFF = "3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
POINTS = "0 0 0\n1 0 0\n0 1 0\n"
LATIN_PLY = PLY.format(colors="comment st\xfchle\n", count=1) + POINTS + "3 0 1 2\n"
CORNERS = "2 2 0\n0 2 0\n0 0 0\n2 0 0\n1 1 0\n"  # of a square without a quarter
CONCAVE = "".join(f"v {line}\n" for line in CORNERS.splitlines())
POLYGONS = PLY.format(colors="", count=1).replace("vertex 3", "vertex 5") + CORNERS
FORMS = """v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0
v 5 0 0\nv 7 0 0\nv 8 1 0\nv 7 2 0\nv 5 2 0\nv 4 1 0\nvt 0 0\nvn 0 0 1
f 1/1/1 2/1/1 3/1/1 4/1/1\nf 1/1 2/1 3/1\nf 5//1 6//1 7//1 8//1 9//1 10//1\nf 5 6 7 8 9 10\n"""
GOOD = {
    "n-gons": ("obj", "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 2 0\nv 0 1 0\nf 1 2 3 4 5\n", 3, 4.0),
    "concave": ("obj", CONCAVE + "f 1 2 3 4 5\n", 3, 3.0),
    "concave, backwards": ("obj", CONCAVE + "f 4 3 2 1 5\n", 3, 3.0),
    "concave, OFF": ("off", "OFF 5 1 0\n" + CORNERS + "5 0 1 2 3 4\n", 3, 3.0),
    "concave, PLY": ("ply", POLYGONS + "5 0 1 2 3 4\n", 3, 3.0),
    "tabs, CR, comments": ("obj", "v\t0 0 0 # a\rv 1 0 0\rv 0 1 0\r f\t1 2 3 # b\r", 1, 0.5),
    "corners in all forms": ("obj", FORMS, 11, 18.0),
    "NaN face": ("obj", TRIANGLE + "v nan 0 0\nf 1 2 3\nf 1 2 4\n", 1, 0.5),
    "degenerate": ("obj", TRIANGLE + "f 1 2 3\nf 1 1 2\nf 3 3 3\n", 1, 0.5),
    "latin-1": ("obj", b"# st\xfchle\ng l\xe4nge\n" + (TRIANGLE + "f 1 2 3\n").encode(), 1, 0.5),
    "OFF": ("off", "OFF\n# c\n\n" + OFF, 1, 0.5),
    "UTF-16": ("obj", (TRIANGLE + "f 1 2 3\n").encode("utf-16"), 1, 0.5),
    "STL latin-1": ("stl", STL.encode("latin-1"), 1, 0.5),
    "PLY latin-1": ("ply", LATIN_PLY.encode("latin-1"), 1, 0.5),
    "PLY index": ("ply", PLY.format(colors="", count=2) + POINTS + "3 0 1 2\n3 0 1 9\n", 1, 0.5),
}


@pytest.mark.parametrize("name", GOOD)
def test_good_enough_shapes_come_through(folder, name):
    extension, content, faces, expected = GOOD[name]
    folder.write(f"m.{extension}", content)
    mesh = folder.load(f"m.{extension}")
    assert len(mesh.faces) == faces
    assert area(mesh) == pytest.approx(expected)
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    upwards = np.cross(b - a, c - a)[:, 2] > 0
    assert (upwards != ("backwards" in name)).all(), "pieces look where the polygon does"
    assert np.isfinite(mesh.vertices).all()
    assert (mesh.vertices.dtype, mesh.faces.dtype) == (np.float64, np.int64)
    assert (mesh.face_colors.shape, mesh.face_colors.dtype) == ((faces, 4), np.uint8)


def test_negative_indices_count_from_their_line(folder):
    first = TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nf -3/-3 -2/-2 -1/-1\n"
    second = "v 0 0 5\nv 3 0 5\nv 0 3 5\nvt 0 0\nf -3/-3 -2/-2 \\\n -1/-1\n"
    folder.write("m.obj", first + second)
    mesh = folder.load()
    assert area(mesh) == pytest.approx(0.5 + 4.5)
    assert set(mesh.vertices[mesh.faces][..., 2].sum(1)) == {0, 15}


def test_colours_of_off_and_of_polygons_in_ply(folder):
    red, green = [255, 0, 0, 255], [0, 128, 0, 255]
    square = "0 0 0", "1 0 0", "1 1 0", "0 1 0"
    faces = "4 0 1 2 3 {}\n3 0 1 2 {}\n"
    for colors in (("255 0 0", "0 128 0"), ("1.0 0 0 1", "0 0.502 0 1")):
        folder.write("m.off", "OFF\n4 2 0\n" + "\n".join(square) + "\n" + faces.format(*colors))
        assert folder.load("m.off").face_colors.tolist() == [red, red, green]
    normal = "\n".join(f"{place} 0 0 1 0 128 0 255" for place in square)
    folder.write("m.off", f"CNOFF\n4 1 0\n{normal}\n4 0 1 2 3\n")
    assert folder.load("m.off").face_colors.tolist() == [green, green]
    head = PLY.format(colors="", count=2).replace("vertex 3", "vertex 4")
    named = "".join(f"property uchar {name}\n" for name in ("red", "green", "blue"))
    head = head.replace("end_header", named + "end_header")
    folder.write("m.ply", head + "\n".join(square) + "\n" + faces.format("255 0 0", "0 128 0"))
    assert folder.load("m.ply").face_colors.tolist() == [red, red, green]


def test_a_text_that_ends_early_is_rejected(folder):
    folder.write("m.off", "OFF4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n3 1 2 3\n")
    assert area(folder.load("m.off")) == pytest.approx(1)
    folder.write("m.off", "OFF4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2\n")
    folder.write("m.ply", PLY.format(colors="", count=3) + POINTS + "3 0 1 2\n3 0 2 1\n")
    for name in ("m.off", "m.ply"):
        with pytest.raises(RejectedShapeError, match="incomplete: it has 5 of 6"):
            folder.load(name)


BAD = {
    # Which of both depends on whether a library that guesses encodings is installed.
    "noise stl": ("stl", bytes(range(256)) * 40, "not of this format|no faces"),
    "infinite": ("obj", "v 1e300 0 0\nv 0 1e300 0\nv 0 0 1\nf 1 2 3\n", "no face with a finite"),
    "only lines": ("obj", TRIANGLE + "l 1 2 3\n", "no faces"),
    "ply promises": ("ply", PLY.format(colors="", count=10**12) + "0 0 0\n", "m.ply"),
    "Draco": ("gltf", '{"extensionsUsed": ["KHR_draco_mesh_compression"]}', "draco"),
    "circular": ("gltf", gltf(nodes=[{"children": [1]}, {"mesh": 0, "children": [0]}]), "m.gltf"),
    "missing": ("gltf", gltf(buffer="lost.bin"), "FileNotFoundError"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_shapes_are_rejected_with_a_reason(folder, name):
    extension, content, reason = BAD[name]
    folder.write(f"m.{extension}", content)
    with pytest.raises(RejectedShapeError, match=reason) as caught:
        folder.load(f"m.{extension}")
    assert "\n" not in str(caught.value)


WHOLE = {
    "gltf": gltf().encode(),
    "ply": (PLY.format(colors="", count=1) + POINTS + "3 0 1 2\n").encode(),
    "stl": bytes(80) + struct.pack("<I12fH", 1, *[0.0] * 3, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0),
    "off": ("OFF\n" + OFF).encode(),
    "obj": TEXTURED.encode(),
}


@settings(max_examples=200)
@given(
    st.sampled_from(list(WHOLE)),
    st.integers(0, 500),
    st.integers(0, 30) | st.just(10**6),
    st.binary(max_size=8) | st.sampled_from([b"-1", b"nan", b"9" * 30, b"\n", b"{}"]),
)
def test_a_damaged_file_gives_a_valid_mesh_or_is_rejected(extension, start, length, junk):
    whole = WHOLE[extension]
    start %= len(whole)
    data = whole[:start] + junk + whole[start + length :]
    try:
        mesh, _ = read_mesh(PurePath(f"m.{extension}"), (), lambda _: data)
    except RejectedShapeError:
        return
    assert len(mesh.faces) > 0
    assert np.isfinite(mesh.vertices).all()
    assert 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices)
    assert mesh.face_colors.shape == (len(mesh.faces), 4)
