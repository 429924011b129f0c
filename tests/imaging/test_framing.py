"""Photographs made from renderings: plain, noisy, turned, masked, of all modes, damaged."""

import functools
import io
import os
import struct
import sys
import types
import zlib

import numpy as np
import pytest
from PIL import Image

from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.mesh import normalize
from ffd_lightning.imaging import framing
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.framing import frame_photo
from ffd_lightning.imaging.photos import read_photo
from ffd_lightning.imaging.render_settings import CameraModel, RenderSettings
from ffd_lightning.imaging.rendering import render

SIZE = {"height": 96, "width": 128}
FRAMED = Camera()


@functools.cache
def rendering(height=96, shape="chair-000000", camera=FRAMED):
    mesh = ProceduralSource(60).load(shape[:-7], shape).mesh
    mesh = mesh.with_vertices(normalize(mesh.vertices, mesh.faces))
    return render(mesh, camera, height=height, width=height * 4 // 3, samples=2)


def extent(image):
    """Width and height of what is covered, in pixels."""
    covered = image[..., 3] > 127
    return [int(np.ptp(covered.any(axis).nonzero()[0])) + 1 for axis in (0, 1)]


FILL = max(extent(rendering())) / 96
frame = functools.partial(frame_photo, **SIZE, fill=FILL)


def on_colour(colour=(90, 130, 190), size=(240, 320), corner=(20, 90), height=192, noise=0.0):
    """A rendering over a colour, and its coverage."""
    image = rendering(height)
    photo = np.empty((*size, 3))
    photo[:] = colour
    coverage = np.zeros(size, np.uint8)
    y, x = corner
    window = np.s_[y : y + image.shape[0], x : x + image.shape[1]]
    photo[window] = photo[window][: size[0], : size[1]]
    part = image[: photo[window].shape[0], : photo[window].shape[1]].astype(float)
    # Over white it is c + (1 - a) 255, over another colour c + (1 - a) colour.
    photo[window] += part[..., :3] - 255 + part[..., 3:] / 255 * (255 - photo[window])
    coverage[window] = part[..., 3]
    photo += np.random.default_rng(0).normal(0, noise, photo.shape) if noise else 0
    return photo.round().clip(0, 255).astype(np.uint8), coverage


def difference(image, expected):
    """Mean difference in levels at the best of some shifts: boxes are centred, renderings not."""
    return min(
        np.abs(np.roll(image.astype(float), (y, x), (0, 1)) - expected).mean()
        for y in range(-9, 10)
        for x in range(-9, 10)
    )


# --- framing --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "camera"),
    [
        ("chair-000000", FRAMED),
        ("table-000007", FRAMED),  # reaches the border
        ("watercraft-000007", Camera(182, -5)),  # small, since seen end on
    ],
)
def test_a_rendered_image_reaches_the_network_unchanged(tmp_path, shape, camera):
    image = rendering(192, shape, camera)
    size = {"height": 192, "width": 256, "fill": FILL}
    Image.fromarray(image).save(tmp_path / "a.png")
    framed = frame_photo(read_photo(tmp_path / "a.png"), **size)
    np.testing.assert_array_equal(framed.image, image)
    assert (framed.image.dtype, framed.warnings) == (np.uint8, ())
    assert "taken as it is" in framed.steps[-1]
    opaque = frame_photo(image[..., :3], **size)
    np.testing.assert_array_equal(opaque.image[..., :3], image[..., :3])
    assert ((opaque.image[..., 3] > 127) == (image[..., 3] > 127)).mean() > 0.99
    assert opaque.warnings == ()


def test_what_only_has_the_size_of_a_training_image_is_framed():
    moved = np.roll(rendering(), 40, axis=1)
    assert "cropped" in frame(moved).steps[-2]
    grey = np.minimum(rendering()[..., :3], 200)
    assert frame(grey).image[0, 0].tolist() == [255, 255, 255, 0]


def test_images_of_a_camera_that_cuts_objects_off_reach_the_network_unchanged():
    (camera,) = RenderSettings(**SIZE, camera=CameraModel.authors).cameras()
    image = rendering(camera=camera)
    assert extent(image)[1] == 96, "cut off above and below"
    for picture in (image, image[..., :3]):
        framed = frame_photo(picture, **SIZE, fill=1.0, whole=False)
        np.testing.assert_array_equal(framed.image[..., :3], image[..., :3])
        assert framed.warnings == ()
    assert "cropped" in frame(image).steps[-2], "not where training objects are whole"


