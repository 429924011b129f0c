import pickle

from trees import TEXTURED, png, write_folder

from ffd_lightning.data.sources.mesh_files import MeshFiles, name_files


def test_materials_are_found_beside_a_file_and_decide_what_is_prepared(tmp_path):
    files = {"a.obj": TEXTURED, "m.mtl": "newmtl m\nmap_Kd maps/wood.png\n"}
    write_folder(tmp_path, {**files, "maps/wood.png": png((200, 30, 30)), "far/away/x.png": ""})
    source = MeshFiles(name_files([tmp_path / "a.obj"]), yaw=180)
    shape = pickle.loads(pickle.dumps(source)).load("any", "a")
    assert shape.mesh.textures[0][0, 0].tolist() == [200, 30, 30, 255]
    assert shape.mesh.vertices.min(axis=0).tolist() == [-1, 0, 0]
    write_folder(tmp_path, {"b/b.obj": TEXTURED, "b/m.mtl": "newmtl m\nKd 1 1 1\n"})
    white = MeshFiles({"b": tmp_path / "b/b.obj"}).load("any", "b")
    assert white.mesh.face_colors.tolist() == [[178, 178, 178, 255]], "to be seen on white"
    before = source.fingerprint("any")
    write_folder(tmp_path, {"far/away/x.png": "of no shape", "log.txt": "what is printed"})
    assert source.fingerprint("any") == before
    write_folder(tmp_path, {"maps/wood.png": png((30, 200, 30), (4, 4))})
    assert source.fingerprint("any") != before
