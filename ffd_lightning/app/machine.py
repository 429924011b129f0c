"""Jobs of a sweep side by side on one machine: threads divided, GPUs taken in turn."""

from __future__ import annotations

import gc
import getpass
import hashlib
import logging
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
from filelock import FileLock, Timeout

from ffd_lightning.parallel import available_cores

log = logging.getLogger(__name__)

_LOOK_EVERY = 1.0  # seconds


def jobs_at_once(launcher: Any) -> int:
    """Return how many jobs Hydra's launcher runs at once on this machine.

    Args:
        launcher: `hydra.launcher` of the configuration; only joblib's has several.
    """
    if "joblib" not in str(launcher.get("_target_", "")):
        return 1
    count = int(launcher.get("n_jobs") or 1)
    # joblib: -1 means a job per core, -2 one less.
    return count if count > 0 else max(1, available_cores() + 1 + count)


@contextmanager
def share_of_cores(jobs: int) -> Iterator[None]:
    """Keep torch and all that follows it to this job's share of the cores."""
    before = torch.get_num_threads()
    if jobs > 1:
        torch.set_num_threads(max(1, available_cores() // jobs))
    try:
        yield
    finally:
        torch.set_num_threads(before)


@contextmanager
def gpu_slot(gpus: list[str], jobs_per_gpu: int, folder: Path | None = None) -> Iterator[int]:
    """Take a GPU that fewer than `jobs_per_gpu` jobs of this user have; wait until there is one.

    The locks are the system's: they are free again however a job ends.

    Args:
        gpus: a name of each visible GPU that is the same for all processes of the machine.
        jobs_per_gpu: how many jobs may share one.
        folder: where the locks are; a folder of the user's by default.

    Yields:
        The index of the GPU.
    """
    folder = folder or Path(tempfile.gettempdir()) / f"ffd_lightning-gpus-{getpass.getuser()}"
    folder.mkdir(parents=True, exist_ok=True)
    # All GPUs get one job before any gets a second.
    slots = [(k, n) for n in range(jobs_per_gpu) for k in range(len(gpus))]
    told = False
    while True:
        for index, number in slots:
            name = hashlib.sha256(gpus[index].encode()).hexdigest()[:16]
            try:
                lock = FileLock(folder / f"{name}-{number}.lock").acquire(timeout=0)
            except Timeout:
                continue
            with lock:
                yield index
            return
        if not told:
            told = True
            log.info(
                "waiting for a free GPU of %d; trainer.jobs_per_gpu=%d would let more jobs share "
                "them",
                len(gpus),
                jobs_per_gpu + 1,
            )
        time.sleep(_LOOK_EVERY)


def visible_gpus() -> list[str]:
    """Return a name of each visible GPU, the same in every process of this machine."""
    count = torch.cuda.device_count()
    return [str(torch.cuda.get_device_properties(k).uuid) for k in range(count)]


def give_memory_back() -> None:
    """Free what a finished job held in cycles and in the GPU's cache."""
    gc.collect()
    if torch.cuda.is_available():
        torch.cuda.empty_cache()
