import math

import pytest

from ffd_lightning.losses.annealing import ANNEALINGS, exponential_annealing, make_annealing


def test_annealing_falls_by_e_every_annealing_steps():
    assert exponential_annealing(0, 10) == 1
    assert exponential_annealing(30, 10) == pytest.approx(math.exp(-3))
    assert exponential_annealing(10**9, math.inf) == 1


def test_annealings_by_name():
    made = {name: make_annealing(name, 10) for name in ANNEALINGS}
    assert {name: f(30) for name, f in made.items()} == {
        "constant": 1,
        "exponential": math.exp(-3),
    }
    with pytest.raises(ValueError, match="annealing=linear must be one of constant, exponential"):
        make_annealing("linear", 10)
