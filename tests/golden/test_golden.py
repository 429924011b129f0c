"""Results stay as they were recorded, on whichever processor, until a version says otherwise."""

import digests
import pytest
import subjects

SHOWN = 12
ADVICE = """
Where results are meant to change, raise the version that says so (`GENERATOR_VERSION`, or the
FORMAT_VERSION of preparation or evaluation; training has none) and run """


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the one prepared set of these tests is."""
    return tmp_path_factory.mktemp("golden")


@pytest.mark.parametrize("kind", list(digests.KINDS))
def test_results_are_as_recorded(kind, folder):
    golden = digests.read(kind)
    assert golden["versions"] == subjects.versions(), f"record anew: {digests.COMMAND}"
    stored = golden["digests"]
    found = digests.shapes_again(stored) if kind == "shapes" else digests.KINDS[kind](folder)
    changed = list(digests.differences(stored, found))
    if changed:
        lines = "\n  ".join(changed[:SHOWN])
        pytest.fail(f"{kind}: {len(changed)} changed:\n  {lines}{ADVICE}{digests.COMMAND}")


def test_differences():
    stored = {"a": {"faces": "1f", "sums": [1.0, 2.0]}, "b": 3}
    near = {"a": {"faces": "1f", "sums": [1.0 + 1e-8, 2.0]}, "b": 3}
    assert not list(digests.differences(stored, near))
    far = {"a": {"faces": "2f", "sums": [1.0, 2.00001]}, "c": 3}
    assert list(digests.differences(stored, far)) == [
        "a/faces: 1f -> 2f",
        "a/sums/1: 2.0 -> 2.00001",
        "b: gone",
        "c: new",
    ]
    for found in ([float("nan")], [1.0, 2.0]):
        assert list(digests.differences({"sums": [1.0]}, {"sums": found}))
