import re
import sys
from dataclasses import replace

import pytest
from PIL import Image

from ffd_lightning.app.commands import view
from ffd_lightning.app.settings import read_settings
from ffd_lightning.app.viewed_runs import open_shared
from ffd_lightning.errors import ConfigError, DataError


def test_a_checkpoint_alone_or_without_its_data_takes_photos_only(checkpoint, tiny_run, tmp_path):
    alone = open_shared(checkpoint)
    assert (alone.shape_ids, "photo" in alone.note) == ((), True)
    assert open_shared(tiny_run.path).shape_ids != ()
    moved = open_shared(tiny_run.path, data_root=str(tmp_path / "elsewhere"))
    assert moved.shape_ids == ()
    assert "elsewhere" in moved.note
    assert "data_root=DIR" in moved.note
    assert not (tmp_path / "elsewhere").exists(), "nothing is prepared for looking"


@pytest.mark.usefixtures("shipped")
def test_without_a_run_the_model_that_comes_with_the_package_is_shown():
    alone = view.open_shared(view.Settings())
    assert alone.shape_ids == ()
    assert alone.heading.startswith("sofa, table: ")


def test_a_photo_and_its_mask_can_be_named(tiny_run, checkpoint, tmp_path):
    alone = open_shared(tiny_run.path)
    image = alone.open_shape(alone.shape_ids[0]).reconstruction.photo.image
    Image.fromarray(image[..., :3]).save(tmp_path / "a.png")
    Image.fromarray(image[..., 3]).save(tmp_path / "m.png")
    settings = view.Settings(run=str(checkpoint), image=str(tmp_path / "a.png"))
    assert view.open_shared(settings).photo.mask is None
    masked = view.open_shared(replace(settings, mask=str(tmp_path / "m.png")))
    state = masked.open_photo(masked.photo)
    assert state.reconstruction.photo.steps[0] == "background: mask"
    assert state.name == "a"
    Image.new("L", image.shape[1::-1]).save(tmp_path / "m.png")
    with pytest.raises(DataError, match=r"the mask.* is empty"):
        view.open_shared(replace(settings, mask=str(tmp_path / "m.png")))
    with pytest.raises(DataError, match=r"no.png cannot be read: No such file"):
        view.open_shared(replace(settings, image=str(tmp_path / "no.png")))
    with pytest.raises(DataError, match="is not a file"):
        view.open_shared(replace(settings, image=str(tmp_path)))


def test_mistakes_are_named():
    for arguments, words in (
        (["run=a", "port=0"], "port=0 must lie in [1, 65535]"),
        (["run=/no/such/run"], "there is no run"),
        (["mask=m.png"], "name it by image="),
    ):
        with pytest.raises(ConfigError, match=re.escape(words)):
            view.main(read_settings(view.Settings, arguments, view.MAIN))


def test_without_viser_nothing_is_loaded(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ConfigError, match="needs viser: pip install"):
        view.main(view.Settings(run="/no/such/run"))
