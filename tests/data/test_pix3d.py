"""Miniature Pix3D trees: renderings of procedural shapes on noise, with masks, good and bad."""

import functools
import json
import pickle
import struct
import zlib

import numpy as np
import pytest
from PIL import Image
from shapenet_tree import model_text

from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.base import Source
from ffd_lightning.data.sources.pix3d import FLAWS, Pix3dSource
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import ConfigError, DataError, RejectedShapeError
from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.pictures import OBJECT_FILL, cut_out, fit_picture
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render

SIZE = {"height": 48, "width": 64}
FRAMING = Camera(azimuth=45.0, elevation=30.0)
chair_text = functools.cache(model_text)


@functools.cache
def rendering(index=0, category="chair", camera=FRAMING, **view):
    mesh = ProceduralSource(60).load(category, f"{category}-{index:06d}").mesh
    mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
    return render(mesh, camera, **{"height": 96, "width": 128, "samples": 2} | view)


def extent(image):
    """Height and width of what is covered, in pixels."""
    covered = image[..., 3] > 127
    return [int(np.ptp(covered.any(axis).nonzero()[0])) + 1 for axis in (1, 0)]


def on_noise(image, corner, size, seed=0):
    """Paste a rendering on noise: the photograph, its mask, and the box of what is covered."""
    photo = np.random.default_rng(seed).integers(0, 256, (*size, 3), np.uint8)
    mask = np.zeros(size, np.uint8)
    y, x = corner
    window = np.s_[y : y + image.shape[0], x : x + image.shape[1]]
    alpha = (image[..., 3:] > 127).astype(np.uint8)
    photo[window] = alpha * image[..., :3] + (1 - alpha) * photo[window]
    mask[window] = 255 * alpha[..., 0]
    rows, columns = mask.any(1).nonzero()[0], mask.any(0).nonzero()[0]
    box = [int(n) for n in (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1)]
    return photo, mask, box


class Tree:
    """Writes Pix3D's files below a root."""

    def __init__(self, root):
        self.root, self.entries = root, []
        for k in range(2):
            obj, mtl = chair_text(k)
            self.write(f"model/chair/SHAPE_{k}/model.obj", obj.replace("{stem}", "model").encode())
            self.write(f"model/chair/SHAPE_{k}/model.mtl", mtl.encode())
        for k in range(3):
            self.photo(f"{k + 1:04d}", k % 2)

    def write(self, name, content):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)

    def picture(self, name, pixels, **options):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        Image.fromarray(pixels).save(self.root / name, **options)

    def photo(self, stem, shape=0, **fields):
        """Write a photograph with its mask and list it; `fields` replace those of its entry."""
        photo, mask, box = on_noise(rendering(shape), (30, 50), (180, 240))
        entry = {
            "img": f"img/chair/{stem}.png",
            "category": "chair",
            "img_size": [240, 180],
            "mask": f"mask/chair/{stem}.png",
            "model": f"model/chair/SHAPE_{shape}/model.obj",
            "cam_position": [0.1, 0.5, -1.2],
            "bbox": box,
            "truncated": False,
            "occluded": False,
            "slightly_occluded": False,
        }
        self.picture(entry["img"], photo)
        self.picture(entry["mask"], mask)
        self.entries.append({k: v for k, v in (entry | fields).items() if v is not None})
        return self.source()

    def source(self, **options):
        self.write("pix3d.json", json.dumps(self.entries).encode())
        return Pix3dSource(self.root, **SIZE | options)


@pytest.fixture
def tree(tmp_path):
    return Tree(tmp_path / "pix3d")


