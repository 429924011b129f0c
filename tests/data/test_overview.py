import numpy as np
from box_source import RENDER, BoxSource, prepare_boxes
from PIL import Image
from trees import TEXTURED, png, write_folder

from ffd_lightning.data.preparation.overview import count_warnings, sheet_of
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.folder import FolderSource


def test_warnings_are_listed_and_counted_by_kind(tmp_path, capfd):
    named = {"absent": "lost.png", "broken": "b.png", "good": "g.png"}
    files = {f"{name}/m.mtl": f"newmtl m\nmap_Kd {texture}\n" for name, texture in named.items()}
    files |= {f"{name}/m.obj": TEXTURED for name in named}
    files |= {"broken/b.png": b"no picture", "good/g.png": png()}
    write_folder(tmp_path / "shapes" / "chair", files)
    source = FolderSource(tmp_path / "shapes")
    prepared = Preparation(source, "chair", 64, RENDER, tmp_path, workers=1).run()
    absent = "textures that the materials name are absent"
    broken = "textures cannot be decoded"
    assert prepared.warnings == {"absent": [f"{absent}: lost.png"], "broken": [f"{broken}: b.png"]}
    counted = count_warnings(prepared)
    assert counted == f"{absent} (1 of 3); {broken} (1 of 3)"
    assert f"warnings: {counted}" in capfd.readouterr().err


def test_the_picture_holds_what_the_network_sees(tmp_path):
    prepared = prepare_boxes(BoxSource(5, tmp_path / "log"), tmp_path)
    sheet = np.asarray(Image.open(sheet_of(prepared.path)).convert("RGB"))
    image = np.asarray(Image.fromarray(prepared.image(0)[..., :3]).resize((192, 144), 1))
    inner = image[8:-8, 8:-8].astype(int)
    left = sheet[40:240, 12 : 12 + 176].astype(int)  # the first column, below the title
    places = [left[top : top + 128] for top in range(len(left) - 128)]
    assert any(np.abs(place - inner).max() <= 1 for place in places)
