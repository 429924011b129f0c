import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from box_source import BoxSource, boxes_of, contents, loads, prepare_boxes
from commands import run_command, wait_for

from ffd_lightning.errors import ConfigError, DataError

COUNT = 10
KILLS = 6
LIMIT = 600  # seconds; only ends a test that would hang
SCRIPT = """
import signal
import sys
import threading
from pathlib import Path
sys.path.insert(0, {tests!r})
from box_source import BoxSource, boxes_of
signal.signal(signal.SIGINT, signal.default_int_handler)  # jobs in a shell's background ignore it
gate = Path({gate!r}) if {gate!r} else None
try:
    boxes_of(BoxSource({count}, Path({log!r}), gate=gate), {root!r}).run()
except KeyboardInterrupt:
    sys.exit(130 if threading.active_count() == 1 else "threads are left")
"""


@pytest.fixture
def log(tmp_path):
    """The log of loads; workers named there that a failed test leaves behind are ended."""
    yield tmp_path / "log"
    for pid in loads(tmp_path / "log")[1]:
        if not gone(pid) and b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes():
            os.kill(pid, signal.SIGKILL)


@pytest.fixture
def start(tmp_path, log):
    """Return a function that prepares boxes in another process."""
    processes = []

    def run(gate="", **kwargs):
        tests, root = str(Path(__file__).parent), str(tmp_path)
        script = SCRIPT.format(tests=tests, count=COUNT, gate=str(gate), log=str(log), root=root)
        command = [sys.executable, "-c", script]
        process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **kwargs)
        processes.append(process)
        return process

    yield run
    for process in processes:
        process.kill()
        process.wait()
        process.stderr.close()