def test_photographs_come_with_their_meshes(tree):
    source = tree.source()
    assert isinstance(source, Source)
    assert source.categories() == ["chair"]
    assert source.shape_ids("chair") == ["0001", "0002", "0003"]
    copy = pickle.loads(pickle.dumps(source))
    for k, name in enumerate(source.shape_ids("chair")):
        model = source.load("chair", name)
        expected = ProceduralSource(4).load("chair", f"chair-{k % 2:06d}").mesh
        assert len(model.mesh.faces) == len(expected.faces)
        assert len(np.unique(model.mesh.face_colors, axis=0)) > 1  # from the material library
        np.testing.assert_allclose(model.mesh.vertices.max(0), expected.vertices.max(0), atol=1e-5)
        assert model.images.shape == (1, 48, 64, 4)
        assert model.images.dtype == np.uint8
        np.testing.assert_array_equal(copy.load("chair", name).images, model.images)
    with pytest.raises(RejectedShapeError, match="no photograph '9'"):
        source.load("chair", "9")
    turned = tree.source(up="z", yaw=90).load("chair", "0001").mesh
    x, y, z = source.load("chair", "0001").mesh.vertices.T
    np.testing.assert_array_equal(turned.vertices, np.stack([-y, z, -x], 1))


# --- images -------------------------------------------------------------------------------------


