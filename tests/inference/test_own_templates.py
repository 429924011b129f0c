import shutil
from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from PIL import Image

from ffd_lightning import shapes
from ffd_lightning.checkpoint import load_model
from ffd_lightning.data.categories import ANY
from ffd_lightning.data.preparation import preparation
from ffd_lightning.data.reading.orientation import turn
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.mesh import UNKNOWN_PART, Mesh
from ffd_lightning.inference.own_templates import of_files, of_meshes, tell
from ffd_lightning.inference.pose import better_turn
from ffd_lightning.inference.predictor import Predictor

SIZES = {"low": (2, 1, 3), "tall": (1, 3, 1), "wide": (4, 1, 1)}


@pytest.fixture(scope="module")
def model(conditioned_checkpoint):
    return load_model(conditioned_checkpoint)


def box(size):
    return trimesh.creation.box(size).subdivide().apply_translation((5, 6, 7))


@pytest.fixture
def folder(tmp_path):
    """Boxes as files of several formats, a broken one, and one in a folder of its own."""
    top = tmp_path / "my meshes"
    (top / "wide" / "models").mkdir(parents=True)
    for name, file in (("low", "low.obj"), ("tall", "tall.ply"), ("wide", "wide/models/m.off")):
        box(SIZES[name]).export(top / file)
    (top / "broken.stl").write_text("nothing")
    (top / "low.obj").write_text("mtllib gone.mtl\n" + (top / "low.obj").read_text())
    return top


def test_files_are_what_the_same_meshes_are_in_memory(model, folder, tmp_path, capfd):
    files = of_files(model, folder, root=tmp_path / "data", up="z", yaw=90)
    assert capfd.readouterr().err.count("broken.stl has no faces") == 1, "by the preparation"
    of_files(model, folder, root=tmp_path / "data", up="z", yaw=90)
    again = capfd.readouterr().err
    assert again.count("broken.stl has no faces") == 1, "when it is kept, too"
    assert "warning: templates: material files are absent (1 of 3)" in again
    given = {name: box(size) for name, size in SIZES.items()}
    given["low"] = Mesh(
        *(np.asarray(x) for x in (given["low"].vertices, given["low"].faces)),
        np.full((len(given["low"].faces), 4), 255, np.uint8),
    )
    memory = of_meshes(model, given, up="z", yaw=90)
    assert files.bank.ids == memory.bank.ids == ("low", "tall", "wide")
    assert files.bank.points.shape[1] == model.bank.points.shape[1]
    assert (files.bank.degrees, files.bank.max_edge) == (model.bank.degrees, model.bank.max_edge)
    for own, other in zip(files.bank.lattices, memory.bank.lattices, strict=True):
        np.testing.assert_allclose(own.size, other.size, atol=1e-6)
    low = np.abs(turn(SIZES["low"], "z", 90))
    np.testing.assert_allclose(files.bank.lattices[0].size, low / np.linalg.norm(low), atol=1e-6)
    views = 0
    for own, other in zip(files.pictures, memory.pictures, strict=True):
        assert own.shape == (1, 48, 64, 4)
        assert np.abs(own[..., 3].astype(int) - other[..., 3]).mean() < 0.5, "rounded in the file"
        views += 1
    assert views == 3


def test_parts_and_textures_are_carried(model, tmp_path):
    plain = box((1, 1, 1))
    square = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 2]], process=False)
    image = Image.new("RGB", (4, 4), (200, 30, 30))
    image.format = "PNG"
    material = trimesh.visual.material.SimpleMaterial(image=image)
    square.visual = trimesh.visual.TextureVisuals(np.eye(3)[:, :2], material=material)
    parts = np.arange(len(plain.faces)).astype(np.uint8) % 2
    colors = np.full((len(plain.faces), 4), 255, np.uint8)
    labelled = Mesh(plain.vertices, plain.faces, colors, parts, ("leg", "top"))
    found = Predictor(model).with_templates({"square": square, "box": labelled}).model.bank
    assert found.part_names == ("leg", "top")
    assert set(found.point_parts[1]) == {0, 1}
    assert found.meshes[0].textures[0][0, 0].tolist() == [200, 30, 30, 255]


