import math

import numpy as np
import pytest

from ffd_lightning.losses.annealing import (
    ANNEALINGS,
    exponential_annealing,
    linear_annealing,
    make_annealing,
)


def test_annealing_falls_by_e_every_annealing_steps():
    assert exponential_annealing(0, 10) == 1
    assert exponential_annealing(30, 10) == pytest.approx(math.exp(-3))
    assert exponential_annealing(10**9, math.inf) == 1


def test_linear_annealing_is_a_line_to_zero_and_stays_there():
    steps = np.arange(0, 41)
    found = [linear_annealing(int(step), 25) for step in steps]
    np.testing.assert_allclose(found, np.interp(steps, [0, 25], [1, 0]), atol=1e-15)
    assert linear_annealing(10**9, math.inf) == 1


def test_annealings_by_name():
    made = {name: make_annealing(name, 10) for name in ANNEALINGS}
    assert {name: f(5) for name, f in made.items()} == {
        "constant": 1,
        "exponential": math.exp(-0.5),
        "linear": 0.5,
    }
    with pytest.raises(ValueError, match="annealing=cosine must be one of constant, exponential"):
        make_annealing("cosine", 10)
