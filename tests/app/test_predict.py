import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from commands import ROOT, run_command, wait_for
from conftest import TRESTLE
from PIL import Image

from ffd_lightning.app.commands import predict
from ffd_lightning.app.commands.predict import Settings, find_jobs, predict_files
from ffd_lightning.app.open_run import open_run
from ffd_lightning.app.settings import read_settings
from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.errors import ConfigError
from ffd_lightning.files import lock_folder
from ffd_lightning.geometry.ffd import Lattice, deform, deformation_matrix
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.predictor import Predictor

FILES = ("mesh.glb", "template.glb", "lattice.glb", "cloud.ply", "prediction.json", "preview.png")


@pytest.fixture(scope="module")
def photos(tiny_run, tmp_path_factory):
    """Three test images as files."""
    folder = tmp_path_factory.mktemp("photos")
    data = open_run(tiny_run).data
    for row in data.rows(data.split.test)[:3]:
        image = Image.fromarray(data.prepared.image(int(row)))
        image.save(folder / f"{data.prepared.ids[row]}.png")
    return folder


@pytest.fixture
def config(checkpoint, tmp_path):
    return Settings(
        run=str(checkpoint), out=str(tmp_path / "out"), points=300, progress_bar=False, workers=2
    )


@pytest.fixture(scope="module")
def written(checkpoint, photos, tmp_path_factory):
    """All that is written of one photograph: its folder, and the reconstruction."""
    photo = sorted(photos.iterdir())[0]
    out = tmp_path_factory.mktemp("out")
    config = Settings(
        run=str(checkpoint), image=str(photo), out=str(out), points=300, top_k=2, obj=True
    )
    (outcome,) = predict_files(config)
    assert not outcome.error
    return out / photo.stem, Predictor.load(checkpoint).predict(photo)


def test_of_several_images_of_one_object_each_is_judged(photos, checkpoint, tmp_path):
    whole, cut, blank = sorted(photos.iterdir())[0], tmp_path / "cut.png", tmp_path / "blank.png"
    picture = np.full((60, 80, 3), 255, np.uint8)
    Image.fromarray(picture).save(blank)
    picture[20:45, :50] = (120, 60, 30)
    Image.fromarray(picture).save(cut)
    common = {"run": str(checkpoint), "together": True, "points": 9, "preview": False}
    (found,) = predict_files(Settings(**common, image=[str(whole), str(cut)], out=str(tmp_path)))
    assert any(x.startswith(f"of {cut}: the object touches") for x in found.warnings)
    (failed,) = predict_files(Settings(**common, image=[str(whole), str(blank)], out=str(tmp_path)))
    assert failed.error.startswith(f"{blank}: no object found")


def test_meshes_are_the_reconstruction_and_its_template(written):
    folder, reconstruction = written
    assert sorted(p.name for p in folder.iterdir()) == sorted(
        [*FILES, "mesh.obj", "mesh.mtl", "candidate-2"]
    )
    scene = trimesh.load(folder / "mesh.glb", process=False)
    assert sum(len(g.faces) for g in scene.geometry.values()) == len(reconstruction.mesh.faces)
    area = sum(g.area for g in scene.geometry.values())
    assert area == pytest.approx(reconstruction.mesh.area, rel=1e-4)
    np.testing.assert_allclose(scene.bounds, reconstruction.mesh.bounds, atol=1e-5)
    template = trimesh.load(folder / "template.glb", process=False)
    np.testing.assert_allclose(template.bounds, reconstruction.template.bounds, atol=1e-5)
    obj = trimesh.load(folder / "mesh.obj", process=False, force="mesh")
    np.testing.assert_allclose(obj.bounds, reconstruction.mesh.bounds, atol=1e-5)
    second = trimesh.load(folder / "candidate-2" / "mesh.glb", process=False)
    other = reconstruction.candidate(1).mesh
    np.testing.assert_allclose(second.bounds, other.bounds, atol=1e-5)


