"""Colours are told apart by people who see two kinds of colour instead of three."""

from itertools import combinations

import numpy as np
import pytest

from ffd_lightning.palette import COLORS, REGIME_COLORS, regime_title

# Linear RGB as protanopes and deuteranopes see it (Vienot, Brettel and Mollon 1999).
SEEN = {
    "all colours": np.eye(3),
    "protanopia": [[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]],
    "deuteranopia": [[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]],
}


def linear(color):
    value = np.array([int(color[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("vision", SEEN)
def test_colours_are_told_apart(vision):
    seen = [np.clip(np.array(SEEN[vision]) @ linear(c), 0, 1) ** (1 / 2.2) for c in COLORS]
    closest = min(np.linalg.norm(a - b) for a, b in combinations(seen, 2))
    assert closest > 0.12


def test_red_beside_green_would_not_pass():
    red, green = (np.array(SEEN["deuteranopia"]) @ linear(c) for c in ("#C8501E", "#8A8A1E"))
    assert np.linalg.norm(red ** (1 / 2.2) - green ** (1 / 2.2)) < 0.12


def test_regimes_have_names_for_people():
    assert [regime_title(name) for name in REGIME_COLORS] == [
        "b, base",
        "w, log-weighted",
        "e, entropy",
        "r, regularized",
        "posterior",
    ]
    assert regime_title("mine") == "mine"