def gone(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return True
    return state == "Z"


def partial_files(root):
    return list((root / "prepared").glob(".box-*.partial/*.npz"))


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    root = tmp_path_factory.mktemp("undisturbed")
    return prepare_boxes(BoxSource(COUNT, root / "log"), root, workers=2)


def test_one_worker_gives_the_same_bytes_as_two_and_nothing_is_loaded_again(undisturbed, tmp_path):
    alone = prepare_boxes(BoxSource(COUNT, tmp_path / "log"), tmp_path, workers=1)
    assert contents(alone.path) == contents(undisturbed.path)
    again = prepare_boxes(BoxSource(COUNT, tmp_path / "other log"), tmp_path)
    assert again.path == alone.path
    assert loads(tmp_path / "other log") == ([], set())


@pytest.mark.parametrize("kill", [os.kill, os.killpg], ids=["parent alone", "whole group"])
def test_kill_9_and_resume(undisturbed, tmp_path, start, log, kill):
    # It can finish four shapes and no more.
    process = start(tmp_path / "never", start_new_session=True)
    wait_for(lambda: len(partial_files(tmp_path)) == 4 and len(loads(log)[0]) == 6)
    kill(process.pid, signal.SIGKILL)
    process.wait()
    ids, pids = loads(log)
    wait_for(lambda: all(gone(pid) for pid in pids))

    damaged = sorted(partial_files(tmp_path))
    damaged[0].write_bytes(damaged[0].read_bytes()[:-40])  # cut off
    flipped = bytearray(damaged[1].read_bytes())
    flipped[len(flipped) // 3] ^= 1
    damaged[1].write_bytes(flipped)
    log.unlink()
    resumed = prepare_boxes(BoxSource(COUNT, log), tmp_path)
    assert contents(resumed.path) == contents(undisturbed.path)
    again = loads(log)[0]
    assert len(again) == len(set(again)) == COUNT - 2, "four were done, two of them damaged"
    assert len(set(again) & set(ids[:4])) == 2


def test_kills_at_random_moments(undisturbed, tmp_path, start, log):
    """Starting, making, tidying: whenever a set is done, the next one is begun."""
    rng = random.Random(0)
    target = tmp_path / "prepared" / undisturbed.path.name
    for number in range(KILLS):
        if number % 3 == 0:  # again, as the machine may be busier than it was
            began = time.monotonic()
            assert start().wait(LIMIT) == 0
            whole = time.monotonic() - began
            assert contents(target) == contents(undisturbed.path)
            shutil.rmtree(target)
        process = start(start_new_session=True)
        try:
            process.wait(rng.uniform(0.1, 1) * whole)
        except subprocess.TimeoutExpired:
            rng.choice([os.kill, os.killpg])(process.pid, signal.SIGKILL)
        process.wait()
        if target.exists():
            assert contents(target) == contents(undisturbed.path)
            shutil.rmtree(target)
    wait_for(lambda: all(gone(pid) for pid in loads(log)[1]))
    resumed = prepare_boxes(BoxSource(COUNT, log), tmp_path)
    assert contents(resumed.path) == contents(undisturbed.path)
    left = {path.name for path in target.parent.iterdir()}
    assert left == {target.name, f".{target.name}.lock"}


def test_two_processes_prepare_one_set(undisturbed, tmp_path, start, log):
    gate = tmp_path / "gate"
    first = start(gate)
    wait_for(lambda: loads(log)[0])
    second = start(gate)
    assert "waiting" in second.stderr.readline()
    gate.touch()
    for process in (first, second):
        process.communicate(timeout=LIMIT)
        assert process.returncode == 0
    assert sorted(loads(log)[0]) == list(undisturbed.ids), "each loaded once"
    assert contents(tmp_path / "prepared" / undisturbed.path.name) == contents(undisturbed.path)


def test_ctrl_c_ends_the_workers_and_says_how_to_resume(undisturbed, tmp_path, start, log):
    process = start(tmp_path / "never", start_new_session=True)
    wait_for(lambda: len(loads(log)[0]) == 6)  # both workers are stuck in a shape
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to parent and workers
    _, errors = process.communicate(timeout=LIMIT)
    assert process.returncode == 130
    assert "the same command resumes" in errors
    assert "Traceback" not in errors
    assert all(gone(pid) for pid in loads(log)[1])
    assert len(partial_files(tmp_path)) == 4


def test_shapes_are_left_out_by_their_ids(tmp_path):
    source = BoxSource(4, tmp_path / "log")
    usual = boxes_of(source, tmp_path)
    assert "leave_out" not in usual.settings["source"]
    left = boxes_of(source, tmp_path, leave_out=["box/b02", "b01"], limit=2)
    assert left.shape_ids == ["b00", "b03"]
    assert left.settings["source"] == {"version": 0, "limit": 2, "leave_out": ["b01", "b02"]}
    assert left.target != usual.target
    other = boxes_of(source, tmp_path, leave_out=["box/b02"], category="crate")
    assert other.settings["source"] == {"version": 0}, "of another category"
    for name in ("bo3", "box/bo3"):
        with pytest.raises(ConfigError, match=rf"no shape '{name}' of box\. Did you mean b03\?"):
            boxes_of(source, tmp_path, leave_out=[name]).run()


def test_bad_shapes_are_rejected_by_name(undisturbed, tmp_path, capfd):
    faults = {"b01": "reject", "b02": "raise", "b04": "exit", "b05": "damaged", "b07": "memory"}
    found = prepare_boxes(BoxSource(COUNT, tmp_path / "log", faults), tmp_path)
    assert {i: re.sub(r":\d+\)$", ")", why) for i, why in found.rejected.items()} == {
        "b01": "it is no box",
        "b02": "ZeroDivisionError: bad box (box_source.py)",
        "b04": "its worker process died (out of memory?)",
        "b05": "OSError: box.png is no picture (box_source.py)",
        "b07": "MemoryError: (box_source.py)",
    }
    assert found.ids == tuple(i for i in undisturbed.ids if i not in faults)
    for row, shape_id in enumerate(found.ids):
        same = undisturbed.file(undisturbed.index(shape_id))
        assert found.file(row).read_bytes() == same.read_bytes()
    summary, picture = capfd.readouterr().err.splitlines()[-2:]
    assert f"prepared {COUNT - 5} shapes" in summary
    assert "rejected 5 (b01: it is no box" in summary
    assert picture.endswith(f"{tmp_path}/sheets/{found.path.name}.png")


def test_without_any_shape_there_is_no_set(tmp_path):
    faults = {"b00": "reject", "b01": "raise"}
    with pytest.raises(DataError, match=r"all 2 are rejected \(b00: it is no box; b01: Zero"):
        prepare_boxes(BoxSource(2, tmp_path / "log", faults), tmp_path, workers=1)
    with pytest.raises(DataError, match="no usable shape of box: there are none"):
        prepare_boxes(BoxSource(0, tmp_path / "log", version=1), tmp_path)
    with pytest.raises(ConfigError, match="fingerprint of BoxSource must be JSON-able"):
        prepare_boxes(BoxSource(2, tmp_path / "log", version=Path("x")), tmp_path)
    broken = BoxSource(2, tmp_path / "log", {"b00": "no source"}, version=2)
    with pytest.raises(DataError, match="the archive is damaged"):
        prepare_boxes(broken, tmp_path, workers=1)
    assert len(prepare_boxes(BoxSource(2, tmp_path / "log"), tmp_path, workers=1)) == 2


def test_shapes_that_take_too_long_make_a_set_of_that_timeout(undisturbed, tmp_path, log):
    """Whether Python runs, and is interrupted, or a library that does not return."""
    faults = {"b01": "sleep", "b02": "hang", "b03": "swallow"}
    # A box takes a hundredth of a second.
    found = prepare_boxes(BoxSource(5, log, faults), tmp_path, timeout=3.0)
    assert found.ids == ("b00", "b04")
    reason = "it takes longer than preparation.timeout=3 seconds"
    assert found.rejected == dict.fromkeys(faults, reason)
    assert found.manifests[0]["settings"]["timeout"] == 3.0
    log.unlink()
    assert prepare_boxes(BoxSource(5, log), tmp_path, timeout=3).path == found.path
    assert loads(log)[0] == [], "the very same set is not made again"
    patient = prepare_boxes(BoxSource(5, log), tmp_path, timeout=60.0)
    assert patient.ids == undisturbed.ids[:5]
    assert patient.path != found.path
    assert "timeout" not in patient.manifests[0]["settings"]
    assert prepare_boxes(BoxSource(5, log), tmp_path, timeout=3.0).path == patient.path


def test_what_cannot_be_read_now_makes_no_set(undisturbed, tmp_path, log):
    faults = {"b01": "unread", "b05": "reject"}
    with pytest.raises(DataError, match=r"1 of 10 shapes of box could not .*\(b01: .*No such"):
        prepare_boxes(BoxSource(COUNT, log, faults), tmp_path)
    log.unlink()
    mended = prepare_boxes(BoxSource(COUNT, log), tmp_path)
    assert contents(mended.path) == contents(undisturbed.path)
    assert sorted(loads(log)[0]) == ["b01", "b05"], "what failed is tried again, and nothing else"


@pytest.mark.parametrize("limit", [2000, 6000], ids=["a shape", "the manifest"])
def test_full_disk(tmp_path, start, log, limit):
    """A limit on the size of files stands in for a full disk: writing fails half-way."""
    process = start(preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    _, errors = process.communicate(timeout=LIMIT)
    assert process.returncode == 1
    assert "DataError: cannot prepare" in errors
    assert not list((tmp_path / "prepared").glob("box-*"))
    assert len(prepare_boxes(BoxSource(COUNT, tmp_path / "log"), tmp_path)) == COUNT


def test_a_script_without_the_guard_ends_and_says_so(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from pathlib import Path\n"
        "from box_source import BoxSource, prepare_boxes\n"
        "here = Path(__file__).parent\n"
        "prepare_boxes(BoxSource(2, here / 'log'), here)\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    command = [sys.executable, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=LIMIT)
    assert done.returncode == 1
    assert 'data is prepared outside of `if __name__ == "__main__":`' in done.stderr
    assert "worker processes end as soon as they start" in done.stderr


def test_a_category_that_fails_does_not_stop_the_others(tmp_path):
    shapes = ["data.num_models=4", "data.num_points=64", "preparation.workers=1"]
    views = [f"data.render.{setting}" for setting in ("height=32", "width=32", "samples=1")]
    overrides = ["-m", *shapes, *views, f"paths.data={tmp_path}/data", "category=rifle,lamp"]
    done = run_command("prepare", *overrides, cwd=tmp_path)
    assert done.returncode == 1
    assert "error: no procedural shapes of 'rifle'" in done.stderr
    assert "prepared 4 shapes" in done.stderr
    assert "Traceback" not in done.stderr
