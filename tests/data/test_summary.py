import csv

import numpy as np
import pytest
from box_source import RENDER, BoxSource, prepare_boxes
from ffd_lightning.data.preparation.sheet import _expected
from ffd_lightning.data.preparation.summary import count_warnings, sheet_of, warnings_of
from PIL import Image
from shapenet_tree import model_text, png, write_folder

from ffd_lightning import shapes
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.data.sources.procedural import ProceduralSource

WHITE = "\n".join(f"newmtl m{k}\nKd 1 1 1" for k in range(9))


@pytest.fixture
def prepare(tmp_path):
    """Return a function that prepares a folder of chairs."""

    def run(files):
        source = FolderSource(write_folder(tmp_path / "shapes", files))
        return Preparation(source, "chair", 512, RENDER, tmp_path, workers=1).run()

    return run


def chair(name, texture=None, mtl=None):
    """Return the files of a chair."""
    obj, materials = model_text(0, texture)
    return {
        f"chair/{name}/a.obj": obj.replace("{stem}", "a").encode(),
        f"chair/{name}/a.mtl": (materials if mtl is None else mtl).encode(),
    }


def test_warnings_are_listed_and_counted_by_kind(prepare, capfd):
    prepared = prepare(
        chair("absent", "lost.png")
        | chair("both", "gone.png", mtl="newmtl m0\nKd 1 1 1\nmap_Kd gone.png\n" + WHITE)
        | chair("broken", "b.png")
        | {"chair/broken/b.png": b"no picture"}
        | chair("good", "g.png")
        | {"chair/good/g.png": png()}
    )
    with (prepared.path / "warnings.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["id", "warning"]
    warned = warnings_of(prepared)
    lacks = "textures that the materials name are absent"
    assert rows[1:] == [[i, w] for i in prepared.ids for w in warned.get(i, [])]
    assert warned["absent"] == [f"{lacks}: lost.png"]
    assert warned["broken"] == ["textures cannot be decoded: b.png"]
    assert f"{lacks}: gone.png" in warned["both"]
    assert "good" not in warned
    assert prepared.manifest["warnings"] == 3, "shapes, not lines"
    counted = count_warnings(prepared)
    assert counted.startswith(f"{lacks} (2 of 4); ")
    assert "textures cannot be decoded (1)" in counted
    (line,) = (x for x in capfd.readouterr().err.splitlines() if x.startswith("warnings: "))
    assert line == f"warnings: {counted}; see {prepared.path}/warnings.csv"


def test_what_hardly_shows_on_white_is_told_by_its_pixels(tmp_path):
    source = ProceduralSource(12)
    prepared = Preparation(source, "lamp", 64, RENDER, tmp_path, workers=1).run()
    warned = warnings_of(prepared)
    for row, shape_id in enumerate(prepared.ids):
        images = np.stack([prepared.image(row, view) for view in range(2)])
        values = [p[:3].mean() for p in images.reshape(-1, 4) if p[3] > 127]
        told = any("invisible on white" in w for w in warned.get(shape_id, []))
        assert told == (np.mean(values) > 225)


def test_a_line_of_warnings_names_the_commonest_kinds(monkeypatch, tmp_path):
    prepared = prepare_boxes(BoxSource(3, tmp_path / "log"), tmp_path)
    told = {"a": [f"fault {k}" for k in range(40)], "b": ["fault 7: here"]}
    monkeypatch.setattr("ffd_lightning.data.preparation.summary.warnings_of", lambda _: told)
    counted = count_warnings(prepared)
    assert counted.startswith("fault 7 (2 of 3); ")
    assert counted.endswith("; 34 more kinds")


def test_the_picture_holds_what_the_network_sees(tmp_path):
    prepared = prepare_boxes(BoxSource(5, tmp_path / "log"), tmp_path)
    file = sheet_of(prepared.path)
    assert file.parent.name == "sheets"
    sheet = np.asarray(Image.open(file).convert("RGB"))
    image = np.asarray(Image.fromarray(prepared.image(0)[..., :3]).resize((192, 144), 1))
    inner = image[8:-8, 8:-8]  # without the cell's frame
    left = sheet[40:240, 12 : 12 + 176].astype(int)  # the first column, below the title
    places = [left[top : top + 128] for top in range(len(left) - 128)]
    assert any(np.abs(place - inner).max() <= 1 for place in places)


@pytest.mark.parametrize("category", [*shapes.categories()[:2], "mug"])
def test_expected_shapes_are_of_several_families(category):
    names = [name for name, _ in _expected(category)]
    assert len(set(names)) == 3
    assert all(name.startswith(category) for name in names) == (category != "mug")
