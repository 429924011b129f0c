import io
import json

import numpy as np
import pytest
import trimesh
from ffd_lightning.data.reading.mesh_notes import (
    ABSENT_LIBRARIES,
    ABSENT_TEXTURES,
    REPEATED,
    UNDECODABLE,
    UNDEFINED,
)
from PIL import Image
from shapenet_tree import model_text, png, write_folder

from ffd_lightning.data.reading.mesh_file import read_mesh, read_with_notes


def cut_off():
    """A picture whose header is whole and whose content is not."""
    data = io.BytesIO()
    Image.effect_noise((64, 64), 50).save(data, "png")
    return data.getvalue()[:900]


@pytest.fixture
def notes_of(tmp_path):
    """Return a function from side files to the notes on an OBJ beside them."""

    def read(files, texture=None, mtl=True, extra=""):
        obj, materials = model_text(0, texture)
        files = {"a.obj": obj.replace("{stem}", "a").encode(), **files}
        if mtl:
            files["a.mtl"] = (materials + extra).encode()
        write_folder(tmp_path, files)
        paths = [path for path in tmp_path.rglob("*") if path.is_file()]
        mesh, notes = read_with_notes(tmp_path / "a.obj", paths)
        assert (read_mesh(tmp_path / "a.obj", paths).vertices == mesh.vertices).all()
        return list(notes)

    return read


@pytest.mark.parametrize(
    ("files", "settings", "expected"),
    [
        ({}, {}, []),
        ({"wood.png": png()}, {"texture": "wood.png"}, []),
        ({"wood.png": png()}, {"texture": r"C:\maps\WOOD.png"}, []),
        ({}, {"texture": r"C:\maps\wood.png"}, [f"{ABSENT_TEXTURES}: wood.png"]),
        ({}, {"mtl": False}, [f"{ABSENT_LIBRARIES}: a.mtl"]),
        ({"w.png": b"not a picture"}, {"texture": "w.png"}, [f"{UNDECODABLE}: w.png"]),
        ({"w.png": cut_off()}, {"texture": "w.png"}, [f"{UNDECODABLE}: w.png"]),
        ({}, {"extra": "newmtl m0\nKd 1 0 0\n"}, [f"{REPEATED}: m0"]),
        (
            {},
            {"texture": "w.png", "extra": "newmtl m0\nKd 1 0 0\n"},
            [f"{ABSENT_TEXTURES}: w.png", f"{REPEATED}: m0"],
        ),
    ],
)
def test_what_materials_lack_is_noted(notes_of, files, settings, expected):
    assert notes_of(files, **settings) == expected


def test_the_same_material_twice_is_no_fault(notes_of):
    assert notes_of({}, extra="newmtl twin\nKd 1 0 0\n\nnewmtl twin\n# again\nKd 1  0 0\n") == []


def test_materials_that_are_defined_nowhere_are_noted(tmp_path):
    """As those of a second library, of which trimesh reads the first alone."""
    triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    faces = "usemtl red\nf 1 2 3\nusemtl dark  oak\nf 1 2 3\n"
    red, oak = b"newmtl red\nKd 1 0 0\n", b"newmtl dark oak\nKd 0 1 0\n"
    for libraries, files, lacking in [
        (["a.mtl"], {"a.mtl": red + oak}, ""),
        (["a.mtl"], {"a.mtl": red}, "dark oak"),
        (["a.mtl", "b.mtl"], {"a.mtl": red, "b.mtl": oak}, "dark oak"),
        ([], {}, "dark oak, red"),
    ]:
        obj = "".join(f"mtllib {name}\n" for name in libraries) + triangle + faces
        write_folder(tmp_path, files | {"a.obj": obj.encode()})
        mesh, notes = read_with_notes(tmp_path / "a.obj", [tmp_path / name for name in files])
        assert notes == ((f"{UNDEFINED}: {lacking}",) if lacking else ())
        assert len(mesh.faces) == 2


def test_of_many_names_some_are_told(notes_of):
    extra = "".join(f"newmtl x{k}\nmap_Kd lost{k}.png\n" for k in range(9))
    (note,) = notes_of({}, extra=extra)
    assert note == f"{ABSENT_TEXTURES}: {', '.join(f'lost{k}.png' for k in range(5))} and 4 more"


@pytest.mark.parametrize(
    ("uri", "content", "expected"),
    [
        ("lost.png", None, [f"{ABSENT_TEXTURES}: lost.png"]),
        ("bad.jpg", b"no picture", [f"{UNDECODABLE}: bad.jpg"]),
        ("good.png", png(), []),
    ],
)
def test_textures_that_a_gltf_names(tmp_path, uri, content, expected):
    box = trimesh.creation.box()
    material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.new("RGB", (8, 8)))
    uv = np.zeros((len(box.vertices), 2))
    box.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
    files = trimesh.exchange.gltf.export_gltf(trimesh.Scene(box))
    tree = json.loads(files["model.gltf"])
    tree["images"] = [{"uri": uri}]
    files["model.gltf"] = json.dumps(tree).encode()
    if content is not None:
        files[uri] = content
    write_folder(tmp_path, files)
    mesh, notes = read_with_notes(tmp_path / "model.gltf", list(tmp_path.iterdir()))
    assert list(notes) == expected
    assert bool(mesh.textures) == (not expected)