@pytest.mark.parametrize(
    ("colour", "noise"),
    [((255, 255, 255), 0), ((231, 230, 228), 0), ((90, 130, 190), 3), ((0, 0, 0), 0)],
)
def test_an_object_on_a_plain_colour_comes_out_as_it_was_rendered(colour, noise):
    photo, coverage = on_colour(colour, noise=noise)
    framed = frame(photo)
    assert extent(framed.image) == pytest.approx(extent(rendering()), abs=2)
    assert difference(framed.image, rendering()) < 4
    assert framed.image[0, 0].tolist() == [255, 255, 255, 0]
    assert framed.warnings == ()
    assert any(f"border colour ({colour[0]}, " in step for step in framed.steps)
    told = framed.steps[-2].split()  # cropped to 82 x 158 at (170, 33)
    assert [int(told[2]), int(told[4])] == pytest.approx(
        extent(np.dstack([photo, coverage])), abs=3
    )


@pytest.mark.parametrize("way", ["mask", "alpha"])
def test_a_mask_and_alpha_give_what_the_rendering_was(way):
    photo, coverage = on_colour(noise=20)
    if way == "mask":
        framed = frame(photo, mask=Image.fromarray(coverage))
    else:
        framed = frame(np.dstack([photo, coverage]))
    assert extent(framed.image) == pytest.approx(extent(rendering()), abs=1)
    assert difference(framed.image, rendering()) < 5
    assert framed.warnings == ()


def test_soft_alpha_is_laid_over_white_once():
    size = (60, 80)
    alpha = np.zeros(size, np.uint8)
    alpha[20:40, 20:60] = 255
    alpha[20:40, 40:60] = 128
    straight = np.dstack([np.zeros((*size, 3), np.uint8), alpha])
    image = frame(straight).image.astype(int)
    row = image[48]
    assert row[40].tolist() == pytest.approx([0, 0, 0, 255], abs=2)
    assert row[80].tolist() == pytest.approx([127, 127, 127, 128], abs=2)
    premultiplied = Image.fromarray(straight).convert("RGBa")
    np.testing.assert_array_equal(frame(premultiplied).image, image)
    laid = straight.copy()
    laid[..., :3] = 255 - alpha[..., None]  # as rendered images hold it
    np.testing.assert_array_equal(frame(laid).image, image)


def test_the_background_may_change_smoothly():
    photo, coverage = on_colour((0, 0, 0))
    y, x = np.mgrid[-1:1:240j, -1:1:320j]
    back = np.stack([200 + 30 * y, 205 + 20 * y - 10 * x, 220 - 25 * x**2], -1)
    mixed = photo + (1 - coverage[..., None] / 255) * back
    framed = frame(mixed.round().astype(np.uint8))
    assert extent(framed.image) == pytest.approx(extent(rendering()), abs=2)
    assert difference(framed.image, rendering()) < 5
    assert not any("uniform" in warning for warning in framed.warnings)


def test_a_background_that_is_not_uniform_is_told():
    photo, _ = on_colour()
    photo[150:] //= 2
    assert any("not uniform" in warning for warning in frame(photo).warnings)
    noisy = np.random.default_rng(0).integers(0, 256, (60, 80, 3), np.uint8)
    noisy[20:40, 20:60] = 0
    assert any("not uniform" in warning for warning in frame(noisy).warnings)


def test_specks_do_not_decide_and_holes_are_white():
    photo = np.full((120, 160, 3), 210, np.uint8)
    photo[40:80, 50:110] = (120, 60, 20)
    photo[50:70, 70:90] = 210
    expected = frame(photo).image
    assert expected[48, 64].tolist() == [255, 255, 255, 0]
    assert expected[48, 30].tolist() == pytest.approx([120, 60, 20, 255], abs=2)
    photo[5, 5] = photo[110, 150] = 0
    framed = frame(photo)
    np.testing.assert_array_equal(framed.image, expected)
    assert "2 specks" in framed.steps[0]
    alpha = np.dstack([photo, np.zeros((120, 160), np.uint8)])
    alpha[40:80, 50:110, 3] = alpha[5, 5, 3] = 255
    assert "cropped to 60 x 40 at (50, 40)" in frame(alpha).steps