def test_a_textured_template_is_shown_with_its_textures(selecting, photos, tmp_path):
    """In both files, the deformed mesh has the textures of its template and looks like it."""
    photo = sorted(photos.iterdir())[0]
    run = selecting(TRESTLE)
    config = Settings(
        run=str(run), image=str(photo), out=str(tmp_path), points=9, preview=False, obj=True
    )
    config.colors = "material"
    predict_files(config)
    folder, found = tmp_path / photo.stem, Predictor.load(run).predict(photo)
    pictures = [folder / f"mesh-texture-{k}.png" for k in range(len(found.surface.textures))]
    assert pictures
    assert all(picture.is_file() for picture in pictures)
    expected = render(found.surface, height=96, width=128).astype(int)
    for file, others in (("mesh.glb", []), ("mesh.obj", [folder / "mesh.mtl", *pictures])):
        mesh, _ = read_mesh(folder / file, others)
        assert len(mesh.faces) == len(found.mesh.faces)
        own = {texture.tobytes() for texture in mesh.textures}
        assert own == {texture.tobytes() for texture in found.surface.textures}
        shown = render(mesh, height=96, width=128)[..., :3].astype(int)
        assert np.abs(shown - expected[..., :3]).mean() < 0.3, file


def test_the_cloud_has_a_label_for_each_point(written):
    folder, reconstruction = written
    content = (folder / "cloud.ply").read_bytes()
    header, body = content.split(b"end_header\n", 1)
    assert b"element vertex 300" in header
    for k, name in enumerate(reconstruction.part_names):
        assert f"comment label {k} {name}\n".encode() in header
    table = np.frombuffer(body, [("xyz", "<f4", 3), ("rgba", "u1", 4), ("label", "u1")], 300)
    points, faces = reconstruction.sample(300)
    labels = reconstruction.labels[faces]
    np.testing.assert_allclose(table["xyz"], points, atol=1e-6)
    np.testing.assert_array_equal(table["label"], labels)
    assert len(trimesh.load(folder / "cloud.ply").vertices) == 300


def test_the_record_suffices_to_make_the_mesh_again(written):
    folder, reconstruction = written
    content = json.loads((folder / "prediction.json").read_text())
    assert content["template"]["id"] == reconstruction.template_id
    assert list(content["weights"].values()) == sorted(content["weights"].values(), reverse=True)
    assert sum(content["weights"].values()) == pytest.approx(1, abs=1e-5)
    box, offsets = content["lattice"], np.array(content["offsets"])
    assert box["degrees"] == [3, 3, 3]
    lattice = Lattice(torch.tensor(box["origin"]), torch.tensor(box["axes"]).diagonal())
    matrix = deformation_matrix(torch.from_numpy(reconstruction.template.vertices), lattice)
    moved = deform(matrix, lattice.control_points(), torch.from_numpy(offsets))
    np.testing.assert_allclose(moved, reconstruction.mesh.vertices, atol=1e-5)
    assert content["image"]["steps"] == list(reconstruction.photo.steps)
    assert content["trained_on"]["categories"] == ["table"]
    assert "azimuth 45 " in content["trained_on"]["views"]
    assert set(content["seconds"]) == {"framing", "network", "meshes"}
    there = {p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()}
    assert {*content["files"], "prediction.json"} == there
    preview = Image.open(folder / "preview.png")
    assert preview.width > 5 * 64


