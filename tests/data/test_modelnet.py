"""Miniature ModelNet trees in every layout, and OFF files in every spelling."""

import itertools
import pickle
import zipfile

import numpy as np
import pytest
from shapenet_tree import write_folder

from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.data.sources.base import Source
from ffd_lightning.data.sources.modelnet import ModelNetSource
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.errors import DataError, RejectedShapeError
from ffd_lightning.imaging.render_settings import RenderSettings

IDS = ["chair_0001", "chair_0002", "chair_0003"]


def chair(index):
    return ProceduralSource(4).load("chair", f"chair-{index:06d}").mesh


def off_text(mesh, header="OFF\n"):
    """An OFF of a mesh that is y up, written z up as ModelNet's are."""
    x, y, z = mesh.vertices.T
    rows = [f"{header}{len(mesh.vertices)} {len(mesh.faces)} 0"]
    rows += [f"{a:.9f} {b:.9f} {c:.9f}" for a, b, c in np.stack([x, -z, y], 1)]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    return "\n".join(rows) + "\n"


def models():
    """Return {path: content}: three good chairs, a bad one, a plane, and what does not count."""
    files = {
        "chair/train/chair_0001.off": off_text(chair(0)).encode(),
        "chair/train/chair_0002.off": off_text(chair(1), "OFF").encode(),
        "chair/test/chair_0003.off": off_text(chair(2)).encode(),
        "chair/test/chair_0004.off": off_text(chair(3))[:-300].encode(),
        "airplane/train/airplane_0001.off": off_text(chair(1)).encode(),
        "night_stand/test/night_stand_0201.OFF": off_text(chair(1)).encode(),
    }
    no_models = ["README.txt", ".DS_Store", "chair/.DS_Store", "chair/train/.DS_Store"]
    no_models += ["chair/train/._chair_0001.off", "chair/train/notes.txt", "chair/stray.off"]
    no_models += ["empty/train/readme.txt", ".git/train/a.off"]
    return files | dict.fromkeys(no_models, b"?")


def zipped(place, prefix, files):
    place.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(place, "w", zipfile.ZIP_DEFLATED) as archive:
        for path, content in files.items():
            archive.writestr(f"{prefix}{path}", content)
            archive.writestr("__MACOSX/" + "/._".join(f"{prefix}{path}".rsplit("/", 1)), b"?")
    return place


LAYOUTS = {
    "root itself": lambda root, files: write_folder(root, files),
    "ModelNet40": lambda root, files: write_folder(root / "ModelNet40", files).parent,
    "aligned": lambda root, files: write_folder(root / "modelnet40_aligned", files).parent,
    "zip": lambda root, files: zipped(root / "ModelNet10.zip", "ModelNet10/", files).parent,
    "zip named": lambda root, files: zipped(root / "any.zip", "ModelNet40/", files),
    "zip aligned": lambda root, files: zipped(root / "modelnet40_x.zip", "", files).parent,
}


@pytest.fixture(params=LAYOUTS)
def tree(request, tmp_path):
    return ModelNetSource(LAYOUTS[request.param](tmp_path / "data", models()))


def test_models_come_through_in_the_projects_frame(tree):
    assert isinstance(tree, Source)
    assert tree.categories() == ["chair", "night_stand", "plane"]
    assert tree.shape_ids("chair") == [*IDS, "chair_0004"]
    assert tree.shape_ids("plane") == tree.shape_ids("airplane") == ["airplane_0001"]
    assert tree.shape_ids("night_stand") == ["night_stand_0201"]
    for k, name in enumerate(IDS):
        mesh, expected = tree.load("chair", name).mesh, chair(k)
        np.testing.assert_allclose(
            mesh.vertices[mesh.faces], expected.vertices[expected.faces], atol=1e-8
        )
    assert tree.split("chair") == dict(
        zip([*IDS, "chair_0004"], ["train", "train", "test", "test"], strict=True)
    )
    with pytest.raises(RejectedShapeError, match=r"^chair_0004\.off is incomplete: it has .* of"):
        tree.load("chair", "chair_0004")
    with pytest.raises(RejectedShapeError, match="no shape 'chair_9'"):
        tree.load("chair", "chair_9")
    copy = pickle.loads(pickle.dumps(tree))
    assert len(pickle.dumps(tree)) < 1000
    assert len(copy.load("chair", IDS[0]).mesh.faces) == len(chair(0).faces)


