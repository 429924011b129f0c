import pickle
import zipfile

import numpy as np
import pytest
from PIL import Image
from projection import pixels_of
from shapenet_tree import BAD, CHAIR, GOOD, bad_models, good_models, write_folder, write_zips
from trees import png

from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.r2n2 import R2n2Images
from ffd_lightning.data.sources.shapenet import ShapeNetSource
from ffd_lightning.errors import DataError, RejectedShapeError
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render


@pytest.mark.parametrize(
    ("layout", "kept"),
    [("v1", "folder"), ("v1", "zip"), ("v2", "zip without the synset"), ("v2", "one level down")],
)
def test_good_shapes_come_through_and_bad_ones_are_named(tmp_path, layout, kept):
    files = good_models(layout) | bad_models(layout)
    if kept.startswith("zip"):
        write_zips(tmp_path, files, prefix=kept == "zip")
    else:
        write_folder(tmp_path / ("" if kept == "folder" else f"ShapeNetCore.{layout}"), files)
    source = ShapeNetSource(tmp_path)
    assert source.categories() == ["chair"]
    assert source.shape_ids("chair") == sorted([*GOOD, *BAD])
    source = pickle.loads(pickle.dumps(source))
    meshes = {name: source.load("chair", name).mesh for name in GOOD}
    assert all(len(mesh.faces) > 10 for mesh in meshes.values())
    assert meshes["plain"].textures == ()
    assert len(np.unique(meshes["plain"].face_colors, axis=0)) > 1
    assert meshes["textured"].textures[0][0, 0].tolist() == [200, 30, 30, 255]
    assert meshes["windows"].textures[0][0, 0].tolist() == [30, 200, 30, 255]
    for name, (_, reason) in BAD.items():
        with pytest.raises(RejectedShapeError, match=reason):
            source.load("chair", name)
    assert source.fingerprint("chair")["version"] == int(layout[1])


def test_the_fingerprint_follows_the_files_and_not_how_they_are_kept(tmp_path):
    files = good_models("v1")
    source = ShapeNetSource(write_folder(tmp_path / "a", files))
    write_folder(tmp_path / "a", {f"{CHAIR}/{path}": b"?" for path in (".x", "plain/.x")})
    packed = ShapeNetSource(write_zips(tmp_path / "b", files))
    seen = [source.fingerprint("chair")]
    assert packed.fingerprint("chair") == seen[0]
    changes = [{path: files[path] + b"#"} for path in files if "textured" in path]
    changes.append({f"{CHAIR}/nomtl/model.mtl": b"Kd 1 0 0"})
    for k, change in enumerate(changes):
        changed = ShapeNetSource(write_folder(tmp_path / f"changed{k}", files | change))
        seen.append(changed.fingerprint("chair"))
    assert len(seen) == 5, "mesh, materials, a texture, and materials that were absent"
    assert all(seen.count(one) == 1 for one in seen)


def test_nothing_outside_of_an_archive_or_a_shape_is_read(tmp_path):
    files = good_models("v1")
    (tmp_path / "secret.mtl").write_text("newmtl m0\nKd 1 0 0\n")
    write_zips(tmp_path / "root", files)
    with zipfile.ZipFile(tmp_path / "root" / f"{CHAIR}.zip", "a") as archive:
        obj = "mtllib ../../secret.mtl\n" + files[f"{CHAIR}/plain/model.obj"].decode()
        for path in ("sly", "../evil", "/absolute", "\\windows\\"):
            archive.writestr(f"{'' if path[0] == '/' else CHAIR + '/'}{path}/model.obj", obj)
    source = ShapeNetSource(tmp_path / "root")
    assert source.shape_ids("chair") == sorted([*GOOD, "sly"])
    colors = source.load("chair", "sly").mesh.face_colors
    assert not (colors == [255, 0, 0, 255]).all(1).any()


def test_a_folder_whose_name_is_no_text_is_named(tmp_path):
    root = write_folder(tmp_path, good_models("v1"))
    (root / CHAIR / "st\udcfchle").mkdir()
    with pytest.raises(DataError, match=r"is no text: st\\udcfchle; rename it"):
        ShapeNetSource(root).shape_ids("chair")