def test_files_folders_patterns_and_lists(tmp_path):
    made = ("o/b/prediction.json", "o/b/preview.png", "o/b/candidate-2/preview.png")
    for name in ("b.png", "a.JPG", "._b.png", "notes.txt", "sub/a.png", "sub/c.webp", *made):
        (tmp_path / name).parent.mkdir(exist_ok=True, parents=True)
        (tmp_path / name).touch()

    def names(image):
        return [str(job.image.relative_to(tmp_path)) for job in find_jobs(image, None, Path("o"))]

    assert names(str(tmp_path)) == ["a.JPG", "b.png"]
    assert names(f"{tmp_path}/**/*.png") == ["b.png", "sub/a.png"]
    assert names([f"{tmp_path}/b.png", str(tmp_path)]) == ["b.png", "a.JPG"]
    assert names(f"{tmp_path}/gone.png") == ["gone.png"], "named when its turn comes"
    jobs = find_jobs([str(tmp_path), f"{tmp_path}/sub"], None, Path("o"))
    assert [job.folder.name for job in jobs] == ["a.JPG", "b", "a.png", "c"]
    with pytest.raises(ConfigError, match="no images there"):
        find_jobs(f"{tmp_path}/*.bmp", None, Path("o"))


def test_masks_go_by_name(tmp_path):
    (tmp_path / "masks").mkdir()
    (tmp_path / "masks" / "a.bmp").touch()
    (job,) = find_jobs("a.png", str(tmp_path / "masks"), Path("o"))
    assert job.mask == tmp_path / "masks" / "a.bmp"
    (tmp_path / "masks" / "c.png").touch()
    (tmp_path / "masks" / "c.bmp").touch()
    for images, mask, message in (
        ("c.png", tmp_path / "masks", r"2 masks named c\.\*"),
        (str(tmp_path / "masks" / "a.bmp"), tmp_path / "masks", "the photograph itself"),
        (["a.png", "b.png"], tmp_path / "masks", r"no masks named b\.\*"),
        (["a.png", "b.png"], "mask.png", "folder of masks"),
    ):
        with pytest.raises(ConfigError, match=message):
            find_jobs(images, str(mask), Path("o"))


def test_what_is_there_is_not_made_again(config, photos, tmp_path, monkeypatch):
    config = replace(config, image=str(photos), preview=False)
    first = predict_files(config)
    assert [o.known for o in first] == [False] * 3
    folder = Path(config.out) / sorted(photos.iterdir())[0].stem
    before = (folder / "mesh.glb").stat().st_mtime_ns
    assert [o.known for o in predict_files(config)] == [True] * 3
    assert (folder / "mesh.glb").stat().st_mtime_ns == before
    (folder / "prediction.json").unlink()  # as a kill leaves it
    assert [o.known for o in predict_files(config)] == [False, True, True]
    assert not any(o.known for o in predict_files(replace(config, points=301)))
    (folder / "mesh.glb").unlink()
    again = predict_files(replace(config, points=301))
    assert [o.known for o in again] == [False, True, True]
    again = predict_files(replace(config, points=301, restart=True))
    assert not any(o.known for o in again)
    monkeypatch.setattr(predict, "FORMAT_VERSION", -1)
    assert not any(o.known for o in predict_files(replace(config, points=301)))
    other = tmp_path / f"{folder.name}.png"
    Image.new("RGB", (64, 48), "brown").save(other)
    (outcome,) = predict_files(replace(config, image=str(other)))
    assert "holds what was made of" in outcome.error
    assert (folder / "mesh.glb").is_file()


def test_one_command_at_a_time_and_the_number_of_workers_changes_nothing(config, photos, tmp_path):
    Path(config.out).mkdir()
    config = replace(config, image=str(photos), preview=False)
    with lock_folder(Path(config.out), ""), pytest.raises(ConfigError, match="another process"):
        predict_files(config)
    for workers in (1, 3):
        predict_files(replace(config, workers=workers, out=str(tmp_path / str(workers))))
    for file in (tmp_path / "1").rglob("*"):
        if file.is_file() and file.name != "prediction.json":
            other = tmp_path / "3" / file.relative_to(tmp_path / "1")
            assert file.read_bytes() == other.read_bytes(), file