def test_layouts(model, folder, tmp_path, capfd):
    def ids(*places):
        return of_files(model, places, root=tmp_path / "data", progress=False).bank.ids

    assert ids(folder / "low.obj") == ("low",)
    assert ids(f"{folder}/*.*") == ("low", "tall"), "less what cannot be used"
    assert ids(f"{folder}/**/*.off") == ("m",)
    tree = tmp_path / "tree"
    for category in ("04379243", "chair"):
        shutil.copytree(folder, tree / category)
    assert ids(tree) == ("low", "tall", "wide"), "tables, which the model was trained on"
    assert "left out: chair" in capfd.readouterr().err
    shutil.rmtree(tree / "04379243")
    joint = of_files(
        replace(model, categories=("table", "chair")), tree / "chair", root=tree.parent
    )
    assert joint.bank.ids == ("chair/low", "chair/tall", "chair/wide"), "of a category it knows"
    assert ids(tree / "chair", folder / "low.obj", tree / "chair" / "low.obj") == (
        *("chair/low", "chair/tall", "chair/wide"),
        *(f"files/{place}/low.obj" for place in ("my meshes", "tree/chair")),
    )


def test_what_is_prepared_is_kept_until_a_file_changes(
    model, prepared, folder, tmp_path, monkeypatch
):
    def told():
        return tell(model, of_files(model, folder, root=tmp_path / "data", progress=False))

    first = told()
    with monkeypatch.context() as patch:
        patch.setattr(preparation, "make_shapes", None)
        patch.setattr(type(model.network), "codes", None)
        patch.setattr(Mesh, "used_vertices", None)  # boxes are kept, too
        again = told()
    found, kept = (Predictor(x).predict(prepared.image(0)) for x in (first, again))
    assert np.array_equal(found.weights, kept.weights)
    assert np.array_equal(found.offsets, kept.offsets)
    for file in (tmp_path / "data" / "codes").iterdir():
        file.write_bytes(b"cut off")
    assert np.array_equal(told().network.template_codes, first.network.template_codes)
    box((1, 1, 1)).export(folder / "low.obj")
    changed = told()
    np.testing.assert_allclose(changed.bank.lattices[0].size, np.ones(3) / 3**0.5, atol=1e-6)
    assert not np.array_equal(changed.network.template_codes, first.network.template_codes)


def test_one_mesh_is_enough(model, prepared):
    for predictor in (Predictor(model), Predictor.load()):
        found = predictor.with_templates({"only": box((1, 2, 3))}).predict(prepared.image(0))
        assert (found.template_id, found.weight) == ("only", pytest.approx(1))
        assert np.abs(found.offsets).max() > 0


def test_mistakes_are_named(model, folder, tmp_path, checkpoint):
    (tmp_path / "empty").mkdir()
    (tmp_path / "note.txt").touch()
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    for given, kind, words in (
        (tmp_path / "none", ConfigError, "no mesh files there"),
        (tmp_path / "note.txt", ConfigError, "no mesh file"),
        (tmp_path / "empty", DataError, "holds no shapes"),
        (folder / "broken.stl", DataError, "broken"),
        (tmp_path, ConfigError, "data_root=.* lies in"),
        ([folder, shutil.copytree(folder, tmp_path / "x" / folder.name)], ConfigError, "rename"),
        ([shutil.copytree(folder, tmp_path / "files"), folder / "low.obj"], ConfigError, "beside"),
        ({}, ConfigError, "no meshes"),
        ([flat], ConfigError, "a Trimesh without a name"),
        ({"a": "a.obj"}, ConfigError, "files as a list"),
        ({"flat": flat}, DataError, "flat"),
    ):
        with pytest.raises(kind, match=words):
            Predictor(model).with_templates(given, root=tmp_path / "data", progress=False)
    with pytest.raises(ConfigError, match="heads=conditioned"):
        Predictor.load(checkpoint).with_templates(folder, root=tmp_path / "other")
    assert not (tmp_path / "other").exists()


def test_a_folder_says_of_what_category_a_mesh_is_not_its_name(model):
    bank = replace(model.bank, ids=("chair", "table/chair"))
    found = replace(model, categories=("chair", "table"), bank=bank)
    assert found.template_categories == (ANY, "table")


