import pytest
from hypothesis import given
from hypothesis import strategies as st

from ffd_lightning.data.splits import hash_parts, listed_parts, make_split, r2n2_parts
from ffd_lightning.errors import ConfigError, DataError


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


# --- other rules --------------------------------------------------------------------------------


def test_3d_r2n2_takes_the_first_four_fifths_of_the_sorted_ids():
    ids = [f"{i:03d}" for i in range(11)]
    parts = r2n2_parts(ids[::-1])
    assert [i for i in ids if parts[i] == "train"] == ids[:8]  # int(8.8)
    split = make_split(set(ids) - {"003", "009"}, parts, exclude={"000"})
    assert split == (tuple(i for i in ids[1:8] if i != "003"), ("008", "010"))


FORMS = {
    "ids.txt": "c\nd\n\n",
    "synset.txt": "03001627/c\n03001627/d/\n",
    "parts.txt": "a train\nb train\nc test\nd test\ne val\n",
    "plain.csv": "a,train\nb,train\nc,test\nd,test\n",
    "all.csv": "id,synsetId,subSynsetId,modelId,split\n1,3001627,0,a,train\n2,3001627,0,b,train\n"
    "3,3001627,0,c,test\n4,3001627,0,d,test\n5,4379243,0,a,test\n",
    "split.json": '{"train": ["a", "b"], "test": ["c", "03001627/d"], "val": ["e"]}',
    "nested.json": '{"03001627": {"train": ["a", "b"], "test": ["c", "d"]}, "04379243": {}}',
    "folder": {"03001627/train.lst": "a\nb", "03001627/test.lst": "c\nd", "train.lst": "d"},
    "flat": {"train.txt": "a b", "val.txt": "e", "test.txt": "c d"},
    "partnet": {
        "shuffled_train_file_list.json": '["shape_data/03001627/a", "shape_data/03001627/b"]',
        "shuffled_test_file_list.json": '["shape_data/03001627/c", "shape_data/03001627/d",'
        ' "shape_data/04379243/a"]',
    },
}


@pytest.mark.parametrize("name", FORMS)
def test_published_forms_of_lists(tmp_path, name):
    for path, text in ({name: FORMS[name]} if "." in name else FORMS[name]).items():
        file = tmp_path / ("" if "." in name else name) / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    parts = listed_parts(tmp_path / name, "chair")
    assert make_split("abcd", parts) == (("a", "b"), ("c", "d"))


def test_models_to_validate_on_or_without_part_are_left_out(tmp_path, caplog):
    caplog.set_level("INFO")
    (tmp_path / "s.txt").write_text(FORMS["parts.txt"])
    parts = listed_parts(tmp_path / "s.txt", "chair")
    assert make_split("abcdefg", parts, exclude="a") == (("b",), ("c", "d"))
    assert "left out: 1 models to validate on, 2 without part" in caplog.text


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("s.txt", "", "lists no models of chair"),
        ("s.txt", "a train\nb dev\n", "'dev' for one of train, val, test"),
        ("s.txt", "a train\nb\n", "cannot be read"),
        ("s.json", "[1, 2", "cannot be read"),
        ("s.json", "[1, 2]", "cannot be read"),
        ("s.csv", "id,synsetId,split\na,04379243,train\n", "lists no models of chair"),
    ],
)
def test_lists_that_cannot_be_used(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ConfigError, match=message):
        listed_parts(tmp_path / name, "chair")
    with pytest.raises(ConfigError, match="cannot be read"):
        listed_parts(tmp_path / "absent", "chair")
