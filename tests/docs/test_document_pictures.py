"""Every picture of the documents is made by one command."""

import sys

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
