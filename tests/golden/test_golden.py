"""Results stay as they were recorded, on whichever processor, until a version says otherwise."""

import digests
import pytest
import subjects

SHOWN = 12
ADVICE = {
    "shapes": "If shapes are meant to change, raise GENERATOR_VERSION",
    "prepared": "If the shapes are as before and the set is meant to change, raise the "
    "preparation's FORMAT_VERSION",
    "training": "If shapes and prepared set are as before, training has changed: see that it is "
    "meant to",
    "evaluation": "If shapes and prepared set are as before and the numbers are meant to change, "
    "raise the evaluation's FORMAT_VERSION",
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the one prepared set of these tests is."""
    return tmp_path_factory.mktemp("golden")


@pytest.mark.parametrize("kind", list(digests.KINDS))
def test_results_are_as_recorded(kind, folder):
    golden = digests.read(kind)
    if golden["versions"] != subjects.versions():
        pytest.fail(
            f"{kind}.json is of the versions {golden['versions']}, the code of "
            f"{subjects.versions()}: record the golden files anew: {digests.COMMAND}"
        )
    stored = golden["digests"]
    found = digests.shapes_again(stored) if kind == "shapes" else digests.KINDS[kind](folder)
    changed = list(digests.differences(stored, found))
    if changed:
        lines = "\n  ".join(changed[:SHOWN])
        more = f"\n  and {len(changed) - SHOWN} more" if len(changed) > SHOWN else ""
        pytest.fail(
            f"{_subjects(kind, changed)}:\n  {lines}{more}\n{ADVICE[kind]}, and run "
            f"{digests.COMMAND}"
        )


def test_every_family_is_recorded():
    stored = digests.read("shapes")["digests"]
    families = {
        category: {model["family"] for model in entry["models"].values()}
        for category, entry in stored.items()
    }
    assert families == {category: set(names) for category, names in subjects.families().items()}


def _subjects(kind, changed):
    """Name the shapes that changed, or whatever else."""
    places = [line.split(": ")[0].split("/") for line in changed]
    names = [p[p.index("models") + 1] if "models" in p[:-1] else p[0] for p in places]
    names = list(dict.fromkeys(names))
    return f"{kind}: {len(names)} changed without a new version: {', '.join(names)}"


def test_differences():
    stored = {"a": {"faces": "1f", "sums": [1.0, 2.0]}, "b": 3}
    assert not list(digests.differences(stored, stored))
    near = {"a": {"faces": "1f", "sums": [1.0 + 1e-8, 2.0]}, "b": 3}
    assert not list(digests.differences(stored, near))
    far = {"a": {"faces": "2f", "sums": [1.0, 2.00001]}, "c": 3}
    assert list(digests.differences(stored, far)) == [
        "a/faces: 1f -> 2f",
        "a/sums/1: 2.0 -> 2.00001",
        "b: gone",
        "c: new",
    ]
    assert list(digests.differences({"b": 3}, {"b": 3.0000001})) == ["b: 3 -> 3.0000001"]
    assert list(digests.differences({"sums": [1.0]}, {"sums": [float("nan")]}))
    assert list(digests.differences({"sums": [1.0]}, {"sums": [1.0, 2.0]}))