@pytest.mark.parametrize("share", [0, 0.5])
def test_a_damaged_archive_is_named(tmp_path, share):
    write_zips(tmp_path, good_models("v1"))
    archive = tmp_path / f"{CHAIR}.zip"
    data = archive.read_bytes()
    archive.write_bytes(data[: int(share * len(data))])
    with pytest.raises(DataError, match=rf"{CHAIR}\.zip is damaged or incomplete"):
        ShapeNetSource(tmp_path).shape_ids("chair")


def test_a_damaged_member_is_rejected_and_the_others_are_not(tmp_path):
    write_zips(tmp_path, good_models("v1"))
    archive = tmp_path / f"{CHAIR}.zip"
    with zipfile.ZipFile(archive) as z:
        info = z.getinfo(f"{CHAIR}/plain/model.obj")
    data = bytearray(archive.read_bytes())
    middle = info.header_offset + info.compress_size // 2
    data[middle : middle + 50] = bytes(50)
    archive.write_bytes(data)
    source = ShapeNetSource(tmp_path)
    with pytest.raises(RejectedShapeError, match=r"model\.obj cannot be read"):
        source.load("chair", "plain")
    assert len(source.load("chair", "textured").mesh.faces) > 10


METADATA = [(15.0 * k, 25.0 + k / 10, 0.0, 0.7 + k / 100, 25.0) for k in range(24)]


@pytest.fixture
def rendered(tmp_path):
    """The folder of renderings of `plain`: a red square on nothing, in view 3 a green one."""
    folder = tmp_path / "ShapeNetRendering" / CHAIR / "plain" / "rendering"
    folder.mkdir(parents=True)
    for view in range(24):
        picture = np.zeros((137, 137, 4), np.uint8)
        picture[40:97, 40:97] = (30, 200, 30, 255) if view == 3 else (200, 30, 30, 255)
        Image.fromarray(picture).save(folder / f"{view:02d}.png")
    return folder


@pytest.fixture
def source(rendered, tmp_path):
    return ShapeNetSource(write_folder(tmp_path / "v1", good_models("v1")), "r2n2", tmp_path)


def write_metadata(folder, rows=METADATA):
    text = "\n".join(" ".join(map(str, row)) for row in rows) + "\n"
    (folder / "rendering_metadata.txt").write_text(text)


def prepare(source, root, height=48, width=64):
    view = RenderSettings(height=height, width=width, samples=1)
    return Preparation(source, "chair", 32, view, root, workers=1, progress=False).run()


def test_renderings_are_fitted_and_not_distorted(source, tmp_path):
    prepared = prepare(source, tmp_path)
    assert prepared.ids == ("plain",)
    assert prepared.image_shape == (24, 48, 64, 4)
    assert len(prepared.rejected) == 3
    images = np.stack([prepared.image(0, k) for k in range(24)])
    assert images[3, 24, 32].tolist() == [30, 200, 30, 255]
    assert images[4, 24, 32].tolist() == [200, 30, 30, 255]
    assert images[0, 0, 0].tolist() == images[0, 24, 9].tolist() == [255, 255, 255, 0]
    covered = images[0, ..., 3] > 127
    assert np.ptp(covered.any(0).nonzero()[0]) == np.ptp(covered.any(1).nonzero()[0])
    assert prepared.camera(0, 5) == Camera(), "it is unknown, so one that frames the shape"


def test_the_fingerprint_follows_renderings_and_their_cameras(rendered, tmp_path):
    images = R2n2Images(tmp_path)
    seen = [images.fingerprint("chair")]
    for change in (
        lambda: write_metadata(rendered),
        lambda: (rendered / "07.png").write_bytes(png()),
        lambda: (rendered / "07.png").unlink(),
    ):
        change()
        seen.append(images.fingerprint("chair"))
    assert all(seen.count(one) == 1 for one in seen)


@pytest.mark.parametrize("content", [None, png()[:-30], b"GIF89a" + bytes(50)])
def test_renderings_that_are_missing_or_damaged(source, rendered, content):
    file = rendered / "07.png"
    file.unlink() if content is None else file.write_bytes(content)
    with pytest.raises(RejectedShapeError, match=r"rendering/07\.png"):
        source.load("chair", "plain")
    with pytest.raises(RejectedShapeError, match=r"it has no rendering/00\.png"):
        source.load("chair", "textured")


def test_renderings_of_version_1_are_not_mixed_with_version_2(rendered, tmp_path):
    root = write_folder(tmp_path / "v2", good_models("v2"))
    with pytest.raises(DataError, match=r"3D-R2N2's renderings are of v1.*data\.mix_versions=true"):
        ShapeNetSource(root, "r2n2", tmp_path).shape_ids("chair")
    mixed = ShapeNetSource(root, "r2n2", tmp_path, mix_versions=True)
    assert mixed.load("chair", "plain").images[3].shape == (137, 137, 4)


