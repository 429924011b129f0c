"""Damaged and hostile files: each gives a valid mesh or is rejected, and nothing else happens.

`FUZZ_EXAMPLES=5000 pytest tests/data/test_fuzz.py` looks for new trouble at random.
"""

import contextlib
import copy
import json
import os
import re
import resource
import signal
import subprocess
import sys
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from hostile_files import DANGERS
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from PIL import Image
from whole_files import WHOLE, Case, png, read

from ffd_lightning.data.sources.r2n2 import R2n2Images
from ffd_lightning.errors import RejectedShapeError

EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "0"))
SECONDS, MEGABYTES = 10, 400  # that one small file may take; of the processor's time
LIBRARIES = tuple(
    {os.path.realpath(p) for p in (sys.prefix, sys.base_prefix, sysconfig.get_path("stdlib"))}
    | {str(Path(__file__).parents[2] / "ffd_lightning")}
)
FORBIDDEN = ("socket.", "subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.fork")
FORBIDDEN += ("os.mkdir", "os.remove", "os.rename", "os.rmdir", "os.link", "os.symlink", "shutil.")
FORBIDDEN += ("os.truncate", "os.chmod", "tempfile.", "urllib.", "ctypes.dlopen", "pickle.")


def fuzz(examples):
    return settings(
        max_examples=EXAMPLES or examples,
        derandomize=not EXAMPLES,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )


# --- what must not happen ---


class Guard:
    """Records what code does that a reader of shapes has no business to do.

    It records instead of raising: trimesh swallows exceptions of all kinds.
    """

    def __init__(self):
        self.active, self.folder, self.seen = False, None, []
        sys.addaudithook(self._audit)

    def _audit(self, event, args):
        if not self.active:
            return
        if event == "open":
            path, mode, flags = args
            path = os.path.realpath(os.fsdecode(path)) if not isinstance(path, int) else str(path)
            library = path.startswith(LIBRARIES)
            writes = any(c in (mode or "") for c in "wax+") or flags & (os.O_WRONLY | os.O_RDWR)
            known = library or (self.folder is not None and path.startswith(str(self.folder)))
            if not known or (writes and not (library and "__pycache__" in path)):
                self.seen.append(f"{'wrote' if writes else 'read'} {path}")
        elif event.startswith(FORBIDDEN):
            self.seen.append(f"{event} {args!r:.200}")

    def _late(self, *_):
        self.seen.append("took too long")
        raise KeyboardInterrupt

    @contextlib.contextmanager
    def watching(self, folder=None, seconds=SECONDS):
        self.folder, self.seen = folder, []
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        before = signal.signal(signal.SIGPROF, self._late)
        signal.setitimer(signal.ITIMER_PROF, seconds)
        self.active = True
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            self.active = False
            signal.signal(signal.SIGPROF, before)
            grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak) / 1024
            assert not self.seen
            assert grown < MEGABYTES, f"took {grown:.0f} MB"


@pytest.fixture(scope="module")
def guard(tmp_path_factory):
    """A guard, in an empty folder that must stay empty."""
    empty = tmp_path_factory.mktemp("empty")
    with contextlib.chdir(empty):
        for case in WHOLE.values():
            read(case)  # what is imported late is imported now
        Image.init()
        yield Guard()
        assert list(empty.iterdir()) == []


DEEDS = {
    "read": lambda: Path("/etc/hostname").read_bytes(),
    "subprocess.Popen": lambda: subprocess.run(["true"], check=True),
}


@pytest.mark.parametrize("name", DEEDS)
def test_the_guard_sees_it(guard, name):
    with pytest.raises(AssertionError, match=name), guard.watching():
        DEEDS[name]()


