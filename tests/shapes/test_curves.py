import numpy as np
from scipy.interpolate import PchipInterpolator

from ffd_lightning.shapes.kit.curves import monotone


def test_monotone_is_scipys_to_the_last_bit():
    """The shapes were first drawn with scipy's; not a number of theirs may change."""
    rng = np.random.default_rng(0)
    for _ in range(500):
        count = int(rng.integers(3, 8))
        x = np.cumsum(rng.uniform(0.01, 1, count))
        y = np.round(rng.uniform(0, 1, count), 1)  # some are equal
        at = np.concatenate([np.linspace(x[0], x[-1], 18), x])
        assert np.array_equal(monotone(x, y, at), PchipInterpolator(x, y)(at))
