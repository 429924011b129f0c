import numpy as np
import pytest

from ffd_lightning.errors import explain_unforeseen, is_bug
from ffd_lightning.geometry.sampling import sample_surface


def caught(call):
    with pytest.raises(Exception) as found:  # noqa: PT011
        call()
    return found.value


def test_a_mistake_in_our_own_code_is_a_bug():
    error = caught(lambda: sample_surface(np.eye(3), [[0, 1, 2]], 1, None))
    assert isinstance(error, AttributeError)
    assert is_bug(error)
    said = explain_unforeseen(error)
    assert said.startswith("AttributeError: ")
    assert "(sampling.sample_surface, line " in said
    assert said.endswith("a bug of ffd_lightning: please report it)")


@pytest.mark.parametrize(
    "call",
    [
        lambda: None + 1,  # not in our code
        lambda: sample_surface(np.zeros((3, 3)), [[0, 1, 2]], 1, np.random.default_rng(0)),
    ],
)
def test_others_mistakes_and_bad_data_are_none(call):
    error = caught(call)
    assert not is_bug(error)
    said = explain_unforeseen(error)
    assert type(error).__name__ in said
    assert said.endswith(("(test_errors.<lambda>)", "(sampling._surface)"))


def test_the_systems_errors_and_those_never_raised_have_no_place():
    assert explain_unforeseen(FileNotFoundError("box.png")) == "FileNotFoundError: box.png"
    assert explain_unforeseen(KeyError("a")) == "KeyError: 'a'"
    assert not is_bug(TypeError())
