import pytest
from hypothesis import given
from hypothesis import strategies as st

from ffd_lightning.data.splits import hash_parts, make_split
from ffd_lightning.errors import DataError


def split_ids(ids, fraction, exclude=()):
    ids = list(ids)
    return make_split(ids, hash_parts(ids, fraction), exclude, "data.train_fraction")


IDS = [f"table-{i:06d}" for i in range(5000)]


def test_parts_are_disjoint_sorted_and_complete():
    split = split_ids(reversed(IDS), 0.8, exclude=IDS[:30])
    assert sorted(split.train + split.test) == IDS[30:]
    assert list(split.train) == sorted(split.train)
    assert list(split.test) == sorted(split.test)


def test_share_is_met():
    """Within four standard deviations of a binomial draw."""
    share = len(split_ids(IDS, 0.8).train) / len(IDS)
    assert abs(share - 0.8) < 4 * (0.8 * 0.2 / len(IDS)) ** 0.5


@given(st.sets(st.sampled_from(IDS[:60])), st.sets(st.sampled_from(IDS[:60])))
def test_models_never_move(added, exclude):
    subset = set(IDS[60:100]) | added
    whole, part = split_ids(IDS, 0.5), split_ids(subset, 0.5, exclude)
    assert set(part.train) == (set(whole.train) & subset) - exclude
    assert set(part.test) == (set(whole.test) & subset) - exclude


def test_a_larger_share_only_adds_to_the_training_part():
    assert set(split_ids(IDS, 0.6).train) < set(split_ids(IDS, 0.8).train)


def test_known_assignment():
    """sha256("a") begins ca97..., i.e. 0.791 of the way; "b" 3e23..., 0.243."""
    assert split_ids(["a", "b"], 0.79) == (("b",), ("a",))
    with pytest.raises(DataError, match="leave 2 to train on and 0 to test on"):
        split_ids(["a", "b"], 0.80)


@pytest.mark.parametrize("ids", [[], ["a"], IDS[:3]])
def test_an_empty_part_is_refused(ids):
    with pytest.raises(DataError, match="add models"):
        split_ids(ids, 0.5, exclude=IDS[:3])