def test_survey_tells_form_split_and_empty_files(tmp_path):
    files = models() | {"chair/test/chair_0004.off": b""}
    folders = ModelNetSource(write_folder(tmp_path / "a", files))
    archive = ModelNetSource(zipped(tmp_path / "b.zip", "ModelNet40/", files))
    assert (folders.survey("chair").layout, archive.survey("chair").layout) == (
        "folders",
        "zip archive",
    )
    for source in (folders, archive):
        assert source.survey("chair").faults == {"chair_0004": "its file is empty"}
        assert source.survey("chair").notes == ("2 to train on, 2 to test on",)


def test_fingerprint_follows_files_and_turns_and_not_the_place(tmp_path):
    files = models()
    seen = [
        ModelNetSource(make(tmp_path / str(k), files)).fingerprint("chair")
        for k, make in enumerate(LAYOUTS.values())
    ]
    assert seen.count(seen[0]) == len(seen)
    root = tmp_path / "0"
    others = [ModelNetSource(root, up="y"), ModelNetSource(root, yaw=90.0)]
    seen = [seen[0], *(source.fingerprint("chair") for source in others)]
    (root / "airplane/train/airplane_0001.off").write_bytes(b"changed")
    assert ModelNetSource(root).fingerprint("chair") == seen[0]
    (root / "chair/train/chair_0001.off").write_bytes(b"changed")
    seen.append(ModelNetSource(root).fingerprint("chair"))
    (root / "chair/train/chair_0001.off").unlink()
    seen.append(ModelNetSource(root).fingerprint("chair"))
    assert all(seen.count(one) == 1 for one in seen)


def test_turns_are_made(tmp_path):
    root = write_folder(tmp_path, {"chair/train/a.off": off_text(chair(0)).encode()})
    mesh, expected = ModelNetSource(root, up="y").load("chair", "a").mesh, chair(0)
    x, y, z = expected.vertices[expected.faces].transpose(2, 0, 1)
    np.testing.assert_allclose(mesh.vertices[mesh.faces], np.stack([x, -z, y], -1), atol=1e-8)
    mesh = ModelNetSource(root, yaw=-90).load("chair", "a").mesh  # clockwise: -z to +x
    np.testing.assert_allclose(mesh.vertices[mesh.faces], np.stack([-z, y, x], -1), atol=1e-8)


def test_what_is_missing_or_unclear_is_said(tmp_path):
    with pytest.raises(DataError, match=r"nowhere is not ModelNet.*set data\.root"):
        ModelNetSource(tmp_path / "nowhere").categories()
    (tmp_path / "modelnet40_manually_aligned.tar").touch()
    with pytest.raises(DataError, match=r"or unpack modelnet40_manually_aligned\.tar"):
        ModelNetSource(tmp_path).shape_ids("chair")
    (tmp_path / "ModelNet40.zip").write_bytes(b"PK\x03\x04 cut off")
    with pytest.raises(DataError, match=r"ModelNet40\.zip is damaged or incomplete"):
        ModelNetSource(tmp_path).shape_ids("chair")
    write_folder(tmp_path / "ModelNet40", models())
    with pytest.raises(DataError, match="has no sofa; it has: chair, night_stand, plane"):
        ModelNetSource(tmp_path).shape_ids("sofa")
    for name in ("a", "b"):
        write_folder(tmp_path / "two" / name, models())
    with pytest.raises(DataError, match=r"more than one data set: .*/two/a, .*/two/b"):
        ModelNetSource(tmp_path / "two").shape_ids("chair")
    (tmp_path / "none" / "chair" / "train").mkdir(parents=True)
    with pytest.raises(DataError, match=r"holds no <category>/train/\*\.off"):
        ModelNetSource(tmp_path / "none").shape_ids("chair")
    write_folder(tmp_path / "twice", {f"chair/{side}/1.off": b"?" for side in ("train", "test")})
    with pytest.raises(DataError, match="has 1 of chair twice, in train and in test"):
        ModelNetSource(tmp_path / "twice").shape_ids("chair")


def test_preparation(tmp_path):
    source = ModelNetSource(zipped(tmp_path / "ModelNet40.zip", "ModelNet40/", models()).parent)
    view = RenderSettings(height=48, width=64, samples=1)
    prepared = Preparation(source, "chair", 32, view, tmp_path, workers=1, progress=False).run()
    assert list(prepared.ids) == IDS
    assert prepared.manifest["rejected"] == 1


# --- OFF ----------------------------------------------------------------------------------------

