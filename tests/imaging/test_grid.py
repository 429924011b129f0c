"""Pictures and words in a grid."""

import io

import numpy as np
from PIL import Image

from ffd_lightning.imaging.grid import grid, png


def test_pictures_labels_and_headings_are_at_their_places():
    images = [np.full((20, 60, 4), value, np.uint8) for value in (10, 60, 110)]
    plain = np.asarray(grid(images, 2))
    assert plain.shape == (2 * 24 + 4, 2 * 64 + 4, 3)
    np.testing.assert_array_equal(plain[28:, 68:], 255)
    sheet = np.asarray(grid(images, 2, ["a\nb", "", "c"], headings=["l", "mm"], font_size=20))
    top, strip = round(1.4 * 24), 56
    assert sheet.shape == (top + 2 * (20 + strip + 4) + 4, 2 * 64 + 4, 3)
    for k, value in enumerate((10, 60, 110)):
        y, x = 4 + top + k // 2 * (20 + strip + 4), 4 + k % 2 * 64
        np.testing.assert_array_equal(sheet[y : y + 20, x : x + 60], value)
    for x in (4, 68):  # centred
        dark = np.flatnonzero((sheet[4 : 4 + top, x : x + 60] < 128).any(axis=(0, 2)))
        assert abs((dark[0] + dark[-1]) / 2 - 30) < 3
    below = sheet[4 + top + 20 :, 4:64]
    assert [(below[y : y + 28] < 128).any() for y in (0, 28)] == [True, True]
    assert not (sheet[4 + top + 20 : 4 + top + 76, 68:128] < 128).any()


def test_a_png_is_its_pixels_and_with_few_colours_smaller():
    picture = np.random.default_rng(0).integers(0, 255, (40, 60, 4), dtype=np.uint8)
    whole, few = png(picture), png(picture, 16)
    np.testing.assert_array_equal(np.asarray(Image.open(io.BytesIO(whole))), picture)
    assert len(few) < len(whole) / 4
    assert Image.open(io.BytesIO(few)).convert("RGBA").size == (60, 40)