def test_the_object_is_framed_as_in_rendered_images(tree):
    image = tree.source(height=96, width=128).load("chair", "0001").images[0]
    inner = rendering(0)
    rows, columns = ((inner[..., 3] > 127).any(axis).nonzero()[0] for axis in (1, 0))
    inner = inner[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    expected = fit_picture(Image.fromarray(inner), 96, 128, OBJECT_FILL)
    height, width = extent(image)
    assert max(height, width) / 96 == pytest.approx(OBJECT_FILL, abs=1 / 96)
    assert width / height == pytest.approx(inner.shape[1] / inner.shape[0], rel=0.03)
    difference = np.abs(image.astype(int) - expected)
    assert difference[..., 3].mean() < 6
    assert difference[..., :3].mean() < 6
    outside = image[..., 3] == 0
    assert outside.mean() > 0.4
    assert image[outside][:, :3].min() > 230  # of the noise nothing is left
    assert image[0, 0].tolist() == image[-1, -1].tolist() == [255, 255, 255, 0]


def test_objects_fill_rendered_images_as_the_constant_says():
    fills = []
    for category in ("chair", "table", "sofa", "cabinet", "lamp", "bench"):
        for k in range(10):
            height, width = extent(rendering(k, category, samples=1))
            fills.append(max(height, width) / 96)
    assert np.median(fills) == pytest.approx(OBJECT_FILL, abs=0.02)
    assert RenderSettings().cameras() == (FRAMING,)


@pytest.mark.parametrize("size", [(10, 150), (150, 10), (3, 3), (150, 200)])
def test_any_object_fits(tree, size):
    mask = np.zeros((180, 240), np.uint8)
    mask[20 : 20 + size[0], 30 : 30 + size[1]] = 255
    tree.picture("mask/chair/0001.png", mask)
    tree.entries[0]["bbox"] = [0, 0, 240, 180]
    height, width = extent(tree.source().load("chair", "0001").images[0])
    assert max(height, width) / 48 == pytest.approx(OBJECT_FILL, abs=1.1 / 48)
    assert width / height == pytest.approx(size[1] / size[0], rel=0.25)
    narrow = tree.source(height=64, width=32).load("chair", "0001").images[0]
    assert narrow.shape == (64, 32, 4)
    height, width = extent(narrow)
    assert width / height == pytest.approx(size[1] / size[0], rel=0.25)  # not cut off


def test_specks_outside_of_the_box_are_not_taken(tree):
    expected = tree.source().load("chair", "0001").images
    mask = np.array(Image.open(tree.root / "mask/chair/0001.png"))
    mask[:5, :5] = mask[-5:, -5:] = 255
    tree.picture("mask/chair/0001.png", mask)
    np.testing.assert_array_equal(tree.source().load("chair", "0001").images, expected)
    tree.entries[0]["bbox"] = [-50, 0, 1e9, 180.5]
    assert (tree.source().load("chair", "0001").images != expected).any()


def test_masks_and_photographs_of_any_mode(tree):
    expected = tree.source().load("chair", "0001").images
    photo = Image.open(tree.root / "img/chair/0001.png")
    mask = Image.open(tree.root / "mask/chair/0001.png")
    for mode in ("1", "P", "RGB", "RGBA", "LA"):
        mask.convert(mode).save(tree.root / "mask/chair/0001.png")
        np.testing.assert_array_equal(tree.source().load("chair", "0001").images, expected)
    for scale in (np.uint8(1), np.uint16(257)):
        tree.picture("mask/chair/0001.png", np.asarray(mask) // 255 * scale)
        np.testing.assert_array_equal(tree.source().load("chair", "0001").images, expected)
    mask.save(tree.root / "mask/chair/0001.png")
    photo.convert("RGBA").save(tree.root / "img/chair/0001.png")
    np.testing.assert_array_equal(tree.source().load("chair", "0001").images, expected)
    photo.convert("L").save(tree.root / "img/chair/0001.png")
    grey = tree.source().load("chair", "0001").images
    for mode in ("L", "CMYK"):
        photo.convert(mode).save(tree.root / "img/chair/0001.png", "JPEG", quality=95)
        image = tree.source().load("chair", "0001").images
        np.testing.assert_array_equal(image[..., 3], expected[..., 3])
        np.testing.assert_allclose(
            image[..., :3].mean((1, 2)), expected[..., :3].mean((1, 2)), atol=12
        )
    tree.picture("img/chair/0001.png", np.asarray(photo.convert("L")).astype(np.uint16) * 257)
    assert np.abs(tree.source().load("chair", "0001").images.astype(int) - grey).max() <= 1
    clear = np.full((180, 240, 4), (9, 9, 9, 0), np.uint8)
    tree.picture("img/chair/0001.png", clear)
    assert tree.source().load("chair", "0001").images[..., :3].min() == 255


def oriented(tree, orientation):
    """Save the first photograph with an orientation in its EXIF data, which do not turn pixels."""
    photo = Image.open(tree.root / "img/chair/0001.png")
    exif = Image.Exif()
    exif[0x0112] = orientation
    photo.save(tree.root / "img/chair/0001.png", exif=exif)
    return photo


@pytest.mark.parametrize("orientation", [3, 6, 8])
def test_a_photograph_that_fits_its_mask_is_not_turned(tree, orientation):
    expected = tree.source().load("chair", "0001").images
    oriented(tree, orientation)
    np.testing.assert_array_equal(tree.source().load("chair", "0001").images, expected)


def test_a_photograph_that_fits_its_mask_once_turned_is_turned(tree):
    expected = tree.source().load("chair", "0001").images
    path = tree.root / "img/chair/0001.png"
    Image.open(path).transpose(Image.Transpose.ROTATE_90).save(path)
    with pytest.raises(RejectedShapeError, match="240 x 180 pixels, its photograph 180 x 240"):
        tree.source().load("chair", "0001")
    oriented(tree, 6)
    np.testing.assert_array_equal(tree.source().load("chair", "0001").images, expected)


# --- what is rejected ---------------------------------------------------------------------------


def png_header(width, height):
    """A PNG that ends where its pixels should begin."""
    data = b"IHDR" + struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    header = struct.pack(">I", 13) + data + struct.pack(">I", zlib.crc32(data))
    return b"\x89PNG\r\n\x1a\n" + header + struct.pack(">I", 999_999) + b"IDAT"


BAD_PICTURES = {
    "empty": (b"", "cannot be read"),
    "too large": (png_header(9000, 9000), "is too large: 9,000 x 9,000"),
    "PostScript": (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n", "cannot be read"),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kind", ["img", "mask"])
@pytest.mark.parametrize("name", BAD_PICTURES)
def test_bad_pictures_are_rejected_by_name(tree, kind, name):
    content, reason = BAD_PICTURES[name]
    tree.write(f"{kind}/chair/0002.png", content)
    with pytest.raises(RejectedShapeError, match=rf"^{kind}/chair/0002\.png {reason}"):
        tree.source().load("chair", "0002")


@pytest.mark.parametrize("kind", ["img", "mask"])
def test_missing_and_truncated_pictures_are_rejected_by_name(tree, kind):
    path = tree.root / kind / "chair" / "0001.png"
    for form in ("PNG", "JPEG"):
        Image.open(path).save(path, form)
        whole = path.read_bytes()
        path.write_bytes(whole[: len(whole) // 2])
        with pytest.raises(RejectedShapeError, match=rf"^{kind}/chair/0001\.png cannot be read"):
            tree.source().load("chair", "0001")
        path.write_bytes(whole)
    path.unlink()
    with pytest.raises(RejectedShapeError, match=rf"^it has no {kind}/chair/0001\.png"):
        tree.source().load("chair", "0001")


def test_masks_that_do_not_fit_or_show_nothing(tree):
    tree.picture("mask/chair/0001.png", np.full((180, 241), 255, np.uint8))
    with pytest.raises(RejectedShapeError, match=r"mask has 241 x 180 pixels, its .* 240 x 180"):
        tree.source().load("chair", "0001")
    tree.picture("mask/chair/0001.png", np.zeros((180, 240), np.uint8))
    with pytest.raises(RejectedShapeError, match="mask is empty"):
        tree.source().load("chair", "0001")
    for box in ([0, 0, 4, 4], [500, 500, 600, 600], [100, 100, 50, 50]):
        tree.entries[1]["bbox"] = box
        with pytest.raises(RejectedShapeError, match="mask is empty"):
            tree.source().load("chair", "0002")


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({"mask": None}, "no 'mask'"),
        ({"model": None}, "no 'model'"),
        ({"bbox": [1, 2, 3, float("nan")]}, "no 'bbox' of four numbers"),
        ({"model": "model/chair/GONE/model.obj"}, "it has no model/chair/GONE/model.obj"),
        ({"model": "model/chair/SHAPE_0/model.mtl"}, "model.mtl"),
        ({"img": "../secret/0009.png"}, "leads out of the data set"),
        ({"img": "{root}/../secret/0009.png"}, "leads out of the data set"),
        ({"img": "C:\\secret\\0009.png"}, "leads out of the data set"),
        ({"model": "../model.obj"}, "leads out of the data set"),
        ({"img": "img/chair/nul\0/0009.png"}, "cannot be read"),
    ],
)
def test_bad_entries_are_rejected_and_the_others_are_not(tree, fields, reason):
    for name in ("secret/0009.png", "mask.png", "model.obj"):
        tree.write(f"../{name}", b"found")
    if "{root" in str(fields.get("img")):
        fields = {"img": fields["img"].format(root=tree.root)}
    img = fields.get("img", "img/chair/0009.png")
    source = tree.photo("0009")
    tree.entries[-1] = {k: v for k, v in (tree.entries[-1] | fields).items() if v is not None}
    source = tree.source()
    name = "C:\\secret\\0009" if img.startswith("C:") else "0009"
    assert source.shape_ids("chair") == sorted(["0001", "0002", "0003", name])
    with pytest.raises(RejectedShapeError, match=reason):
        source.load("chair", name)
    assert len(source.load("chair", "0003").mesh.faces) > 10
    json.dumps(source.fingerprint("chair"))
    assert set(source.split("chair")) == set(source.shape_ids("chair"))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, r"pix3d\.json cannot be read .*set data\.root"),
        (b'[{"img": "img/chair/0001.png", "cat', "damaged or incomplete"),
        (b"[" * 100_000, "damaged or incomplete"),
        (b"[]", "must be a list"),
        (b"[7]", r"entry 0 \(from 0\) .* has no 'category'"),
    ],
)
def test_a_broken_list_is_named(tmp_path, content, message):
    if content is not None:
        (tmp_path / "pix3d.json").write_bytes(content)
    with pytest.raises(DataError, match=message):
        Pix3dSource(tmp_path).shape_ids("chair")