def test_the_command_says_what_it_did(checkpoint, photos, tmp_path):
    (tmp_path / "in").mkdir()
    for k, photo in enumerate(sorted(photos.iterdir())[:2]):
        (tmp_path / "in" / f"my photo {k}, copy=1 (x).png").write_bytes(photo.read_bytes())
    (tmp_path / "in" / "broken.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    given = (f"run={checkpoint}", "image=in", "out=out", "preview=false")
    done = run_command("predict", *given, cwd=tmp_path)
    assert done.returncode == 1
    assert "2 of 3 photographs done" in done.stdout
    assert "broken.png" in done.stderr
    assert "Traceback" not in done.stderr
    assert len(list((tmp_path / "out").glob("*/prediction.json"))) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in", "out"]
    alone = run_command("predict", f"run={checkpoint}", "preview=false", cwd=tmp_path / "in")
    assert "4 of 4 photographs done" in alone.stdout


def test_a_list_needs_no_brackets_and_names_may_hold_commas():
    settings = read_settings(Settings, ["box=1,2,30,40", "image=a,b.png"])
    assert (settings.box, settings.image) == ((1, 2, 30, 40), ["a,b.png"])


def test_a_kill_leaves_no_half_file_and_the_command_goes_on(checkpoint, photos, tmp_path):
    many = tmp_path / "many"
    many.mkdir()
    for k in range(12):
        photo = sorted(photos.iterdir())[k % 3]
        (many / f"{k:02d}.png").write_bytes(photo.read_bytes())
    out = tmp_path / "out"
    given = (f"run={checkpoint}", f"image={many}", f"out={out}", "preview=false", "points=200")
    command = [sys.executable, "predict.py", *given]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL)
    wait_for(lambda: len(list(out.glob("*/prediction.json"))) >= 3)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    whole = list(out.glob("*/prediction.json"))
    for note in whole:
        trimesh.load(note.with_name("mesh.glb"))
    before = {note: note.stat().st_mtime_ns for note in whole}
    done = run_command("predict", *given)
    assert done.returncode == 0, done.stderr
    assert f"{len(whole)} of them there already" in done.stdout
    assert before == {note: note.stat().st_mtime_ns for note in whole}
    assert len(list(out.glob("*/prediction.json"))) == 12


def test_meshes_of_ones_own_are_templates(
    config, conditioned_checkpoint, checkpoint, photos, tmp_path
):
    """They decide what is written, with how they are turned and what their files hold."""
    meshes, photo = tmp_path / "meshes", sorted(photos.iterdir())[0]
    meshes.mkdir()
    for name, size in (("low", (2, 1, 3)), ("tall", (1, 3, 1))):
        trimesh.creation.box(size).export(meshes / f"{name}.ply")
    data = {"data_root": str(tmp_path / "data"), "image": [str(photo)], "preview": False}
    own = replace(config, **data, run=str(conditioned_checkpoint), templates=[str(meshes)])
    file = Path(config.out) / photo.stem / "prediction.json"

    def made(settings):
        (outcome,) = predict_files(settings)
        assert not outcome.error
        return not outcome.known

    assert made(own)
    record = json.loads(file.read_text())
    assert record["weights"].keys() == {"low", "tall"}
    assert record["templates"] == [str(meshes)]
    assert not made(own)
    assert made(replace(own, beside=True))
    assert len(json.loads(file.read_text())["weights"]) > 2
    assert made(replace(own, yaw=90.0))
    trimesh.creation.box((1, 1, 1)).export(meshes / "low.ply")
    assert made(own)
    for settings, words in (
        (replace(own, out=str(meshes / "out")), "out=.* lies in"),
        (replace(own, run=str(checkpoint)), "heads=conditioned"),
        (replace(own, top_k=3), "2 templates"),
        (replace(own, templates=None, yaw=90.0), "templates="),
        (replace(own, templates=None, beside=True), "templates="),
        (replace(own, image=["gone.png"]), "gone.png: there is no such file"),
    ):
        with pytest.raises(ConfigError, match=words):
            predict_files(settings)
