import zipfile

import numpy as np
from box_source import RENDER, BoxSource, box_mesh
from ffd_lightning.data.preparation.shape_file import Recipe, compute_shape, is_done, write_shape

from ffd_lightning.data.preparation import shape_file
from ffd_lightning.data.preparation.packing import unpack_mesh
from ffd_lightning.data.source import SourceShape
from ffd_lightning.geometry.mesh import Mesh


class MeshSource:
    """One mesh, whatever is asked for."""

    def __init__(self, mesh):
        self.mesh = mesh

    def load(self, category, shape_id):
        return SourceShape(self.mesh)


def recipe(folder, source):
    return Recipe(source, "box", 40, RENDER, folder)


def make(recipe, shape_id):
    write_shape(recipe, shape_id, compute_shape(recipe, shape_id))


def read(recipe, shape_id):
    make(recipe, shape_id)
    with np.load(recipe.file(shape_id), allow_pickle=False) as arrays:
        mesh, point_parts = unpack_mesh(arrays["mesh"].tobytes())
        return {**arrays, "face_colors": mesh.face_colors, "point_parts": point_parts}


def test_a_sample_depends_on_category_and_id_only(tmp_path):
    source = MeshSource(box_mesh(0))
    one, other = (read(recipe(tmp_path, source), i)["points"] for i in ("a", "b"))
    assert not np.array_equal(one, other)
    (tmp_path / "new").mkdir()
    np.testing.assert_array_equal(read(recipe(tmp_path / "new", source), "a")["points"], one)


def test_odd_ids_do_not_leave_the_folder(tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    read(recipe(folder, MeshSource(box_mesh(0))), "../a/b: ü" + 300 * "x")
    assert len(list(folder.iterdir())) == 1
    assert list(tmp_path.iterdir()) == [folder]


def test_textures_are_kept_and_stand_behind_plain_colours(tmp_path):
    """Beyond what is kept of a texture, the plain colours are of all its texels."""
    texture = np.full((1000, 1000, 4), 255, np.uint8)
    texture[::2, ::2, :3] = 55
    uv = np.array([[(0, 0), (1, 0), (0, 1)]], np.float32)
    mesh = Mesh(
        vertices=np.eye(3),
        faces=np.array([[0, 1, 2]] * 2),
        face_colors=np.full((2, 4), 77, np.uint8),
        textures=(texture,),
        face_textures=np.array([0, -1], np.int16),
        face_uvs=np.concatenate([uv, uv]),
    )
    made = recipe(tmp_path, MeshSource(mesh))
    make(made, "a")
    with np.load(made.file("a"), allow_pickle=False) as arrays:
        found, _ = unpack_mesh(arrays["mesh"].tobytes())
    assert [t.shape for t in found.textures] == [(256, 256, 4)]
    assert abs(int(found.textures[0][..., :3].mean()) - 205) < 3
    np.testing.assert_array_equal(found.face_textures, mesh.face_textures)
    np.testing.assert_array_equal(found.face_uvs[0], uv[0])
    np.testing.assert_array_equal(found.face_colors[1], [77] * 4)
    assert found.face_colors[0, 3] == 255
    assert set(found.face_colors[0, :3]) <= set(range(55, 256))


def test_unknown_parts(tmp_path):
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]), np.full((1, 4), 255, np.uint8))
    arrays = read(recipe(tmp_path, MeshSource(mesh)), "a")
    assert set(arrays["point_parts"]) == {255}
    assert arrays["part_names"].tolist() == []


def test_a_mesh_without_area_is_rejected_with_the_reason(tmp_path):
    mesh = Mesh(np.eye(3), np.array([[0, 1, 1]]), np.full((1, 4), 255, np.uint8))
    failure = compute_shape(recipe(tmp_path, MeshSource(mesh)), "a")
    assert failure.kind == "rejected"
    assert "no area" in failure.reason


def test_a_bug_rejects_a_model_and_is_called_one(tmp_path, monkeypatch):
    monkeypatch.setattr(shape_file, "normalize", None)
    reason = compute_shape(recipe(tmp_path, MeshSource(box_mesh(0))), "a").reason
    assert reason.startswith("TypeError: 'NoneType' object is not callable (shape_file._normalized")
    assert reason.endswith("a bug of ffd_lightning: please report it)")


def test_is_done_takes_whole_files_only(tmp_path):
    made = recipe(tmp_path, BoxSource(1, tmp_path / "log"))
    assert not is_done(made, "b00")
    make(made, "b00")
    assert is_done(made, "b00")
    whole = made.file("b00").read_bytes()
    at = whole.index(b"images.npy") + 200  # within the images
    for broken in (
        b"",
        whole[:100],
        whole[:-1],
        bytes(len(whole)),
        whole[:at] + b"?" + whole[at + 1 :],
    ):
        made.file("b00").write_bytes(broken)
        assert not is_done(made, "b00")
        assert not made.file("b00").exists()
    with zipfile.ZipFile(made.file("b00"), "w") as archive:
        archive.writestr("images.npy", b"")
    assert not is_done(made, "b00"), "not all arrays are in it"
