"""Miniature ModelNet and Pix3D trees."""

import json
import pickle
import zipfile

import numpy as np
import pytest
from more_sources.modelnet import ModelNetSource
from more_sources.pix3d import OBJECT_FILL, Pix3dSource
from PIL import Image

from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import DataError, RejectedShapeError
from ffd_lightning.imaging.render_settings import RenderSettings

VIEW = RenderSettings(height=48, width=64, samples=1)


def chair(index):
    return ProceduralSource(4).load("chair", f"chair-{index:06d}").mesh


# --- ModelNet -------------------------------------------------------------------------------------


def off_text(mesh, header):
    """An OFF of a mesh that is y up, written z up as ModelNet's are."""
    x, y, z = mesh.vertices.T
    rows = [f"{header}{len(mesh.vertices)} {len(mesh.faces)} 0"]
    rows += [f"{a:.9f} {b:.9f} {c:.9f}" for a, b, c in np.stack([x, -z, y], 1)]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    return "\n".join(rows) + "\n"


@pytest.fixture(params=["folder", "one below", "archive"])
def modelnet(request, tmp_path):
    top = {"folder": "", "one below": "ModelNet40/", "archive": "ModelNet10/"}[request.param]
    files = {
        "chair/train/chair_0001.off": off_text(chair(0), "OFF\n"),
        "chair/train/chair_0002.off": off_text(chair(1), "OFF"),  # as half of ModelNet40
        "chair/test/chair_0003.off": off_text(chair(2), "OFF\n")[:-300],
        "airplane/train/airplane_0001.off": off_text(chair(1), "OFF\n"),
        "chair/train/._chair_0001.off": "?",
    }
    if request.param == "archive":
        with zipfile.ZipFile(tmp_path / "ModelNet10.zip", "w") as archive:
            for path, content in files.items():
                archive.writestr(top + path, content)
    else:
        for path, content in files.items():
            (tmp_path / top / path).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / top / path).write_text(content)
    return ModelNetSource(tmp_path)


def test_modelnet_comes_through_in_the_projects_frame(modelnet):
    assert modelnet.categories() == ["chair", "plane"]
    assert modelnet.shape_ids("chair") == ["chair_0001", "chair_0002", "chair_0003"]
    assert modelnet.shape_ids("plane") == ["airplane_0001"]
    subsets = ["train", "train", "test"]
    assert list(dict(sorted(modelnet.split("chair").items())).values()) == subsets
    source = pickle.loads(pickle.dumps(modelnet))
    for k, shape_id in enumerate(["chair_0001", "chair_0002"]):
        mesh, expected = source.load("chair", shape_id).mesh, chair(k)
        np.testing.assert_allclose(
            mesh.vertices[mesh.faces], expected.vertices[expected.faces], atol=1e-8
        )
    with pytest.raises(RejectedShapeError, match="incomplete"):
        source.load("chair", "chair_0003")
    with pytest.raises(DataError, match="has no lamp; it has: chair, plane"):
        source.shape_ids("lamp")
    json.dumps(modelnet.fingerprint("chair"))


def test_what_is_not_modelnet_is_said(tmp_path):
    with pytest.raises(DataError, match="is not ModelNet"):
        ModelNetSource(tmp_path).categories()
    with pytest.raises(ValueError, match="up=w must be one of"):
        ModelNetSource(tmp_path, up="w")


# --- Pix3D ----------------------------------------------------------------------------------------


@pytest.fixture
def pix3d(tmp_path):
    """Return a function that writes three photographs of two chairs, with changed entries."""

    def write(**changes):
        entries = []
        for k in range(3):
            folder = tmp_path / "model" / "chair" / f"SHAPE_{k % 2}"
            folder.mkdir(parents=True, exist_ok=True)
            mesh = chair(k % 2)
            rows = [f"v {x} {y} {z}" for x, y, z in mesh.vertices]
            rows += [f"f {a} {b} {c}" for a, b, c in mesh.faces + 1]
            (folder / "model.obj").write_text("\n".join(rows))
            photo = np.random.default_rng(k).integers(0, 200, (90, 120, 3), np.uint8)
            mask = np.zeros((90, 120), np.uint8)
            mask[20:70, 40:80], photo[20:70, 40:80] = 255, (200, 100, 50)
            for kind, pixels in (("img", photo), ("mask", mask)):
                (tmp_path / kind).mkdir(exist_ok=True)
                Image.fromarray(pixels).save(tmp_path / kind / f"{k}.png")
            entries.append(
                {
                    "img": f"img/{k}.png",
                    "mask": f"mask/{k}.png",
                    "model": f"model/chair/SHAPE_{k % 2}/model.obj",
                    "category": "chair",
                    "bbox": [40, 20, 80, 70],
                    "cam_position": [-1.0, 0.0, -1.0],
                    "truncated": k == 2,
                }
            )
        entries[0] |= changes
        (tmp_path / "pix3d.json").write_text(json.dumps(entries))
        return Pix3dSource(tmp_path)

    return write


def test_photographs_are_cut_out_and_as_large_as_rendered_objects(pix3d, tmp_path):
    source = pix3d()
    assert source.shape_ids("chair") == ["0", "1"]
    assert len(Pix3dSource(tmp_path, without=[]).shape_ids("chair")) == 3
    prepared = Preparation(source, "chair", 32, VIEW, tmp_path, workers=1, progress=False).run()
    image = prepared.image(0)
    rows, columns = (np.flatnonzero((image[..., 3] > 127).any(axis)) for axis in (1, 0))
    assert np.ptp(rows) + 1 == pytest.approx(OBJECT_FILL * 48, abs=1)
    assert (np.ptp(columns) + 1) / (np.ptp(rows) + 1) == pytest.approx(40 / 50, abs=0.05)
    assert image[24, 32].tolist() == [200, 100, 50, 255]
    assert image[0, 0].tolist() == [255, 255, 255, 0]
    azimuth = prepared.camera(0).azimuth
    assert azimuth == pytest.approx(-45)


def test_no_photographs_of_a_shape_are_on_both_sides(pix3d, tmp_path):
    pix3d()
    source = Pix3dSource(tmp_path, without=[])
    split = source.split("chair")
    assert split["0"] == split["2"]
    assert set(split) == {"0", "1", "2"}


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"img": "../secret.png"}, "leads out of the data set"),
        ({"bbox": [1, 2]}, "no 'bbox' of four numbers"),
        ({"bbox": [0, 0, 10, 10]}, "its mask is empty"),
        ({"mask": "mask/absent.png"}, "it has no mask/absent.png"),
    ],
)
def test_what_cannot_be_used_is_rejected(pix3d, changes, reason):
    source = pix3d(**changes)
    shape_id = source.shape_ids("chair")[-1 if "img" in changes else 0]
    with pytest.raises(RejectedShapeError, match=reason):
        source.load("chair", shape_id)


def test_mistakes_are_named(tmp_path):
    with pytest.raises(DataError, match=r"set data\.root to Pix3D's folder"):
        Pix3dSource(tmp_path).categories()
    with pytest.raises(ValueError, match="without=blurred must be of"):
        Pix3dSource(tmp_path, without=["blurred"])