# --- which photographs there are ----------------------------------------------------------------


def test_flawed_photographs_are_left_out(tree):
    for k, flaw in enumerate(FLAWS):
        tree.photo(f"001{k}", **{flaw: True})
    tree.photo("0020", occluded="true", truncated="false")
    plain = ["0001", "0002", "0003"]
    assert tree.source().shape_ids("chair") == [*plain, "0012"]
    assert tree.source(leave_out=()).shape_ids("chair") == [*plain, "0010", "0011", "0012", "0020"]
    assert tree.source(leave_out=FLAWS).shape_ids("chair") == plain
    with pytest.raises(RejectedShapeError, match="no photograph '0010'"):
        tree.source().load("chair", "0010")
    with pytest.raises(ConfigError, match="'blurred': choose from truncated, occluded, s"):
        tree.source(leave_out=("truncated", "blurred"))


def test_what_is_missing_is_named_with_what_there_is(tree):
    tree.photo("0004", category="sofa", truncated=True)
    tree.photo("0005", category="bed")
    assert tree.source().categories() == ["bed", "chair"]
    for ask in ("shape_ids", "fingerprint", "split", "facing"):
        with pytest.raises(DataError, match=r"has no table; it has: bed, chair$"):
            getattr(tree.source(), ask)("table")
    with pytest.raises(DataError, match=r"all 1 photographs of sofa are left out: shorten data\."):
        tree.source().shape_ids("sofa")


