"""Figures in files."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from ffd_lightning.analysis.saving import DPI, save_figure
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.sheet import lay_out


@pytest.fixture
def sheet():
    images = list(np.random.default_rng(0).integers(0, 255, (2, 40, 60, 3), dtype=np.uint8))
    return lay_out(images, 2, ["one", "$two"], headings=["left", "right"])


@pytest.fixture
def plot():
    figure = Figure(figsize=(3, 2))
    figure.subplots().plot([0, 1])
    return figure


def test_a_png_and_a_pdf_are_written_without_an_ending(plot, tmp_path):
    files = save_figure(plot, tmp_path / "new" / "plot")
    assert [file.name for file in files] == ["plot.png", "plot.pdf"]
    picture = Image.open(files[0])
    assert picture.size == (3 * DPI, 2 * DPI)
    assert picture.info["dpi"] == pytest.approx((DPI, DPI), rel=1e-3)
    assert files[1].read_bytes().startswith(b"%PDF")
    assert b"/Subtype /Image" not in files[1].read_bytes(), "a plot is drawn as vectors"


def test_a_file_is_the_same_each_time(plot, sheet, tmp_path):
    for figure, endings in ((plot, ("png", "pdf", "svg")), (sheet, ("png",))):
        for ending in endings:
            once, again = (save_figure(figure, tmp_path / f"{k}.{ending}")[0] for k in "ab")
            assert once.read_bytes() == again.read_bytes()


def test_a_sheet_is_its_pixels_as_png(sheet, tmp_path):
    (file,) = save_figure(sheet, tmp_path / "sheet.png")
    np.testing.assert_array_equal(np.asarray(Image.open(file)), sheet.draw())


def test_what_cannot_be_written_is_said(plot, sheet, tmp_path):
    with pytest.raises(ConfigError, match=r"written as \.png$"):
        save_figure(sheet, tmp_path / "a.pdf")
    with pytest.raises(ConfigError, match=r"written as \.png, \.pdf, \.svg"):
        save_figure(plot, tmp_path / "a.jpg")
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="cannot write"):
        save_figure(plot, tmp_path / "file" / "a.png")
