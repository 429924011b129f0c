"""Words and pictures on a sheet."""

import numpy as np
import pytest

from ffd_lightning.imaging.sheet import (
    Line,
    Sheet,
    contact_sheet,
    lay_out,
    side_by_side,
    stacked,
    text_width,
)


def ink(line, height=40, width=200):
    """Return the rows and columns of a sheet that a line of text darkens."""
    drawn = Sheet(height, width, lines=(line,)).draw()[..., 0] < 128
    return np.flatnonzero(drawn.any(1)), np.flatnonzero(drawn.any(0))


@pytest.mark.parametrize(("align", "place"), [("left", 0), ("center", 0.5), ("right", 1)])
def test_a_line_is_where_it_is_put(align, place):
    rows, columns = ink(Line("HHH", 100, 20, 16, align))
    assert (1 - place) * columns[0] + place * columns[-1] == pytest.approx(100, abs=3.5)
    assert (rows[0] + rows[-1]) / 2 == pytest.approx(20, abs=3)
    assert columns[-1] - columns[0] == pytest.approx(text_width("HHH", 16), abs=6)


def test_text_that_reaches_over_the_border_is_cut():
    for x, y in ((-5, 10), (90, 10), (10, 0), (10, 20), (-500, 10)):
        assert Sheet(20, 100, lines=(Line("word", x, y, 12),)).draw().shape == (20, 100, 3)


def test_labels_that_are_too_wide_are_set_smaller_and_then_shortened():
    image = np.zeros((20, 100, 3), np.uint8)
    sheets = [lay_out([image], 1, [text], font_size=10) for text in ("a" * 9, "a" * 19, "a" * 50)]
    short, long, longest = (sheet.lines[0] for sheet in sheets)
    assert (short.text, short.size) == ("a" * 9, 10)
    assert long.text == "a" * 19
    assert 7.5 <= long.size < 10
    head, tail = longest.text.split("…")
    assert abs(len(head) - len(tail)) <= 1
    for line in (short, long, longest):
        assert text_width(line.text, line.size) <= 101
    assert text_width(longest.text, longest.size) > 85


def test_sheets_on_sheets_are_drawn_as_pictures_are():
    rng = np.random.default_rng(0)
    images = list(rng.integers(0, 255, (3, 20, 30, 3), dtype=np.uint8))
    inner = [lay_out(images[:2], 2, ["a", "b"]), lay_out(images[2:], 1, ["c"])]
    drawn = [sheet.draw() for sheet in inner]
    outer = lay_out(inner, 1, headings=["title"])
    np.testing.assert_array_equal(outer.draw(), lay_out(drawn, 1, headings=["title"]).draw())
    beside, below = side_by_side(inner), stacked(inner)
    np.testing.assert_array_equal(beside.draw()[:, : inner[0].width], drawn[0])
    np.testing.assert_array_equal(beside.draw()[:, inner[0].width :], drawn[1])
    assert (below.height, below.width) == (inner[0].height + inner[1].height, inner[0].width)
    np.testing.assert_array_equal(below.draw()[inner[0].height :, : inner[1].width], drawn[1])


def test_contact_sheet_places_images_and_labels():
    images = [np.full((20, 30, 4), value, np.uint8) for value in (10, 60, 110)]
    plain = contact_sheet(images, columns=2)
    assert plain.shape == (2 * 24 + 4, 2 * 34 + 4, 3)
    np.testing.assert_array_equal(plain[4:24, 4:34], 10)
    np.testing.assert_array_equal(plain[4:24, 38:68], 60)
    np.testing.assert_array_equal(plain[28:48, 4:34], 110)
    np.testing.assert_array_equal(plain[28:, 38:], 255)
    labelled = contact_sheet(images, 2, ["O", "", "chär " * 20], background=0)
    assert labelled[24:38, 4:34].max() > 200
    assert labelled[24:38, 38:68].max() == 0
    np.testing.assert_array_equal(labelled[42:62, 4:34], 110)


def test_contact_sheet_has_a_row_of_headings_and_labels_of_several_lines():
    images = [np.full((20, 60, 3), value, np.uint8) for value in (10, 60, 110)]
    sheet = contact_sheet(images, 2, ["a\nb", "", "c"], headings=["l", "mm"], font_size=20)
    top, strip = round(1.4 * 24), 56
    assert sheet.shape == (top + 2 * (20 + strip + 4) + 4, 2 * 64 + 4, 3)
    for k, value in enumerate((10, 60, 110)):
        y, x = 4 + top + k // 2 * (20 + strip + 4), 4 + k % 2 * 64
        np.testing.assert_array_equal(sheet[y : y + 20, x : x + 60], value)
    for column in (0, 1):  # centred
        ink = np.flatnonzero(
            (sheet[4 : 4 + top, 4 + 64 * column : 64 + 64 * column] < 128).any((0, 2))
        )
        assert abs((ink[0] + ink[-1]) / 2 - 30) < 3
    below = sheet[4 + top + 20 :, 4:64]
    lines = [(below[y : y + 28] < 128).any() for y in (0, 28)]
    assert lines == [True, True]
    assert not (sheet[4 + top + 20 : 4 + top + 76, 68:128] < 128).any()
    wide = contact_sheet(images[:1], 3, headings=["", "", "x"])
    assert wide.shape[1] == 3 * 64 + 4


def test_contact_sheet_refuses_what_does_not_fit():
    image = np.zeros((2, 2, 3), np.uint8)
    with pytest.raises(ValueError, match="1 labels for 2 images"):
        contact_sheet([image, image], 2, ["a"])
    with pytest.raises(ValueError, match="3 labels for 2 columns"):
        contact_sheet([image], 2, headings=["a", "b", "c"])
    with pytest.raises(ValueError, match="images and columns"):
        contact_sheet([], 2)
