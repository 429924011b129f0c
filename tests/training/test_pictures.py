import numpy as np
import torch
from PIL import ImageColor

from ffd_lightning.palette import COLORS
from ffd_lightning.training.pictures import distance_colors, selection_bars

BAR = ImageColor.getrgb(COLORS[-1])
PICTURES = np.full((10, 54, 72, 3), 255, np.uint8)
PICTURES[range(10), 20:30] = np.arange(10)[:, None, None, None] * 25  # grey, telling them apart


def columns_of(image, color):
    """Return how many pixels of a colour each column has."""
    return (image == np.array(color)).all(2).sum(0)


def test_a_template_has_its_picture_below_its_bar_eight_in_a_row():
    counts = np.array([0, 9, 0, 4, 5, 0, 7, 1, 2, 8])
    image = selection_bars(counts, np.full(10, 0.1), PICTURES)
    row = (len(image) - 40) // 2
    order = [1, 9, 6, 4, 3, 8, 7, 0, 2, 5]
    for place, t in enumerate(order):
        y, x = 40 + place // 8 * row, place % 8 * 72
        cell = image[y : y + row, x : x + 72]
        assert columns_of(cell, PICTURES[t, 25, 0])[3] >= 10, (place, t)
        assert (columns_of(cell, BAR).max() > 0) == (counts[t] > 0)


def test_colors_tell_the_distance_to_the_other_cloud():
    a = torch.tensor([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    b = torch.tensor([[0.0, 0, 0], [1, 0.025, 0], [2, 0.3, 0], [2, 0.6, 0]])
    first, second = distance_colors(a, b)
    assert first.shape == (3, 3)
    assert (first[0] == second[0]).all()  # together
    assert (first[1] == second[1]).all()  # halfway
    assert (first[2] == second[3]).all()  # far and farther
    assert first[0].argmax() == 2, "blue"
    assert first[2].argmax() == 0, "orange"
    brightness = first.astype(float) @ [0.299, 0.587, 0.114]
    assert brightness[0] + 40 < brightness[1] < brightness[2] - 40, "also without colours"
