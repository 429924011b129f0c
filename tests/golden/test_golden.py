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