def assert_valid(mesh):
    count = len(mesh.faces)
    assert count > 0
    assert mesh.vertices.dtype == np.float64
    assert mesh.vertices.shape == (len(mesh.vertices), 3)
    assert np.isfinite(mesh.vertices).all()
    assert (mesh.faces.dtype, mesh.faces.shape) == (np.int64, (count, 3))
    assert mesh.faces.min() >= 0
    assert mesh.faces.max() < len(mesh.vertices)
    assert (mesh.face_colors.dtype, mesh.face_colors.shape) == (np.uint8, (count, 4))
    assert (mesh.face_textures is None) == (mesh.face_uvs is None) == (mesh.textures == ())
    if mesh.face_textures is not None:
        assert (mesh.face_textures.dtype, mesh.face_textures.shape) == (np.int16, (count,))
        assert mesh.face_textures.min() >= -1
        assert mesh.face_textures.max() < len(mesh.textures)
        assert (mesh.face_uvs.dtype, mesh.face_uvs.shape) == (np.float32, (count, 3, 2))
        assert np.isfinite(mesh.face_uvs).all()
    for texture in mesh.textures:
        assert texture.dtype == np.uint8
        assert texture.shape == (*texture.shape[:2], 4)
        assert 0 < texture.size <= 4 * 1024**2


def survives(guard, case):
    """Read a case; whatever it is, it must be a mesh or a rejection with a plain reason."""
    with guard.watching():
        try:
            outcome = read(case)
        except RejectedShapeError as error:
            outcome = str(error)
    if isinstance(outcome, str):
        assert outcome
        assert "\n" not in outcome
        return None
    assert_valid(outcome)
    return outcome