def test_ids_are_unique(tree):
    before = tree.source().load("chair", "0001").images
    tree.entries += [
        tree.entries[0] | {"model": "model/chair/SHAPE_1/model.obj"},
        tree.entries[0] | {"img": "img/chair/0001-2.jpg"},
        tree.entries[0] | {"category": "bed"},
    ]
    source = tree.source()
    assert source.shape_ids("chair") == ["0001", "0001-2", "0001-2-2", "0002", "0003"]
    assert source.shape_ids("bed") == ["0001"]
    first, second = (source.load("chair", name) for name in ("0001", "0001-2"))
    np.testing.assert_array_equal(first.images, before)
    np.testing.assert_array_equal(second.images, before)
    assert len(first.mesh.faces) != len(second.mesh.faces)


def test_no_shape_is_on_both_sides(tree):
    model = "model/chair/NUMBER_{}/model{}.obj"
    for k in range(300):
        changed = {"img": f"img/chair/x{k}.png", "model": model.format(k // 3, k % 2)}
        tree.entries.append(tree.entries[0] | changed)
    source = tree.source()
    parts = source.split("chair")
    assert sorted(parts) == source.shape_ids("chair")
    assert parts["0001"] == parts["0003"]
    for k in range(0, 300, 3):
        assert parts[f"x{k}"] == parts[f"x{k + 1}"] == parts[f"x{k + 2}"]
    assert set(parts.values()) == {"train", "test"}
    assert 0.7 < list(parts.values()).count("train") / len(parts) < 0.9
    del tree.entries[5:]
    assert tree.source().split("chair").items() <= parts.items()


def test_fingerprint_follows_all_that_decides(tree):
    def one(**options):
        return json.dumps(tree.source(**options).fingerprint("chair"), sort_keys=True)

    first = one()
    tree.photo("0009", category="bed")
    tree.entries[0]["focal_length"] = 35.0  # is not used
    assert one() == one(leave_out=("occluded", "truncated")) == first
    seen = [first, one(up="z"), one(yaw=90.0), one(height=96), one(width=96), one(leave_out=())]
    tree.entries[0]["bbox"] = [0, 0, 240, 180]
    seen.append(one())
    tree.entries[0]["truncated"] = True
    seen.append(one())
    for kind in ("img", "mask"):
        tree.write(f"{kind}/chair/0002.png", b"damaged")
        seen.append(one())
    tree.write("model/chair/SHAPE_0/textures/wood.png", b"new")
    seen.append(one())
    (tree.root / "model/chair/SHAPE_0/model.obj").unlink()
    seen.append(one())
    assert len(set(seen)) == len(seen)


def test_facing_is_where_the_cameras_are(tree):
    for entry, azimuth in zip(tree.entries, (-30.0, 10.0, 50.0), strict=True):
        x, z = 2 * np.sin(np.radians(azimuth)), -2 * np.cos(np.radians(azimuth))
        entry["cam_position"] = [x, 0.7, z]
    assert tree.source().facing("chair") == pytest.approx(10.0)
    # Turned anticlockwise, the front and the cameras go from -z to -x, which is azimuth -90.
    assert tree.source(yaw=90).facing("chair") == pytest.approx(-80.0)
    assert tree.source(yaw=185).facing("chair") == pytest.approx(-175.0)
    for entry in tree.entries:
        x, y, z = entry["cam_position"]
        entry["cam_position"] = [x, -z, y]
    assert tree.source(up="z").facing("chair") == pytest.approx(10.0)
    for wrong in ([0, 1, 0], [1, 2], None, "there", [1, 2, float("inf")]):
        tree.entries[0]["cam_position"] = wrong
        assert tree.source(up="y").facing("chair") is not None
        for entry in tree.entries:
            entry["cam_position"] = wrong
        assert tree.source(up="y").facing("chair") is None
        tree.entries[1]["cam_position"] = [0, 0, -1]
        assert tree.source(up="y").facing("chair") == pytest.approx(0)
    tree.entries[2]["cam_position"] = [0, 0, 1]
    assert tree.source().facing("chair") is None


def test_survey_finds_what_is_missing_and_a_wrong_yaw(tree):
    tree.photo("0004", model="model/chair/GONE/model.obj")
    tree.photo("0005", mask=None)
    tree.photo("0006", truncated=True)
    for entry in tree.entries:
        entry["cam_position"] = [1.0, 0.5, 0.0]
    seen = tree.source(yaw=-5).survey("chair")
    assert seen.faults == {
        "0004": "it has no model/chair/GONE/model.obj",
        "0005": "its entry in pix3d.json has no 'mask'",
    }
    assert "1 more are left out" in seen.notes[0]
    assert "at 95 degrees" in seen.notes[1]
    assert seen.notes[1].endswith("data.yaw=90 meant?")
    right = tree.source(yaw=90)
    assert right.facing("chair") == pytest.approx(0)
    assert "data.yaw" not in right.survey("chair").notes[1]


def test_preparation(tree, tmp_path):
    tree.photo("0004", model="model/chair/GONE/model.obj")
    tree.photo("0005", truncated=True)
    view = RenderSettings(**SIZE, samples=1)
    source = tree.source()
    prepared = Preparation(source, "chair", 32, view, tmp_path, workers=1, progress=False).run()
    assert list(prepared.ids) == ["0001", "0002", "0003"]
    assert prepared.manifest["rejected"] == 1
    assert (len(prepared), *prepared.image_shape) == (3, 1, 48, 64, 4)
    np.testing.assert_array_equal(prepared.image(1), source.load("chair", "0002").images[0])


def test_cut_out_is_as_large_as_the_object(tree):
    entry = tree.entries[0]
    cut = cut_out(tree.root, entry["img"], entry["mask"], entry["bbox"])
    left, top, right, bottom = entry["bbox"]
    assert (cut.mode, cut.size) == ("RGBA", (right - left, bottom - top))
    photo = np.asarray(Image.open(tree.root / entry["img"]))[top:bottom, left:right]
    np.testing.assert_array_equal(np.asarray(cut)[..., :3], photo)
