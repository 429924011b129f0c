"""Jobs of a sweep side by side on one machine take its GPUs in turn."""

import hashlib
import logging
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import torch
from filelock import FileLock, Timeout

log = logging.getLogger(__name__)

_LOOK_EVERY = 1.0  # seconds


@contextmanager
def gpu_slot(gpus: list[str], jobs_per_gpu: int, folder: Path | None = None) -> Iterator[int]:
    """Yield the index of a GPU that fewer than `jobs_per_gpu` jobs of this user have, or wait.

    The locks are the system's: they are free again however a job ends.

    Args:
        gpus: `visible_gpus`.
        jobs_per_gpu: how many jobs may share one.
        folder: where the locks are; a folder of the user's by default.
    """
    folder = folder or Path(tempfile.gettempdir()) / f"ffd_lightning-gpus-{os.getuid()}"
    folder.mkdir(parents=True, exist_ok=True)
    names = [hashlib.sha256(gpu.encode()).hexdigest()[:16] for gpu in gpus]
    # All GPUs get one job before any gets a second.
    slots = [(k, n) for n in range(jobs_per_gpu) for k in range(len(gpus))]
    announced = False
    while True:
        for index, number in slots:
            try:
                lock = FileLock(folder / f"{names[index]}-{number}.lock").acquire(timeout=0)
            except Timeout:
                continue
            with lock:
                yield index
            return
        if not announced:
            more = f"trainer.jobs_per_gpu={jobs_per_gpu + 1} would let more jobs share them"
            log.info("waiting for a free GPU of %d; %s", len(gpus), more)
            announced = True
        time.sleep(_LOOK_EVERY)


def visible_gpus() -> list[str]:
    """Return a name of each visible GPU, the same in every process of this machine."""
    count = torch.cuda.device_count()
    return [str(torch.cuda.get_device_properties(k).uuid) for k in range(count)]