def test_renderings_that_are_not_there(tmp_path):
    source = ShapeNetSource(write_folder(tmp_path, good_models("v1")), "r2n2")
    (tmp_path / "ShapeNetRendering.tgz").touch()
    with pytest.raises(DataError, match=r"data\.images_root.*unpack .*ShapeNetRendering\.tgz"):
        source.fingerprint("chair")


def test_shapes_of_both_versions_face_the_same_way(tmp_path):
    """v1 faces +x, v2 faces -z: what points to the front does so afterwards in both."""
    arrow = "v {0} 0 {1}\nv -0.1 0.1 -0.1\nv 0.1 0.2 0.1\nf 1 2 3\n"
    files = {
        "v1": {f"{CHAIR}/a/model.obj": arrow.format(1, 0)},
        "v2": {f"{CHAIR}/a/models/model_normalized.obj": arrow.format(0, -1)},
    }
    for version, content in files.items():
        source = ShapeNetSource(write_folder(tmp_path / version, content))
        np.testing.assert_allclose(source.load("chair", "a").mesh.vertices[0], [0, 0, -1])


def seen_by_3d_r2n2(points, azimuth, elevation, ratio):
    """Columns and rows in 137 pixels of v1's points, by the matrices of Blender's camera.

    The .obj importer turns y up into z up; the camera stands on the x axis and is turned about y
    and z; its lens has 35 mm, its sensor 32 mm.
    """
    blender = np.asarray(points)[:, [0, 2, 1]] * [1, -1, 1]
    a, e = -np.radians(azimuth), np.radians(elevation)
    about_z = np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0], [0, 0, 1]])
    about_y = np.array([[np.cos(e), 0, -np.sin(e)], [0, 1, 0], [np.sin(e), 0, np.cos(e)]])
    local = blender @ (about_z @ about_y)
    depth = 1.75 * ratio - local[:, 0]
    focal = 35 / 32 * 137
    return np.stack([68.5 + focal * local[:, 1] / depth, 68.5 - focal * local[:, 2] / depth], 1)


@pytest.mark.parametrize(("height", "width"), [(48, 64), (64, 48)])
def test_cameras_of_renderings_are_those_of_their_metadata(
    source, rendered, tmp_path, height, width
):
    write_metadata(rendered)
    prepared = prepare(source, tmp_path, height, width)
    turned_back = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0.0]])  # -z becomes v1's +x
    raw = ShapeNetSource(tmp_path / "v1").load("chair", "plain").mesh.vertices @ turned_back
    scale = min(height, width) / 137
    margin = np.array([width - 137 * scale, height - 137 * scale]) / 2
    assert np.abs(raw.mean(0)).max() > 1e-3, "and the shape is not centred"
    for k, (azimuth, elevation, _, ratio, _) in enumerate(METADATA):
        pixels, _ = pixels_of(prepared.camera(0, k), prepared.mesh(0).vertices, height, width)
        expected = seen_by_3d_r2n2(raw, azimuth, elevation, ratio) * scale + margin
        np.testing.assert_allclose(pixels, expected, atol=1e-3)


@pytest.mark.parametrize(
    ("rows", "reason"),
    [
        (None, "it has no rendering_metadata.txt"),
        ([*METADATA[:23], (1, 2, "nan", 1, 25)], "not 24 lines of five numbers"),
        ([*METADATA[:23], ("x", 2, 0, 1, 25)], "cannot be read"),
        ([*METADATA[:23], (1, 2, 30, 1, 25)], "turned cameras"),
    ],
)
def test_images_are_good_without_their_cameras(source, rendered, rows, reason):
    if rows is not None:
        write_metadata(rendered, rows)
    shape = source.load("chair", "plain")
    assert shape.cameras is None
    assert len(shape.images) == 24
    assert reason in shape.warning


def test_an_image_of_another_shape_is_noticed(source, rendered):
    write_metadata(rendered)
    shape = source.load("chair", "plain")
    assert "silhouettes agree to 0." in shape.warning
    own = render(shape.mesh, shape.cameras[0], height=137, width=137)
    Image.fromarray(own).save(rendered / "00.png")
    assert source.load("chair", "plain").warning == ""
