import re
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
import torch
from PIL import Image

from ffd_lightning.app.commands import view
from ffd_lightning.app.main import run as run_command
from ffd_lightning.app.settings import read_settings
from ffd_lightning.app.viewed_runs import held_out_shapes, network_titles, open_studio
from ffd_lightning.checkpoint import load_model
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.palette import REGIME_COLORS


def changed(run, folder, change):
    """A copy of a run whose checkpoint says something else."""
    shutil.copytree(run.path, folder)
    file = folder / "checkpoints" / "last.ckpt"
    content = torch.load(file, weights_only=True)
    change(content["model"])
    torch.save(content, file)
    return folder


def test_two_runs_share_their_test_shapes_and_are_told_apart(tiny_run, second_run):
    studio = open_studio([tiny_run.path, second_run.path])
    alone = open_studio([tiny_run.path])
    assert studio.shape_ids == alone.shape_ids != ()
    assert (studio.heading, studio.note) == ("table", "")
    assert [(title.text, title.color) for title in studio.titles] == [
        ("r, regularized", REGIME_COLORS["r"]),
        ("b, base", REGIME_COLORS["b"]),
    ]
    assert all("4 templates, 8 steps" in title.note for title in studio.titles)


def test_two_runs_of_one_regime_are_called_by_what_tells_them_apart(tiny_run, tmp_path):
    model = load_model(tiny_run.checkpoint)
    paths = [tmp_path / "r" / "t4" / "seed0", tmp_path / "r" / "t4" / "seed1"]
    one, other = network_titles([model, model], paths)
    assert (one.text, other.text) == ("r, regularized (seed0)", "r, regularized (seed1)")
    assert one.color == REGIME_COLORS["r"]
    assert other.color not in REGIME_COLORS.values()


def test_runs_of_other_data_or_image_sizes_are_refused_in_one_sentence(
    tiny_run, joint_checkpoint, tmp_path
):
    with pytest.raises(ConfigError, match=r"one category and one image size.*is of sofa, table"):
        open_studio([tiny_run.path, joint_checkpoint])

    def smaller(content):
        content["render"]["height"] = 24

    with pytest.raises(ConfigError, match=r"48 x 64; .* 24 x 64"):
        open_studio([tiny_run.path, changed(tiny_run, tmp_path / "small", smaller)])

    def turned(content):
        content["render"]["azimuths"] = [10.0]

    with pytest.raises(ConfigError, match="the same cameras"):
        open_studio([tiny_run.path, changed(tiny_run, tmp_path / "turned", turned)])


def data_of(prepared, test):
    return SimpleNamespace(
        record=lambda: {"prepared": {"table": prepared}},
        split=SimpleNamespace(test=test),
        prepared=prepared,
    )


def test_runs_show_the_test_shapes_that_both_have():
    """Templates are in no subset, so runs of other templates may differ in their test shapes."""
    paths = [Path("a"), Path("b")]
    data = [data_of("table-1", ("x", "y", "z")), data_of("table-1", ("z", "x", "w"))]
    assert held_out_shapes(data, paths).ids == ("x", "z")
    with pytest.raises(ConfigError, match="the same data: a of table-1, b of table-2"):
        held_out_shapes([data[0], data_of("table-2", ("x",))], paths)
    with pytest.raises(DataError, match="no test shape in common"):
        held_out_shapes([data[0], data_of("table-1", ("w",))], paths)


def test_checkpoints_alone_take_photos_only(checkpoint, tiny_run, tmp_path):
    alone = open_studio([checkpoint])
    assert (alone.shape_ids, "photo" in alone.note) == ((), True)
    both = open_studio([checkpoint, tiny_run.path])
    assert (both.shape_ids, len(both.titles)) == ((), 2)
    moved = open_studio([tiny_run.path], data_root=str(tmp_path / "elsewhere"))
    assert moved.shape_ids == ()
    assert "elsewhere" in moved.note
    assert "data_root=DIR" in moved.note
    assert not (tmp_path / "elsewhere").exists(), "nothing is prepared for looking"


@pytest.mark.usefixtures("shipped")
def test_without_a_run_the_model_that_comes_with_the_package_is_shown():
    alone = view.open_studio(view.Settings())
    assert (alone.shape_ids, alone.heading) == ((), "sofa, table")
    assert "photo" in alone.note


def test_a_photo_and_its_mask_can_be_named(tiny_run, checkpoint, tmp_path):
    alone = open_studio([tiny_run.path])
    image = alone.open_shape(alone.shape_ids[0])[0].reconstruction.photo.image
    Image.fromarray(image[..., :3]).save(tmp_path / "a.png")
    Image.fromarray(image[..., 3]).save(tmp_path / "m.png")
    settings = view.Settings(run=str(checkpoint), image=str(tmp_path / "a.png"))
    assert view.open_studio(settings).photo.mask is None
    masked = view.open_studio(replace(settings, mask=str(tmp_path / "m.png")))
    (session,) = masked.open_photo(masked.photo)
    assert session.reconstruction.photo.steps[0] == "background: mask"
    assert session.name == "a"
    Image.new("L", image.shape[1::-1]).save(tmp_path / "m.png")
    with pytest.raises(DataError, match=r"the mask of a.png is empty"):
        view.open_studio(replace(settings, mask=str(tmp_path / "m.png")))
    with pytest.raises(DataError, match=r"no.png cannot be read: No such file"):
        view.open_studio(replace(settings, image=str(tmp_path / "no.png")))
    with pytest.raises(DataError, match="is not a file"):
        view.open_studio(replace(settings, image=str(tmp_path)))


def test_settings_are_read_and_mistakes_are_named(capsys):
    settings = read_settings(view.Settings, ["runs/a", "port=9000"], view.MAIN)
    assert (settings.run, settings.port, settings.data_root) == ("runs/a", 9000, None)
    for arguments, words in (
        (["run=007"], "there is no run 007"),
        (["run=a", "port=0"], "port=0 must lie in [1, 65535]"),
        (["run=a", "port=abc"], "port=abc cannot be used"),
        (["run=a", "prt=9000"], "Did you mean port?"),
        (["run=/no/such/run"], "there is no run"),
        (["runs=[a]"], "runs= takes two different runs"),
        (["runs=[a,b,c]"], "runs= takes two different runs"),
        (["runs=[a/b,a/../a/b]"], "runs= takes two different runs"),
        (["run=c", "runs=[a,b]"], "runs= and run= cannot be given together"),
        (["checkpoint=c", "runs=[a,b]"], "runs= and checkpoint= cannot be given together"),
        (["mask=m.png"], "name it by image="),
    ):
        with pytest.raises(ConfigError, match=re.escape(words)):
            view.main(read_settings(view.Settings, arguments, view.MAIN))
    run_command("view", ["--help"])
    assert "data_root=" in capsys.readouterr().out


def test_without_viser_nothing_is_loaded(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(ConfigError, match="needs viser: pip install"):
        view.main(view.Settings(run="/no/such/run"))
