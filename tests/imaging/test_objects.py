"""Drawn scenes: what is drawn is known, so is what belongs together."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

from ffd_lightning.imaging.objects import main_object

SIZE = (240, 320)
BODY = (110, 60, 210, 180)


def drawn(*shapes):
    """Where shapes cover a picture: (method of ImageDraw, coordinates, its options)."""
    picture = Image.new("1", SIZE[::-1])
    draw = ImageDraw.Draw(picture)
    for method, place, *options in shapes:
        getattr(draw, method)(place, fill=1, **dict(options))
    return np.asarray(picture)


body = ("rectangle", BODY)


def test_an_object_alone_is_all_that_is_kept():
    covered = drawn(body)
    found = main_object(covered)
    np.testing.assert_array_equal(found.kept, covered)
    assert (found.left_out, found.pieces) == ((), 1)
    assert main_object(np.zeros(SIZE, bool)).left_out == ()


@pytest.mark.parametrize(
    ("other", "told"),
    [
        ([("line", (60, 60, 60, 180), ("width", 2))], "lines or arrows (left)"),
        ([("line", (230, 20, 300, 60), ("width", 2))], "lines or arrows (right)"),
        ([("rectangle", (x, 205, x + 8, 220)) for x in range(120, 200, 12)], "small parts (below)"),
        ([("rectangle", (240, 10, 300, 60))], "another object (right)"),
        ([("rectangle", (10, 5, 70, 45))], "another object (left)"),
    ],
)
def test_what_lies_apart_is_left_out_and_told(other, told):
    found = main_object(drawn(body, *other))
    np.testing.assert_array_equal(found.kept, drawn(body))
    assert found.left_out == (told,)
    assert found.pieces == 1


def test_what_is_of_a_kind_is_told_once():
    lines = [("line", (x, 60, x, 180), ("width", 2)) for x in (40, 70, 260)]
    assert main_object(drawn(body, *lines)).left_out == ("lines or arrows (left, right)",)


@pytest.mark.parametrize(
    ("pieces", "expected"),
    [
        # a ring and what stands in it; an L and what stands in its hull; what is very close
        ([("ellipse", (60, 20, 260, 220)), ("ellipse", (140, 100, 180, 140))], 1),
        (
            [
                ("line", (60, 20, 60, 200, 260, 200), ("width", 16)),
                ("ellipse", (80, 120, 120, 160)),
            ],
            1,
        ),
        ([body, ("rectangle", (212, 100, 216, 140))], 1),
        # the shade and the foot of a lamp whose rod was not seen
        ([("rectangle", (120, 20, 200, 90)), ("rectangle", (135, 140, 185, 160))], 2),
        # the legs of a table with a white top
        ([("rectangle", (x, 60, x + 12, 200)) for x in (40, 120, 200, 280)], 4),
    ],
)
def test_pieces_of_one_object_stay_together(pieces, expected):
    covered = drawn(*pieces)
    if pieces[0][0] == "ellipse":
        covered = covered & ~drawn(("ellipse", (80, 40, 240, 200))) | drawn(pieces[1])
    found = main_object(covered)
    np.testing.assert_array_equal(found.kept, covered)
    assert found.left_out == ()
    assert found.pieces == expected


def test_of_two_alike_the_more_central_one_is_taken_and_the_larger():
    left, right = ("rectangle", (10, 80, 90, 160)), ("rectangle", (150, 80, 230, 160))
    found = main_object(drawn(left, right))
    np.testing.assert_array_equal(found.kept, drawn(right))
    assert found.left_out == ("another object of similar size (left)",)
    small, large = ("rectangle", (20, 90, 90, 150)), ("rectangle", (200, 70, 310, 170))
    np.testing.assert_array_equal(main_object(drawn(small, large)).kept, drawn(large))


def test_a_frame_around_the_picture_is_not_the_object():
    frame = drawn(("rectangle", (0, 0, 319, 239))) & ~drawn(("rectangle", (12, 12, 307, 227)))
    small = drawn(("rectangle", (140, 100, 180, 140)))
    assert frame.sum() > small.sum()
    np.testing.assert_array_equal(main_object(frame | small).kept, small)
