import pytest
from hypothesis import given
from hypothesis import strategies as st

from ffd_lightning.data.splits import (
    AutoSplit,
    HashSplit,
    ListedSplit,
    R2n2Split,
    SplitInput,
    make_split,
)
from ffd_lightning.errors import ConfigError, DataError


def shapes(ids, published=None, rejected=(), category="chair"):
    return SplitInput(category, tuple(ids), tuple(rejected), published or {})


def split_ids(ids, fraction, exclude=(), val_fraction=0.0):
    ids = list(ids)
    return make_split(ids, HashSplit(fraction)(shapes(ids)), val_fraction).without(exclude)


IDS = [f"table-{i:06d}" for i in range(5000)]


def test_shares_are_met():
    """Within four standard deviations of a binomial draw, and independently of each other."""
    split = split_ids(IDS, 0.8, val_fraction=0.25)
    for subset, share in zip(split, (0.6, 0.2, 0.2), strict=True):
        error = abs(len(subset) / len(IDS) - share)
        assert error < 4 * (share * (1 - share) / len(IDS)) ** 0.5


@given(st.sets(st.sampled_from(IDS[:60])), st.sets(st.sampled_from(IDS[:60])))
def test_shapes_never_move(added, exclude):
    """Whatever is added or is a template: subsets are disjoint, sorted and complete."""
    ids = set(IDS[60:100]) | added
    whole, some = split_ids(IDS, 0.5, (), 0.3), split_ids(ids, 0.5, exclude, 0.3)
    for all_of_it, subset in zip(whole, some, strict=True):
        assert list(subset) == sorted((set(all_of_it) & ids) - exclude)
    assert sum(map(len, some)) == len(ids - exclude)


def test_known_assignment():
    """sha256("a") begins ca97..., i.e. 0.791 of the way; "b" 3e23..., 0.243."""
    assert split_ids(["a", "b"], 0.79) == (("b",), (), ("a",))
    assert AutoSplit(0.79)(shapes("ab")) == HashSplit(0.79)(shapes("ab"))
    with pytest.raises(DataError, match="2 shapes: 2 to train on, 0 to validate on and 0 to test"):
        split_ids(["a", "b"], 0.80)
    with pytest.raises(ValueError, match=r"train_fraction=1 must lie in \(0, 1\)"):
        AutoSplit(1)


def test_validation_takes_from_the_training_shapes_alone():
    whole, split = split_ids(IDS, 0.8), split_ids(IDS, 0.8, (), 0.1)
    assert whole.val == ()
    assert whole.selection_ids == whole.train
    assert set(split.train) | set(split.val) == set(whole.train)
    assert split.test == whole.test
    assert split.selection_ids == split.val != ()
    assert split.warning() == ""
    few = split._replace(val=split.val[:1])
    assert f"{len(split.train)} to train on, 1 to validate on" in few.warning()


def test_published_validation_shapes_are_the_ones_that_are_used():
    """Also where only some of them are there: the hash adds none."""
    published = {"a": "train", "b": "train", "c": "val", "d": "test", "e": "val"}
    split = make_split("abcde", AutoSplit()(shapes("abcde", published)), 0.9)
    assert split == (("a", "b"), ("c", "e"), ("d",))
    assert split.without("ce").val == ()
    assert make_split("abd", published, 0.9) == (("a", "b"), (), ("d",))


def test_3d_r2n2_takes_the_first_four_fifths_of_the_sorted_ids():
    """Those that could not be prepared are counted too."""
    ids = [f"{i:03d}" for i in range(11)]
    subsets = R2n2Split()(shapes(["007", *ids[:2:-1]], rejected=ids[:3]))
    assert [i for i in ids if subsets[i] == "train"] == ids[:8]  # int(8.8)
    split = make_split(set(ids) - {"003", "009"}, subsets).without({"000"})
    assert split == (tuple(i for i in ids[1:8] if i != "003"), (), ("008", "010"))


FORMS = {
    "ids.txt": "c\nd\n\n",
    "synset.txt": "03001627/c\n03001627/d/\n",
    "parts.txt": "a train\nb train\nc test\nd test\ne val\n",
    "plain.csv": "a,train\nb,train\nc,test\nd,test\n",
    "all.csv": "id,synsetId,subSynsetId,modelId,split\n1,3001627,0,a,train\n2,3001627,0,b,train\n"
    "3,3001627,0,c,test\n4,3001627,0,d,test\n5,4379243,0,a,test\n",
    "folder": {"03001627/train.lst": "a\nb", "03001627/test.lst": "c\nd", "train.lst": "d"},
    "flat": {"train.txt": "a b", "val.txt": "e", "test.txt": "c d"},
    "long": {"train.lst": "a b", "validation.lst": "e", "test.lst": "c d"},
    "unions": {
        **{"train.lst": "a\nb", "test.lst": "c\nd", "trainval.lst": "a\nb\ne"},
        **{"train_val.lst": "a\nb\ne", "latest.txt": "a\nb"},
    },
    "all.txt": "04379243/a test\nchair/a train\n03001627/b train\nc test\nd test\ntable/d train\n",
    "quoted.csv": '"id","split"\n"a","train"\n"b","train"\n"c","test"\n"d","test"\n',
    "shape_id.csv": "shape_id, split\na, train\nb, train\nc, test\nd, test\n",
}


@pytest.mark.parametrize("name", FORMS)
def test_published_forms_of_lists(tmp_path, name):
    for path, text in ({name: FORMS[name]} if "." in name else FORMS[name]).items():
        file = tmp_path / ("" if "." in name else name) / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    subsets = ListedSplit(tmp_path / name)(shapes("abcd"))
    assert make_split("abcd", subsets) == (("a", "b"), (), ("c", "d"))
    named = {i for i, subset in subsets.items() if subset == "val"}
    assert named == ({"e"} if name in ("parts.txt", "flat", "long") else set())


def test_shapes_that_a_list_does_not_name_are_left_out(tmp_path, caplog):
    caplog.set_level("INFO")
    (tmp_path / "s.txt").write_text(FORMS["parts.txt"])
    subsets = ListedSplit(tmp_path / "s.txt")(shapes("abcdefg"))
    split = make_split("abcdefg", subsets, val_fraction=0.9).without("a")
    assert split == (("b",), ("e",), ("c", "d"))
    assert "2 shapes" in caplog.text


def test_lists_that_cannot_be_used(tmp_path):
    for name, text, message in (
        ("s.txt", "", "lists no shapes of chair"),
        ("s.txt", "a.obj\n", "it has 'a.obj', say, where these are called 'a' and so on"),
        ("s.txt", "a train\nb dev\n", "'dev' for one of train, val, test"),
        ("s.txt", "x/a train\na test\n", "has 'a' twice: in train and test"),
        ("s.txt", "a train\nb\n", "cannot be read: 'b' is not `<id> <subset>`"),
        ("s.csv", "id,synsetId,split\na,04379243,train\n", "lists no shapes of chair"),
        ("s.csv", "name,split\na,train\n", "needs the columns .* shape_id"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(ConfigError, match=message):
            make_split("ab", ListedSplit(tmp_path / name)(shapes("ab")))
    with pytest.raises(ConfigError, match="cannot be read"):
        ListedSplit(tmp_path / "absent")(shapes("ab"))
