import threading
import time

import pytest
import torch
from filelock import FileLock
from omegaconf import OmegaConf

from ffd_lightning.app import machine
from ffd_lightning.app.machine import gpu_slot, jobs_at_once, share_of_cores
from ffd_lightning.parallel import available_cores


@pytest.mark.parametrize(
    ("launcher", "expected"),
    [
        ({"_target_": "hydra._internal.core_plugins.basic_launcher.BasicLauncher"}, 1),
        ({"_target_": "hydra_plugins.hydra_joblib_launcher.JoblibLauncher", "n_jobs": 3}, 3),
        ({"_target_": "hydra_plugins.hydra_joblib_launcher.JoblibLauncher", "n_jobs": None}, 1),
        ({"_target_": "hydra_plugins.hydra_joblib_launcher.JoblibLauncher", "n_jobs": -1}, "all"),
        ({"_target_": "hydra_plugins.hydra_submitit_launcher.LocalLauncher"}, 1),
        ({}, 1),
    ],
)
def test_jobs_at_once(launcher, expected):
    expected = available_cores() if expected == "all" else expected
    assert jobs_at_once(OmegaConf.create(launcher)) == expected


def test_threads_are_divided_and_given_back():
    before = torch.get_num_threads()
    with share_of_cores(4 * available_cores()):
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == before
    with share_of_cores(1):
        assert torch.get_num_threads() == before


def test_each_job_gets_a_gpu_of_its_own_before_any_is_shared(tmp_path):
    gpus = ["GPU-a", "GPU-b"]
    with (
        gpu_slot(gpus, 2, tmp_path) as first,
        gpu_slot(gpus, 2, tmp_path) as second,
        gpu_slot(gpus, 2, tmp_path) as third,
    ):
        assert [first, second, third] == [0, 1, 0]
    with gpu_slot(gpus, 2, tmp_path) as again:
        assert again == 0


def test_a_gpu_is_free_as_soon_as_its_job_ends(tmp_path, monkeypatch):
    kept = []  # a lock that is collected frees its file too
    monkeypatch.setattr(machine, "FileLock", lambda file: kept.append(FileLock(file)) or kept[-1])
    for _ in range(2):
        with gpu_slot(["GPU-a", "GPU-b"], 1, tmp_path) as index:
            assert index == 0


def test_gpus_are_known_by_name_not_by_place(tmp_path):
    """Processes may see other GPUs in another order."""
    with gpu_slot(["GPU-a", "GPU-b"], 1, tmp_path), gpu_slot(["GPU-b", "GPU-a"], 1, tmp_path) as k:
        assert k == 0


def test_a_job_waits_until_one_is_free(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(machine, "_LOOK_EVERY", 0.01)
    caplog.set_level("INFO")
    taken = []

    def job():
        with gpu_slot(["GPU-a"], 1, tmp_path) as index:
            taken.append(index)

    with gpu_slot(["GPU-a"], 1, tmp_path):
        thread = threading.Thread(target=job)
        thread.start()
        end = time.monotonic() + 120
        while "waiting" not in caplog.text:
            assert time.monotonic() < end
            time.sleep(0.01)
        assert not taken
    thread.join(120)
    assert taken == [0]
    assert "trainer.jobs_per_gpu=2" in caplog.text
