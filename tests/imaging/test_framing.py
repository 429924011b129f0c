"""Photographs made from renderings: plain, noisy, turned, masked, of all modes, damaged."""

import functools
import sys
from types import SimpleNamespace

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
    for picture in (np.roll(rendering(), 40, axis=1), np.minimum(rendering()[..., :3], 200)):
        assert "cropped" in frame(picture).steps[-2]
    large = frame_photo(rendering(768)[..., :3], height=768, width=1024, fill=FILL)
    assert large.image.shape == (768, 1024, 4)


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
    cropped = framed.steps[-2].split()  # cropped to 82 x 158 at (170, 33)
    own = extent(np.dstack([photo, coverage]))
    assert [int(cropped[2]), int(cropped[4])] == pytest.approx(own, abs=3)


def test_a_nearly_white_object_on_white_is_whole():
    photo, coverage = on_colour((255, 255, 255))
    photo = (242 + photo / 255 * 8 + 5 * (coverage == 0)[..., None]).astype(np.uint8)
    framed = frame(photo)
    assert extent(framed.image) == pytest.approx(extent(rendering()), abs=2)
    assert (framed.image[..., 3] > 127).sum() > 0.9 * (rendering()[..., 3] > 127).sum()


def test_a_mask_and_alpha_give_what_the_rendering_was():
    photo, coverage = on_colour(noise=20)
    for framed in (frame(photo, mask=coverage), frame(np.dstack([photo, coverage]))):
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
    laid = straight.copy()
    laid[..., :3] = 255 - alpha[..., None]  # as rendered images hold it
    np.testing.assert_array_equal(frame(laid).image, image)


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
    alpha[..., 3] = 255
    alpha[0, 0, 3] = 0  # nothing is cut out by a corner
    assert frame(alpha).steps[0].startswith("background: border colour")


def test_a_long_object_of_many_pixels_is_framed_as_it_is_with_fewer():
    """Cut at full size, its surroundings would have 300 million pixels, more than Pillow allows."""
    long = np.zeros((12_000, 400, 4), np.uint8)
    long[600:-600, 100:300] = (120, 60, 20, 255)
    large, small = (frame(Image.fromarray(long).reduce(k)) for k in (1, 20))
    assert difference(large.image, small.image) < 0.5
    cropped = large.steps[-2].split()  # in pixels of the photograph, about
    assert [int(cropped[2]), int(cropped[4])] == pytest.approx([200, 10_800], abs=22)


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
    photo, coverage = on_colour((231, 230, 228), (600, 800), (100, 500), height=96)
    large = Image.fromarray(photo).resize((3200, 2400), Image.Resampling.BICUBIC)
    large.save(tmp_path / "a.jpg", quality=90)
    picture = read_photo(tmp_path / "a.jpg")
    framed = frame(picture)
    assert np.abs(framed.image.astype(int) - frame(photo).image).mean() < 5
    cropped = framed.steps[-2].split()
    own = [4 * size for size in extent(np.dstack([photo, coverage]))]
    assert [int(cropped[2]), int(cropped[4])] == pytest.approx(own, abs=4)
    masked = frame(picture, mask=Image.fromarray(coverage).resize((3200, 2400)))
    assert np.abs(framed.image.astype(int) - masked.image).mean() < 1.1, "once: 1.45"


def test_masks_that_cannot_be_used():
    photo, coverage = on_colour()
    with pytest.raises(DataError, match="has 319 x 240 pixels, the upright photograph 320 x 240"):
        frame(photo, mask=Image.fromarray(coverage[:, 1:]))
    with pytest.raises(DataError, match="empty"):
        frame(photo, mask=Image.new("L", (320, 240)))
    with pytest.raises(DataError, match=r"mask .*uint8, this is .* uint16"):
        frame(photo, mask=coverage.astype(np.uint16))
    (told,) = frame(photo, mask=Image.new("L", (320, 240), 255)).warnings
    assert "all four sides" in told


def test_rembg_finds_the_object(monkeypatch):
    """By a module that stands in for it, whose network finds what is not blue."""
    made = []

    def remove(picture, session, only_mask):
        assert (session, only_mask) == ("a session", True)
        return Image.fromarray(np.where(np.asarray(picture)[..., 2] < 180, 255, 0).astype(np.uint8))

    fake = SimpleNamespace(remove=remove, new_session=lambda name: made.append(name) or "a session")
    monkeypatch.setitem(sys.modules, "rembg", fake)
    framing._rembg_session.cache_clear()
    photo, _ = on_colour()
    for _ in range(2):
        framed = frame(photo, background="rembg")
    assert difference(framed.image, rendering()) < 5
    assert len(made) == 1  # the network is loaded once
    framing._rembg_session.cache_clear()
    monkeypatch.setitem(sys.modules, "rembg", None)
    with pytest.raises(ConfigError, match=r"pip install 'rembg\[cpu\]'"):
        frame(photo, background="rembg")


def test_grabcut_finds_the_object_within_a_box():
    """Before a background of many colours, where the border's colour says nothing."""
    photo, coverage = on_colour(noise=4)
    stripes = np.where(np.arange(photo.shape[1]) // 20 % 2, 40, -40)[None, :, None]
    photo = np.where(coverage[..., None] < 128, photo + stripes, photo).clip(0, 255)
    photo = photo.astype(np.uint8)
    rows, columns = (np.flatnonzero((coverage > 127).any(axis)) for axis in (1, 0))
    box = columns[0] - 5, rows[0] - 5, columns[-1] + 6, rows[-1] + 6
    framed = frame(photo, box=tuple(map(int, box)))
    found, true = (
        image[..., 3] > 127 for image in (framed.image, frame(photo, mask=coverage).image)
    )
    assert (found & true).sum() / (found | true).sum() > 0.8
    assert "GrabCut" in framed.steps[0]
    boxes = (((0, 0, 320, 240), "leave out"), ((5, 5, 400, 90), "within"), ((5, 5, 90), "within"))
    for wrong, words in boxes:
        with pytest.raises(DataError, match=words):
            frame(photo, box=wrong)
    with pytest.raises(DataError, match="nothing within the box"):
        frame(np.full((480, 640, 3), 255, np.uint8), box=(10, 10, 300, 300))
