from itertools import combinations

import numpy as np
import pytest
from scipy.stats import entropy

from ffd_lightning.metrics.selection import adjusted_rand, effective_templates, selection_entropy


@pytest.mark.parametrize("counts", [[1, 2, 3], [7], [0, 4, 0, 4], [0.5, 0.25, 0.25]])
def test_matches_scipy(counts):
    assert selection_entropy(counts) == pytest.approx(entropy(counts))
    assert effective_templates(counts) == pytest.approx(np.exp(entropy(counts)))


def test_adjusted_rand_from_pairs():
    rng = np.random.default_rng(0)
    a, b = rng.integers(4, size=40), rng.integers(6, size=40)
    b[:15] = a[:15]
    pairs = np.array([*combinations(range(40), 2)]).T
    in_a, in_b = (labels[pairs[0]] == labels[pairs[1]] for labels in (a, b))
    expected = in_a.sum() * in_b.mean()
    oracle = ((in_a & in_b).sum() - expected) / ((in_a.sum() + in_b.sum()) / 2 - expected)
    assert adjusted_rand(a, b) == pytest.approx(oracle, abs=1e-12)
    assert adjusted_rand(b, a) == adjusted_rand(a, b)
    assert adjusted_rand(a, 9 - b) == adjusted_rand(a, b), "names do not count"