CORNERS = ["0 0 0", "2 0 0.5", "3 1 0", "1 2 0", "-1.5e0 1 0", "0 0 1"]
POLYGONS = ["5 0 1 2 3 4", "3 0 1 5", "4 1 2 3 5"]
COUNTS = "6 3 0"


def spelled(head, counts=COUNTS, corner="{}", polygon="{}", end="\n", between="", last="\n"):
    rows = [corner.format(c) for c in CORNERS] + [polygon.format(p) for p in POLYGONS]
    return (head + counts + end + (end + between).join(rows) + last).encode()


def fans(data):
    """Read an OFF trivially: (F, 3, 3) corners of its triangles."""
    lines = [line.split("#")[0].strip() for line in data.decode().splitlines()]
    tokens = [line.split() for line in lines if line]
    if "OFF" in tokens[0][0] and tokens[0][0][-1] == "F" and len(tokens[0]) == 1:
        tokens = tokens[1:]
    else:
        tokens[0] = " ".join(tokens[0]).split("OFF")[1].split()
    num_vertices, num_faces = (int(n) for n in tokens[0][:2])
    at = [[float(n) for n in t[:3]] for t in tokens[1 : 1 + num_vertices]]
    result = []
    for t in tokens[1 + num_vertices : 1 + num_vertices + num_faces]:
        face = [at[int(i)] for i in t[1 : 1 + int(t[0])]]
        result += [[face[0], b, c] for b, c in itertools.pairwise(face[1:])]
    return np.array(result)


SPELLINGS = {
    "plain": spelled("OFF\n"),
    "run in": spelled("OFF"),
    "run in, no edges": spelled("OFF", "6 3"),
    "comments": spelled("# written as OFF by x\nOFF # yes\n# 1 2 3\n", between="# no\n"),
    "Windows": spelled("OFF\r\n", end="\r\n", last="\r\n"),
    "Latin-1": b"OFF\n# st\xfchle\n" + spelled(""),
    "NOFF": spelled("NOFF\n", corner="{} 0 0 1"),
    "CNOFF": spelled("CNOFF ", corner="{} 255 0 0 255 0 0 1"),
    "face colours": spelled("OFF\n", polygon="{} 255 0 9"),
}


@pytest.mark.parametrize("name", SPELLINGS)
def test_every_spelling_of_off_is_read_right(tmp_path, name):
    data = SPELLINGS[name]
    path = tmp_path / "chair_0001.off"
    path.write_bytes(data)
    mesh = read_mesh(path)
    expected = fans(spelled("OFF\n"))
    assert expected.shape == (6, 3, 3)
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], expected)
    if name != "Latin-1":  # the trivial reader knows UTF-8 only
        np.testing.assert_array_equal(fans(data), expected)


def test_counts_may_be_spread(tmp_path):
    (tmp_path / "a.off").write_bytes(spelled("OFF\n", "6\n3\n").replace(b"\n\n", b"\n"))
    mesh = read_mesh(tmp_path / "a.off")
    np.testing.assert_array_equal(mesh.vertices[mesh.faces], fans(spelled("OFF\n")))


@pytest.mark.parametrize("name", ["plain", "NOFF"])
def test_a_truncated_file_is_rejected_by_name(tmp_path, name):
    path, lines = tmp_path / "chair_0001.off", SPELLINGS[name].splitlines(keepends=True)
    for count in range(1, len(lines)):
        path.write_bytes(b"".join(lines[:count]))
        with pytest.raises(RejectedShapeError, match=r"^chair_0001\.off (is incomplete|does not)"):
            read_mesh(path)


BAD_OFF = {
    "half a face": (SPELLINGS["plain"][:-3], "a vertex or a face lacks numbers"),
    "binary": (b"OFF BINARY\n" + bytes(range(200)), "kind of OFF"),
    "no header": (spelled(""), "kind of OFF"),
    "negative": (spelled("OFF\n", "-6 3 0"), "does not say how many"),
    "no number": (spelled("OFF\n").replace(b"2 0 0.5", b"2 0 x"), "cannot be read"),
    "promises": (b"OFF\n99999999999999999999 9 0\n0 0 0\n", "has 1 of 99,999"),
}


@pytest.mark.parametrize("name", BAD_OFF)
def test_a_bad_file_is_rejected_by_name(tmp_path, name):
    data, reason = BAD_OFF[name]
    (tmp_path / "chair_0001.off").write_bytes(data)
    with pytest.raises(RejectedShapeError, match=rf"^chair_0001\.off .*{reason}"):
        read_mesh(tmp_path / "chair_0001.off")
