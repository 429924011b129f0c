"""Every picture of the documents is made by one command; which are outdated is said."""

import sys
import warnings

from docs.documents import ROOT

sys.path.insert(0, str(ROOT / "docs" / "tools"))
import pictures


def test_every_picture_has_its_maker():
    folder = ROOT / "docs"
    suffixes = (".png", ".jpg", ".gif")
    found = {
        path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.suffix in suffixes
    }
    of_notebooks = {name for name in found if name.startswith("notebooks/")}
    assert found - of_notebooks == {n for n in pictures.PICTURES if not n.startswith("notebooks/")}
    assert {name.split("/")[1].removesuffix("_files") for name in of_notebooks} <= set(
        pictures.NOTEBOOKS
    )


def test_every_picture_is_small():
    files = [path for path in (ROOT / "docs").rglob("*") if path.is_file()]
    assert [f for f in files if f.stat().st_size > 3e5 and f.suffix != ".zip"] == []
    assert sum(f.stat().st_size for f in files if f.suffix == ".zip") < 6e6, "scores of studies"


def test_outdated_pictures_are_named():
    assert set(pictures.record()) <= set(pictures.PICTURES)
    old = pictures.outdated()
    if old:  # no error: the pictures take trainings, and the code changes more often
        warnings.warn(f"older than the code, see `make pictures`: {', '.join(old)}", stacklevel=1)


def test_a_change_of_the_code_makes_a_picture_outdated(tmp_path):
    part = tmp_path / "part.py"
    part.write_text("a = 1\n")
    before = pictures.digest([tmp_path])
    part.write_text("a = 2\n")
    assert pictures.digest([tmp_path]) != before
    changed = pictures.digest([part])
    assert changed == pictures.digest([tmp_path])
    part.write_text('"""What it is."""\n\na = 2  # two\n')
    assert pictures.digest([part]) == changed, "words decide nothing"
