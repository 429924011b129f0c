"""Pictures of all modes and kinds, turned, masked, damaged."""

import numpy as np
import pytest
from PIL import Image
from trees import encoded

from ffd_lightning.errors import DataError
from ffd_lightning.imaging.photos import read_photo

PHOTO = np.full((60, 80, 3), (90, 130, 190), np.uint8)
PHOTO[10:40, 30:70] = (200, 60, 20)


@pytest.mark.parametrize("orientation", [3, 6])
def test_photographs_are_turned_upright_once(orientation):
    exif = Image.Exif()
    exif[0x0112] = orientation
    # Turned by numpy, so that a turn to the right (6) or by half (3) makes it upright.
    stored = np.ascontiguousarray(np.rot90(PHOTO, {6: 1, 3: 2}[orientation]))
    picture = read_photo(encoded(Image.fromarray(stored), exif=exif))
    np.testing.assert_array_equal(np.asarray(picture), PHOTO)
    np.testing.assert_array_equal(np.asarray(read_photo(picture)), PHOTO)


@pytest.mark.parametrize(
    ("mode", "kind", "off"),
    [("L", "png", 1), ("P", "gif", 60), ("CMYK", "jpeg", 8), ("LA", "png", 1)]
    + [("RGB", "webp", 20), ("RGB", "avif", 20)],
)
def test_pictures_of_any_mode_and_kind(tmp_path, mode, kind, off):
    grey = mode in ("L", "LA")
    source = Image.fromarray(PHOTO).convert("L" if grey else "RGB").convert(mode)
    source.save(tmp_path / "a.png", format=kind)  # what it is, not what it is called, counts
    picture = read_photo(tmp_path / "a.png")
    assert picture.mode == ("RGBA" if mode == "LA" else "RGB")
    expected = np.asarray(Image.fromarray(PHOTO).convert("L").convert("RGB")) if grey else PHOTO
    assert np.abs(np.asarray(picture)[..., :3].astype(int) - expected).mean() <= off


BAD = {
    "text": (b"It was a dark and stormy night.", "is no picture"),
    "a bomb": (encoded(Image.new("1", (9000, 8000)))[:99], "9,000 x 8,000 .*more than 60,000,000"),
    "HEIC": (b"\0\0\0\x18ftypheic\0\0\0\0mif1heic", "is HEIC, .* save it as JPEG"),
    "half a PNG": (encoded(Image.effect_noise((99, 99), 9))[:-3000], "cannot be read .*truncated"),
    "16 bits": (encoded(Image.fromarray(np.full((9, 9), 999, np.uint16))), "more than 8 bits"),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_by_name(tmp_path, name):
    content, reason = BAD[name]
    (tmp_path / "photo.png").write_bytes(content)
    with pytest.raises(DataError, match=reason) as caught:
        read_photo(tmp_path / "photo.png")
    assert str(caught.value).startswith(str(tmp_path / "photo.png"))
    with pytest.raises(DataError, match=f"^upload .*{reason.removeprefix('is ')}"):
        read_photo(content, "upload")


@pytest.mark.parametrize("array", [np.zeros((40, 50, 3)), np.zeros((3, 40, 50), np.uint8)])
def test_an_array_that_is_no_picture_is_told_what_one_is(array):
    with pytest.raises(DataError, match=r"\(H, W, 3 or 4\) uint8, this is \(.*40, 50"):
        read_photo(array)