def test_own_meshes_beside_the_network_s_own(model, prepared, folder, tmp_path):
    where = {"root": tmp_path / "data", "progress": False}
    network = Predictor(model)
    told, both = (network.with_templates(folder, beside=b, **where) for b in (False, True))
    bank, image = both.model.bank, prepared.image(0)
    assert bank.ids == (*model.bank.ids, *told.model.bank.ids)
    first, alone, found = (p.predict(image) for p in (network, told, both))
    offsets = np.concatenate([first.offsets, alone.offsets])
    np.testing.assert_allclose(found.offsets, offsets, atol=1e-6)
    for k in (0, len(bank) - 1):
        lone = (first, alone)[k > 0].bank
        row = k if k == 0 else len(lone) - 1
        assert np.array_equal(bank.deformation_matrix[k], lone.deformation_matrix[row])
        assert np.array_equal(bank.subdivided(k)[0].vertices, lone.subdivided(row)[0].vertices)
    again = both.with_templates(folder, beside=True, **where).model
    assert again.bank.ids == bank.ids, "one template of each id"
    assert torch.equal(again.network.template_codes, both.model.network.template_codes)


def test_parts_of_joined_banks_keep_their_names():
    def bank(name, parts):
        mesh = box((1, 1, 1))
        labels = np.arange(len(mesh.faces)).astype(np.uint8) % 2
        colors = np.full((len(mesh.faces), 4), 255, np.uint8)
        labelled = Mesh(mesh.vertices, mesh.faces, colors, labels if parts else None, parts)
        return TemplateBank.of_meshes({name: labelled}, 64)

    first, other, plain = bank("a", ("leg", "top")), bank("b", ("top", "arm")), bank("c", ())
    both = first.joined([0], other).joined([1, 0], plain)
    assert (both.ids, both.part_names) == (("b", "a", "c"), ("leg", "top", "arm"))
    for k, alone in enumerate((other, first)):
        names = np.array(both.part_names)[both.point_parts[k]]
        assert np.array_equal(names, np.array(alone.part_names)[alone.point_parts[0]])
        mesh, was = both.meshes[k], alone.meshes[0]
        faces = np.array(mesh.part_names)[mesh.face_parts]
        assert np.array_equal(faces, np.array(was.part_names)[was.face_parts])
    assert set(both.point_parts[2]) == {UNKNOWN_PART}
    assert both.meshes[2].face_parts is None
    assert TemplateBank.from_state(both.state()).ids == both.ids


def test_templates_of_no_known_category_are_of_any(joint_checkpoint, prepared):
    model = load_model(joint_checkpoint)

    def named(*names):
        bank = TemplateBank.of_meshes({name: shapes.build("table", 0)[0] for name in names}, 8)
        return replace(model, bank=bank)

    some, none = named("sofa/a", "table/b", "c"), named("a", "b")
    assert some.templates_of("sofa") == (0, 2)
    assert none.templates_of("any") == (0, 1)
    with pytest.raises(ConfigError, match="category=sofa: none of these templates"):
        none.templates_of("sofa")
    found, weights = Predictor(model).predict(prepared.image(0)), np.float32([0.2, 0.3, 0.4, 0.1])
    known = replace(found, categories=("sofa", "table", "any", "any"), weights=weights)
    assert known.of_category("table").ranking.tolist() == [2, 1, 3]
    assert known.of_category("sofa").ranking.tolist() == [2, 0, 3]
    assert known.of_category("any").ranking.tolist() == [2, 1, 0, 3]
    doubts = {name: len(known.of_category(name).warnings) for name in ("sofa", "table", "any")}
    assert doubts == dict.fromkeys(doubts, len(found.photo.warnings)), "0.7, 0.8 and all of it"


def test_meshes_that_stand_wrongly_are_turned_as_they_need_it():
    def bank(first, up="y", yaw=0.0):
        found = {str(k): shapes.build("chair", k)[0] for k in range(first, first + 6)}
        turned = {k: mesh.with_vertices(turn(mesh.vertices, up, yaw)) for k, mesh in found.items()}
        return TemplateBank.of_meshes(turned, 256)

    known = bank(0)
    assert better_turn(bank(20), known, "y", 0.0) == ("y", 0.0)
    for yaw in (90.0, 180.0, 270.0):  # files that face -z, turned by mistake
        assert better_turn(bank(20, "y", yaw), known, "y", yaw) == ("y", 0.0)
    on_its_back = bank(20, "z", 180.0)
    assert better_turn(on_its_back, known, "z", 180.0) == ("y", 0.0)
    assert better_turn(on_its_back, known, "y", 0.0)[0] == "z"
