"""Drawn scenes: what is drawn is known, so is what belongs together."""

import numpy as np
import pytest
from PIL import Image, ImageDraw

from ffd_lightning.imaging.objects import main_object

SIZE = (240, 320)
BODY = ("rectangle", (110, 60, 210, 180))


def drawn(*shapes):
    """Where shapes cover a picture: (method of ImageDraw, coordinates, its options)."""
    picture = Image.new("1", SIZE[::-1])
    draw = ImageDraw.Draw(picture)
    for method, place, *options in shapes:
        getattr(draw, method)(place, fill=1, **dict(options))
    return np.asarray(picture)


@pytest.mark.parametrize(
    ("others", "left_out"),
    [
        ([], 0),
        ([("line", (60, 60, 60, 180), ("width", 2)), ("rectangle", (240, 10, 300, 60))], 2),
        ([("rectangle", (x, 205, x + 8, 220)) for x in range(120, 200, 12)], 7),
    ],
)
def test_what_lies_apart_is_left_out_and_counted(others, left_out):
    kept, count = main_object(drawn(BODY, *others))
    np.testing.assert_array_equal(kept, drawn(BODY))
    assert count == left_out


@pytest.mark.parametrize(
    "pieces",
    [
        # an L and what stands in its box; what is very close; a lamp whose rod was not seen; the
        # legs of a table with a white top
        [("line", (60, 20, 60, 200, 260, 200), ("width", 16)), ("ellipse", (80, 120, 120, 160))],
        [BODY, ("rectangle", (212, 100, 216, 140))],
        [("rectangle", (120, 20, 200, 90)), ("rectangle", (135, 140, 185, 160))],
        [("rectangle", (x, 60, x + 12, 200)) for x in (40, 120, 200, 280)],
    ],
)
def test_pieces_of_one_object_stay_together(pieces):
    covered = drawn(*pieces)
    kept, left_out = main_object(covered)
    np.testing.assert_array_equal(kept, covered)
    assert left_out == 0


def test_the_more_central_one_the_larger_one_and_no_frame_is_taken():
    left, right = ("rectangle", (10, 80, 90, 160)), ("rectangle", (150, 80, 230, 160))
    np.testing.assert_array_equal(main_object(drawn(left, right))[0], drawn(right))
    small, large = ("rectangle", (20, 90, 90, 150)), ("rectangle", (200, 70, 310, 170))
    np.testing.assert_array_equal(main_object(drawn(small, large))[0], drawn(large))
    frame = drawn(("rectangle", (0, 0, 319, 239))) & ~drawn(("rectangle", (12, 12, 307, 227)))
    middle = drawn(("rectangle", (140, 100, 180, 140)))
    np.testing.assert_array_equal(main_object(frame | middle)[0], middle)
