import threading

from ffd_lightning.app import gpus
from ffd_lightning.app.gpus import gpu_slot


def test_each_job_gets_a_gpu_of_its_own_before_any_is_shared(tmp_path):
    names = ["GPU-a", "GPU-b"]
    with (
        gpu_slot(names, 2, tmp_path) as first,
        gpu_slot(names, 2, tmp_path) as second,
        gpu_slot(names, 2, tmp_path) as third,
    ):
        assert [first, second, third] == [0, 1, 0]
    # Processes may see other GPUs in another order.
    with gpu_slot(["GPU-a", "GPU-b"], 1, tmp_path), gpu_slot(["GPU-b", "GPU-a"], 1, tmp_path) as k:
        assert k == 0


def test_a_job_waits_until_one_is_free(tmp_path, monkeypatch, caplog):
    caplog.set_level("INFO")
    waits, free = threading.Event(), threading.Event()

    def wait(_):
        waits.set()
        free.wait(60)

    monkeypatch.setattr(gpus.time, "sleep", wait)
    taken = []

    def job():
        with gpu_slot(["GPU-a"], 1, tmp_path) as index:
            taken.append(index)

    thread = threading.Thread(target=job)
    with gpu_slot(["GPU-a"], 1, tmp_path):
        thread.start()
        assert waits.wait(60)
        assert not taken
    free.set()
    thread.join(60)
    assert taken == [0]
    assert "trainer.jobs_per_gpu=2" in caplog.text
