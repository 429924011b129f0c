import numpy as np
import pytest
from box_source import RENDER, BoxSource, prepare_boxes
from PIL import Image
from shapenet_tree import model_text, png, write_folder

from ffd_lightning import shapes
from ffd_lightning.data.preparation.overview import _expected, count_warnings, sheet_of
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.data.sources.procedural import ProceduralSource


def chair(name, texture=None):
    """Return the files of a chair."""
    obj, materials = model_text(0, texture)
    return {
        f"chair/{name}/a.obj": obj.replace("{stem}", "a").encode(),
        f"chair/{name}/a.mtl": materials.encode(),
    }


def test_warnings_are_listed_and_counted_by_kind(tmp_path, capfd):
    files = (
        chair("absent", "lost.png")
        | chair("broken", "b.png")
        | {"chair/broken/b.png": b"no picture"}
        | chair("good", "g.png")
        | {"chair/good/g.png": png()}
    )
    source = FolderSource(write_folder(tmp_path / "shapes", files))
    prepared = Preparation(source, "chair", 512, RENDER, tmp_path, workers=1).run()
    lacks = "textures that the materials name are absent"
    assert prepared.warnings["absent"] == [f"{lacks}: lost.png"]
    assert prepared.warnings["broken"] == ["textures cannot be decoded: b.png"]
    assert "good" not in prepared.warnings
    counted = count_warnings(prepared)
    assert counted == f"{lacks} (1 of 3); textures cannot be decoded (1)"
    assert f"warnings: {counted}" in capfd.readouterr().err


def test_what_hardly_shows_on_white_is_told_by_its_pixels(tmp_path):
    prepared = Preparation(ProceduralSource(12), "lamp", 64, RENDER, tmp_path, workers=1).run()
    for row, shape_id in enumerate(prepared.ids):
        images = np.stack([prepared.image(row, view) for view in range(2)])
        values = [p[:3].mean() for p in images.reshape(-1, 4) if p[3] > 127]
        told = any("invisible on white" in w for w in prepared.warnings.get(shape_id, []))
        assert told == (np.mean(values) > 225)


def test_the_picture_holds_what_the_network_sees(tmp_path):
    prepared = prepare_boxes(BoxSource(5, tmp_path / "log"), tmp_path)
    sheet = np.asarray(Image.open(sheet_of(prepared.path)).convert("RGB"))
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
