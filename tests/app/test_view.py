import trimesh
from PIL import Image

from ffd_lightning.app.commands.view import MAIN, Settings, open_shared
from ffd_lightning.app.settings import read_settings


def test_a_checkpoint_alone_or_without_its_data_takes_photos_only(checkpoint, tiny_run, tmp_path):
    alone = open_shared(Settings(run=str(checkpoint)))
    assert (alone.shape_ids, "photo" in alone.note) == ((), True)
    assert open_shared(Settings(run=str(tiny_run.path))).shape_ids != ()
    moved = open_shared(Settings(run=str(tiny_run.path), data_root=str(tmp_path / "elsewhere")))
    assert moved.shape_ids == ()
    assert "elsewhere" in moved.note
    assert "data_root=DIR" in moved.note
    assert not (tmp_path / "elsewhere").exists(), "nothing is prepared for looking"


def test_a_photo_and_its_mask_can_be_named(tiny_run, checkpoint, tmp_path):
    alone = open_shared(Settings(run=str(tiny_run.path)))
    image = alone.open_shape(alone.shape_ids[0]).reconstruction.photo.image
    photo, mask = tmp_path / "a.png", tmp_path / "m.png"
    Image.fromarray(image[..., :3]).save(photo)
    Image.fromarray(image[..., 3]).save(mask)

    def opened(**files):
        return open_shared(Settings(run=str(checkpoint), **{k: str(v) for k, v in files.items()}))

    assert opened(image=photo).photo.mask is None
    shared = opened(image=photo, mask=mask)
    assert shared.open_photo(shared.photo).reconstruction.photo.steps[0] == "background: mask"


def test_other_templates_are_shown(conditioned_checkpoint, tmp_path):
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "meshes" / "box.ply")
    settings = ["data_root=" + str(tmp_path / "data"), f"templates={tmp_path / 'meshes'}"]
    run = f"run={conditioned_checkpoint}"
    assert "1 template," in open_shared(read_settings(Settings, [run, *settings], MAIN)).heading
