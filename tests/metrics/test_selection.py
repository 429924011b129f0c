import numpy as np
import pytest
from scipy.stats import entropy

from ffd_lightning.metrics.selection import effective_templates, selection_entropy


@pytest.mark.parametrize("counts", [[1, 2, 3], [7], [0, 4, 0, 4], [0.5, 0.25, 0.25]])
def test_matches_scipy(counts):
    assert selection_entropy(counts) == pytest.approx(entropy(counts))
    assert effective_templates(counts) == pytest.approx(np.exp(entropy(counts)))


@pytest.mark.parametrize("counts", [[0, 0], [], [-1, 2]])
def test_refuses_what_is_no_distribution(counts):
    with pytest.raises(ValueError, match="counts"):
        selection_entropy(counts)