def test_what_is_beside_the_object_is_left_out_unless_a_mask_shows_it():
    photo, coverage = on_colour(size=(300, 420))
    expected = frame(photo).image
    y, x = 270, 60
    photo[y : y + 6, x : x + 300] = photo[40:100, 380:400] = (0, 0, 0)
    framed = frame(photo)
    assert np.abs(framed.image.astype(int) - expected).mean() < 1
    (told,) = [w for w in framed.warnings if "left out" in w]
    assert told.startswith("2 other things")
    coverage[40:100, 380:400] = 255
    both = frame(photo, mask=Image.fromarray(coverage))
    assert extent(both.image)[0] > 1.2 * extent(framed.image)[0]
    assert both.warnings == ()


def test_of_two_objects_one_is_taken_and_told():
    photo, _ = on_colour(size=(200, 520), corner=(4, 0))
    other, _ = on_colour(size=(200, 520), corner=(4, 250))
    both = np.where(photo == (90, 130, 190), other, photo)
    framed = frame(both)
    assert extent(framed.image) == pytest.approx(extent(rendering()), abs=2)
    (told,) = framed.warnings
    assert told.startswith("1 other thing beside the object left out")


def test_an_object_at_the_border_and_a_small_one_are_told():
    photo = np.full((120, 160, 3), 210, np.uint8)
    photo[60:, 50:110] = (120, 60, 20)
    assert any("border (bottom)" in warning for warning in frame(photo).warnings)
    photo[:] = 210
    photo[60:70, 50:60] = 0
    assert any("only 10 x 10 pixels" in warning for warning in frame(photo).warnings)


@pytest.mark.parametrize("shape", [(10, 300), (300, 10), (300, 300)])
def test_nothing_is_distorted_or_cut_off(shape):
    mask = np.zeros((400, 400), np.uint8)
    mask[20 : 20 + shape[0], 70 : 70 + shape[1]] = 255
    for size in ((96, 128), (128, 40)):
        image = frame_photo(
            np.zeros((400, 400, 3), np.uint8),
            height=size[0], width=size[1], fill=0.8, mask=Image.fromarray(mask),
        ).image  # fmt: skip
        scale = min(0.8 * size[0] / max(shape), size[1] / shape[1])
        expected = [shape[1] * scale, shape[0] * scale]
        assert extent(image) == pytest.approx(expected, abs=1.5)
        rows, columns = np.nonzero(image[..., 3] > 127)
        assert rows.min() + rows.max() == pytest.approx(size[0] - 1, abs=1)
        assert columns.min() + columns.max() == pytest.approx(size[1] - 1, abs=1)


def test_small_objects_of_large_photographs_are_looked_at_again(tmp_path):
    photo, coverage = on_colour((231, 230, 228), (600, 800), (100, 500), 192)
    expected = frame(photo).image
    large = Image.fromarray(photo).resize((3200, 2400), Image.Resampling.BICUBIC)
    large.save(tmp_path / "a.jpg", quality=90)
    picture = read_photo(tmp_path / "a.jpg")
    framed = frame(picture)
    assert np.abs(framed.image.astype(int) - expected).mean() < 5
    wide, high = (4 * n for n in extent(np.dstack([photo, coverage])))
    step = framed.steps[-2].split()
    assert [int(step[2]), int(step[4])] == pytest.approx([wide, high], rel=0.05)
    masked = frame(picture, mask=Image.fromarray(coverage).resize((3200, 2400)))
    assert np.abs(masked.image.astype(int) - expected).mean() < 5


# --- masks ----------------------------------------------------------------------------------------


