import re

import numpy as np
import pytest

from ffd_lightning.errors import explain_unforeseen, is_bug
from ffd_lightning.geometry.sampling import sample_surface


@pytest.mark.parametrize(
    ("call", "bug"),
    [
        (lambda: sample_surface(np.eye(3), [[0, 1, 2]], 1, None), True),  # in our code
        (lambda: None + 1, False),  # not in our code
        (lambda: sample_surface(np.zeros((3, 3)), [[0, 1, 2]], 1, np.random.default_rng(0)), False),
    ],
)
def test_a_mistake_in_our_own_code_is_told_from_bad_data(call, bug):
    with pytest.raises(Exception) as caught:  # noqa: PT011
        call()
    assert is_bug(caught.value) == bug
    explained = explain_unforeseen(caught.value)
    assert explained.startswith(f"{type(caught.value).__name__}: ")
    assert re.search(r"\((sampling|test_errors)\.py:\d+", explained)
    assert explained.endswith("please report it)") == bug
