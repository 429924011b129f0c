import csv

import numpy as np
import pytest
from box_source import RENDER, BoxSource, prepare_boxes
from PIL import Image
from shapenet_tree import model_text, png, write_folder

from ffd_lightning import shapes
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.sheet import SHOWN, draw_set
from ffd_lightning.data.preparation.summary import (
    count_warnings,
    pose_warning,
    sheet_of,
    warnings_of,
)
from ffd_lightning.data.reading.frame import turn
from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.data.sources.procedural import ProceduralSource

WHITE = "\n".join(f"newmtl m{k}\nKd 1 1 1" for k in range(9))


@pytest.fixture
def prepare(tmp_path):
    """Return a function that prepares a folder of chairs."""

    def run(files, up="y", yaw=0.0, category="chair"):
        root = write_folder(tmp_path / "shapes", files)
        source = FolderSource(root, up, yaw)
        return Preparation(source, category, 512, RENDER, tmp_path, workers=1).run()

    return run


def chair(name, texture=None, mtl=None, pose=("y", 0.0), index=0, folder="chair"):
    """Return the files of a chair, its coordinates as a data set has them that needs this pose."""
    obj, materials = model_text(index, texture)
    lines = []
    for line in obj.replace("{stem}", "a").split("\n"):
        if line.startswith("v "):
            x, y, z = np.array(line.split()[1:], float) @ turn(np.eye(3), *pose).T
            line = f"v {x} {y} {z}"
        lines.append(line)
    top = f"{folder}/{name}"
    return {
        f"{top}/a.obj": "\n".join(lines).encode(),
        f"{top}/a.mtl": (materials if mtl is None else mtl).encode(),
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


@pytest.mark.parametrize(
    ("pose", "now", "said"),
    [
        (("y", 0.0), ("y", 0.0), ""),
        (("z", 0.0), ("y", 0.0), "try data.up=z ("),
        (("z", 90.0), ("y", 0.0), "try data.up=z data.yaw=90 ("),
        (("y", 0.0), ("z", 0.0), "try data.up=y ("),
    ],
)
def test_the_setting_that_mends_the_pose_is_named(prepare, capfd, pose, now, said):
    files = {}
    for k in range(6):
        index = k % 4  # model_text knows four
        files |= chair(f"c{k}", pose=pose, index=index)
    prepared = prepare(files, *now)
    told = pose_warning(prepared)
    assert said in told
    assert bool(said) == bool(told)
    assert told in capfd.readouterr().err


def test_a_source_that_turns_nothing_is_asked_for_its_version(tmp_path):
    prepared = prepare_boxes(BoxSource(6, tmp_path / "log"), tmp_path)
    assert pose_warning(prepared) == "", "boxes look alike from front and side"


def test_a_source_of_ones_own_may_mean_something_else_by_up_and_yaw(tmp_path):
    prepared = prepare_boxes(BoxSource(6, tmp_path / "log"), tmp_path)
    prepared.manifest["settings"]["source"] |= {"up": [0, 1, 0], "yaw": "random"}
    assert pose_warning(prepared) == ""


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


def test_the_picture_grows_with_the_set_and_tells_the_guess(tmp_path):
    few = prepare_boxes(BoxSource(3, tmp_path / "a"), tmp_path / "few")
    many = prepare_boxes(BoxSource(SHOWN + 4, tmp_path / "b"), tmp_path / "many")
    rows = SHOWN // 8
    small, large = draw_set(few), draw_set(many)
    assert large.height - small.height == (rows - 1) * (144 + 17 + 4)
    with_guess = np.asarray(draw_set(few, "turn them")).astype(int)
    differs = np.abs(with_guess - np.asarray(small)).max(axis=2)
    assert differs.any()
    assert not differs[: small.height // 4].any(), "only below the images"


@pytest.mark.parametrize("category", [*shapes.categories()[:2], "mug"])
def test_expected_shapes_are_of_several_families(category):
    from ffd_lightning.data.preparation.sheet import _expected

    names = [name for name, _ in _expected(category)]
    assert len(set(names)) == 3
    assert all(name.startswith(category) for name in names) == (category != "mug")