def test_masks_of_any_mode_show_the_same():
    photo, coverage = on_colour()
    hard = np.where(coverage > 127, 255, 0).astype(np.uint8)
    mask = Image.fromarray(hard)
    expected = frame(photo, mask=mask).image
    cut = Image.fromarray(photo)
    cut.putalpha(mask)
    others = [mask.convert(mode) for mode in ("1", "P", "RGBA")]
    for other in [*others, Image.fromarray(hard // 255), cut]:
        np.testing.assert_array_equal(frame(photo, mask=other).image, expected)


def test_masks_that_cannot_be_used():
    photo, coverage = on_colour()
    with pytest.raises(DataError, match="has 319 x 240 pixels, the upright photograph 320 x 240"):
        frame(photo, mask=Image.fromarray(coverage[:, 1:]))
    with pytest.raises(DataError, match="empty"):
        frame(photo, mask=Image.new("L", (320, 240)))
    with pytest.raises(DataError, match="8 bits"):
        frame(photo, mask=Image.fromarray(coverage.astype(np.uint16)))
    framed = frame(photo, mask=Image.new("L", (320, 240), 255))
    assert any("covers all" in warning for warning in framed.warnings)
    assert any("all four sides: background is left in" in w for w in framed.warnings)


# --- reading --------------------------------------------------------------------------------------


@pytest.mark.parametrize("orientation", [3, 6])
def test_photographs_are_turned_upright_once(tmp_path, orientation):
    photo, coverage = on_colour()
    exif = Image.Exif()
    exif[0x0112] = orientation
    # Turned by numpy, so that a turn to the right (6) or by half (3) makes it upright.
    stored = np.rot90(photo, {6: 1, 3: 2}[orientation])
    Image.fromarray(np.ascontiguousarray(stored)).save(tmp_path / "a.png", exif=exif)
    picture = read_photo(tmp_path / "a.png")
    np.testing.assert_array_equal(np.asarray(picture), photo)
    expected = frame(photo, mask=Image.fromarray(coverage)).image
    np.testing.assert_array_equal(frame(picture, mask=Image.fromarray(coverage)).image, expected)
    with Image.open(tmp_path / "a.png") as opened:
        np.testing.assert_array_equal(frame(opened).image, frame(photo).image)


def test_broken_exif_is_ignored(tmp_path):
    photo, _ = on_colour()
    for exif in (b"Exif\0\0garbage", b"Exif\0\0II*\0\xff\xff\xff\xff"):
        Image.fromarray(photo).save(tmp_path / "a.jpg", exif=exif, quality=95)
        assert difference(frame(read_photo(tmp_path / "a.jpg")).image, rendering()) < 4


@pytest.mark.parametrize(
    ("mode", "kind", "off"),
    [("L", "png", 1), ("P", "gif", 60), ("CMYK", "jpeg", 8), ("LA", "png", 1), ("RGB", "webp", 20)],
)
def test_pictures_of_any_mode_and_kind(tmp_path, mode, kind, off):
    photo, _ = on_colour()
    grey = mode in ("L", "LA")
    source = Image.fromarray(photo).convert("L" if grey else "RGB").convert(mode)
    source.save(tmp_path / "a.png", format=kind)  # what it is, not what it is called, counts
    picture = read_photo(tmp_path / "a.png")
    assert picture.mode in ("RGB", "RGBA")
    expected = np.asarray(Image.fromarray(photo).convert("L").convert("RGB")) if grey else photo
    assert np.abs(np.asarray(picture)[..., :3].astype(int) - expected).mean() <= off
    assert frame(picture).image.shape == (96, 128, 4)


def test_a_palette_with_a_clear_colour_has_alpha(tmp_path):
    photo, coverage = on_colour()
    palette = Image.fromarray(photo).quantize(200)
    colours = palette.getpalette()
    clear = len(colours) // 3
    other = Image.fromarray(np.where(coverage < 128, clear, np.asarray(palette)).astype(np.uint8))
    other.putpalette([*colours, 9, 9, 9])
    other.save(tmp_path / "a.png", transparency=clear)
    framed = frame(read_photo(tmp_path / "a.png"))
    assert "alpha" in framed.steps[0]
    assert extent(framed.image) == pytest.approx(extent(rendering()), abs=1)


def bomb():
    """A PNG of a few bytes that says it has 81 million pixels."""
    parts = b""
    for kind, data in (
        (b"IHDR", struct.pack(">2I5B", 9000, 9000, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(b"")),
        (b"IEND", b""),
    ):
        crc = struct.pack(">I", zlib.crc32(kind + data))
        parts += struct.pack(">I", len(data)) + kind + data + crc
    return b"\x89PNG\r\n\x1a\n" + parts


def encoded(picture):
    file = io.BytesIO()
    picture.save(file, "PNG")
    return file.getvalue()


BAD = {
    "empty": (b"", "is empty"),
    "text": (b"It was a dark and stormy night.", "is no picture"),
    "a bomb": (bomb(), "too large .9,000 x 9,000 pixels, more than 60,000,000"),
    "HEIC": (b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "HEIC .* save it as JPEG"),
    "half a PNG": (encoded(Image.fromarray(on_colour()[0]))[:-3000], "cannot be read .*truncated"),
    "16 bits": (encoded(Image.fromarray(np.full((9, 9), 999, np.uint16))), "more than 8 bits"),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_by_name(tmp_path, name):
    content, reason = BAD[name]
    (tmp_path / "photo.png").write_bytes(content)
    with pytest.raises(DataError, match=reason) as caught:
        read_photo(tmp_path / "photo.png")
    assert str(caught.value).startswith(str(tmp_path / "photo.png"))
    with pytest.raises(DataError, match=f"^upload {reason}|^upload .*{reason}"):
        read_photo(content, "upload")


def test_what_is_no_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.png")
    for name, reason in (("", "is not a file"), ("pipe.png", "is not a file"), ("no", "No such")):
        with pytest.raises(DataError, match=reason):
            read_photo(tmp_path / name)


@pytest.mark.parametrize("shape", [(1, 1), (1, 50), (60, 80)])
@pytest.mark.parametrize("channels", [3, 4])
def test_pictures_that_show_nothing(shape, channels):
    blank = np.full((*shape, channels), 0 if channels == 4 else 77, np.uint8)
    with pytest.raises(DataError, match=r"no object found .*give mask="):
        frame(blank)
    if channels == 4:
        with pytest.raises(DataError, match="no object found"):
            frame(rendering() * np.uint8([1, 1, 1, 0]))
    mask = Image.new("L", shape[::-1], 255)
    assert max(extent(frame(blank[..., :3], mask=mask).image)) / 96 == pytest.approx(FILL, abs=0.2)


@pytest.mark.parametrize(
    "values",
    [np.zeros((9, 9, 3)), *(np.zeros(size, np.uint8) for size in [(9, 9), (9, 9, 2), (0, 9, 3)])],
)
def test_arrays_that_are_no_pictures(values):
    with pytest.raises(DataError, match="photograph"):
        frame(values)


# --- rembg ----------------------------------------------------------------------------------------


@pytest.fixture
def rembg(monkeypatch):
    """A module that stands in for rembg; its network finds what is not blue."""
    fake = types.ModuleType("rembg")
    fake.asked = []

    def new_session(name):
        fake.asked.append(name)
        return f"session of {name}"

    def remove(picture, session, only_mask):
        assert (picture.mode, session, only_mask) == ("RGB", f"session of {fake.asked[0]}", True)
        return Image.fromarray(np.where(np.asarray(picture)[..., 2] < 180, 255, 0).astype(np.uint8))

    fake.new_session, fake.remove = new_session, remove
    monkeypatch.setitem(sys.modules, "rembg", fake)
    framing._rembg.cache_clear()
    yield fake
    framing._rembg.cache_clear()


def test_rembg_finds_the_object(rembg):
    photo, _ = on_colour()
    for _ in range(2):
        framed = frame(photo, background="rembg")
    assert difference(framed.image, rendering()) < 5
    assert framed.warnings == ()
    assert "rembg" in framed.steps[0]
    assert len(rembg.asked) == 1  # the network is loaded once
    with pytest.raises(DataError, match="no object found"):
        frame(np.full_like(photo, 255), background="rembg")
    framed = frame(photo, background="rembg", mask=Image.new("L", (320, 240), 255))
    assert framed.steps[0] == "background: mask"


def test_rembg_that_is_missing_or_has_no_weights(rembg, monkeypatch):
    photo, _ = on_colour()

    def fail(*_, **__):
        raise OSError("Max retries\nexceeded")

    monkeypatch.setattr(rembg, "new_session", fail)
    with pytest.raises(ConfigError, match=r"weights of .* .OSError: Max retries exceeded"):
        frame(photo, background="rembg")
    monkeypatch.setitem(sys.modules, "rembg", None)
    with pytest.raises(ConfigError, match=r"pip install 'rembg\[cpu\]'"):
        frame(photo, background="rembg")