# --- damage ---

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
NUMBERS = b"-1 0 255 60000 4000000000 -99999999999 nan inf -inf 1e400 1e38 1e-320 0.5".split()
NUMBERS += [b"1" + b"0" * 30, b"9" * 5000]
JUNK = [b"\xff" * 4, bytes(4), b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f", b"\xff\xfe", b"\n", b"\r"]
JUNK += [b" ", b"/", b"#", b"\\\n", b"f -1 -2\n", b"v 1\n", b"v 1 2 3 4 5 6 7\n", b"usemtl \n"]
JUNK += [b"mtllib m.mtl\n", b"newmtl \n", b"Kd nan 1e400 -3\n", b"map_Kd m.obj\n", b"vt 1\n"]
JUNK += [b"image x\n", b"name\n", b"d nan\n", b"Tr x\n", b"solid\n", b"endsolid\n", b'"', b"}"]
VALUES = [None, True, -1, 0, 3, 0.5, 1e12, float("inf"), float("nan"), 10**30, "", [], {}, [0]]
VALUES += [[[]], 5121, 5125, "SCALAR", "MAT4", "file:///etc/passwd", "http://x.org/a.bin"]

spots = st.integers(0, 2**16)
edits = st.tuples(
    st.sampled_from(["flip", "cut", "drop", "repeat", "insert", "number", "number"]),
    spots,
    st.integers(1, 60),
    st.one_of(st.sampled_from(JUNK), st.binary(min_size=1, max_size=8)),
    st.sampled_from(NUMBERS),
)


def damaged(data, edit):
    kind, spot, length, junk, number = edit
    start = spot % (len(data) + 1)
    span = data[start : start + length]
    if kind == "number":
        match = NUMBER.search(data, start)
        return data if match is None else data[: match.start()] + number + data[match.end() :]
    middle = {"flip": junk[: len(span)], "cut": b"", "drop": b"", "repeat": span * 3}
    rest = {"flip": start + len(junk), "cut": len(data), "insert": start}.get(kind, start + length)
    return data[:start] + middle.get(kind, junk) + data[rest:]


@st.composite
def damaged_files(draw, name, target=None):
    case = WHOLE[name]
    data = case.files[target or case.mesh]
    for edit in draw(st.lists(edits, min_size=1, max_size=4)):
        data = damaged(data, edit)
    return Case(case.mesh, case.files | {target or case.mesh: data})


def places(tree):
    """Yield every place in a JSON tree as its container and key."""
    for key, value in tree.items() if isinstance(tree, dict) else enumerate(tree):
        yield tree, key
        if isinstance(value, dict | list):
            yield from places(value)


@st.composite
def damaged_trees(draw):
    case = WHOLE["gltf"]
    tree = json.loads(case.files[case.mesh])
    for _ in range(draw(st.integers(1, 3))):
        found = list(places(tree))
        container, key = found[draw(spots) % len(found)]
        if draw(st.booleans()):
            container[key] = copy.deepcopy(draw(st.sampled_from(VALUES)))
        elif isinstance(container, dict):
            del container[key]
        else:
            container.extend([container[key]] * draw(st.sampled_from([1, 500])))
    return Case(case.mesh, case.files | {case.mesh: json.dumps(tree).encode()})


def with_dangers(test):
    for name, (make, _) in DANGERS.items():
        if name != "many materials":  # takes long, and is read below
            test = example(make())(test)
    return test


@pytest.mark.parametrize("name", WHOLE)
def test_undamaged_files_are_read(guard, name):
    mesh = survives(guard, WHOLE[name])
    assert mesh is not None
    assert (mesh.textures != ()) == name.startswith(("obj", "gl"))


@pytest.mark.parametrize("name", [name for name in WHOLE if "x." not in name])
def test_damaged_files_are_read_or_rejected(guard, name):
    @fuzz(80)
    @given(damaged_files(name))
    def run(case):
        survives(guard, case)

    run()


@with_dangers
@fuzz(150)
@given(case=damaged_trees())
def test_damaged_scenes_and_hostile_files_are_read_or_rejected(guard, case):
    survives(guard, case)


@pytest.mark.parametrize("target", ["m.mtl", *(f"x.{e}" for e in ("png", "jpg", "tga"))])
def test_damaged_materials_and_textures_do_not_reject_a_model(guard, target):
    name = "obj" if target == "m.mtl" else f"obj {target}"

    @fuzz(60)
    @given(damaged_files(name, target))
    def run(case):
        mesh = survives(guard, case)
        assert mesh is not None
        assert len(mesh.faces) == len(read(WHOLE["obj"]).faces)

    run()


def test_damaged_renderings_are_read_or_rejected(guard, tmp_path):
    folder = tmp_path / "ShapeNetRendering" / "03001627" / "a" / "rendering"
    folder.mkdir(parents=True)
    for view in range(24):
        (folder / f"{view:02d}.png").write_bytes(png(9, 7))
    source = R2n2Images(tmp_path, 12, 16)

    @fuzz(60)
    @example(png(60000, 60000, data=b"x"))
    @example(png(8000, 8000))
    @given(st.lists(edits, min_size=1, max_size=3))
    def run(changes):
        data = png(9, 7) if isinstance(changes, list) else changes
        for edit in changes if isinstance(changes, list) else []:
            data = damaged(data, edit)
        (folder / "00.png").write_bytes(data)
        with guard.watching(tmp_path):
            try:
                outcome = source.read("chair", "a")
            except RejectedShapeError as error:
                outcome = str(error)
        if isinstance(outcome, str):
            assert "rendering/00.png" in outcome
        else:
            assert (outcome.shape, outcome.dtype) == ((24, 12, 16, 4), np.uint8)

    run()


# --- files made to do harm, in a process that may take one gigabyte more than it has ---


@pytest.fixture(scope="module")
def report():
    script, root = Path(__file__).with_name("hostile_files.py"), Path(__file__).parents[2]
    environment = os.environ | {"PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, env=environment, timeout=300
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("name", DANGERS)
def test_hostile_files_take_little_time_and_memory(report, name):
    expected = DANGERS[name][1]
    outcome, seconds, megabytes = report[name]
    if isinstance(expected, int):
        assert outcome == expected
    else:
        assert re.search(expected, outcome)
        assert "MemoryError" not in outcome
    assert seconds < SECONDS / 4
    assert megabytes < MEGABYTES
