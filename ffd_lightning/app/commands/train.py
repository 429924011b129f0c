"""`ffd train`: a run, or a sweep of runs with -m."""

import gc
import logging
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path

from hydra.conf import HydraConf
from hydra.core.hydra_config import HydraConfig
from hydra.types import RunMode

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import run_hydra
from ffd_lightning.app.messages import SHOWN
from ffd_lightning.run_folder import RunFolder

log = logging.getLogger(__name__)

_PATIENCE = 60.0  # seconds


def main(arguments: Sequence[str]) -> None:
    """Train what the command line names."""
    if {"-m", "--multirun"} & set(arguments):  # jobs may be in processes that only Ctrl-C ends
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    run_hydra("train", TrainConfig, train_job, arguments, counted=True)


def train_job(cfg: TrainConfig) -> dict[str, float] | None:
    """Train, evaluate, and write the run folder that Hydra named.

    In a multirun a failed job is recorded in its `status.json` and does not stop the others.
    """
    import torch

    from ffd_lightning.app.training_run import train

    hydra = HydraConfig.get()
    run = RunFolder(Path(hydra.runtime.output_dir))
    if hydra.mode is not RunMode.MULTIRUN:
        return train(cfg, run)
    try:
        return _train_in_sweep(cfg, run, hydra)
    except SHOWN:
        raise  # `run_hydra` says what is wrong, and records it
    except Exception:
        log.exception("%s failed", run.path)
        return None
    finally:  # free what the job held in cycles and in the GPU's cache
        gc.collect()
        if torch.cuda.is_available():
            torch.cuda.empty_cache()


def _train_in_sweep(cfg: TrainConfig, run: RunFolder, hydra: HydraConf) -> dict[str, float] | None:
    """Train one job of a sweep, on a GPU of its own if there are any."""
    from ffd_lightning.app.gpus import gpu_slot, visible_gpus
    from ffd_lightning.app.training_run import train

    if cfg.trainer.strategy.startswith("ddp") and not run.finished:
        return _train_in_own_process(run, hydra)
    alone = cfg.trainer.strategy == "auto" and cfg.trainer.devices in ("auto", "1")
    gpus = visible_gpus() if alone and cfg.trainer.accelerator in ("auto", "gpu", "cuda") else []
    if run.finished or not gpus:
        return train(cfg, run)
    with gpu_slot(gpus, cfg.trainer.jobs_per_gpu) as gpu:
        cfg.trainer.devices = f"{gpu},"  # a list of one, as Lightning writes it
        return train(cfg, run)


def _train_in_own_process(run: RunFolder, hydra: HydraConf) -> dict[str, float] | None:
    """Train a job as a run of its own, which Lightning can start again for each further device.

    It starts the command that it finds itself in: here that would be the whole sweep.
    """
    given = [x.path for x in hydra.runtime.config_sources if x.provider == "command-line"]
    options = [word for path in given for word in ("--config-dir", path)]
    quoted = str(run.path).replace("'", r"\'")
    place = f"hydra.run.dir='{quoted}'"
    command = [*train_command(), *options, *hydra.overrides.task, place]
    if run_to_end(command) == 0:
        return dict(run.status["summary"])
    log.error("%s failed: see its messages above", run.path)
    return None


def run_to_end(command: Sequence[str], environment: Mapping[str, str] | None = None) -> int:
    """Run a training in a process of its own and return its exit code.

    Where this one is interrupted, that one ends what it has begun in others: a kill would not.

    Raises:
        KeyboardInterrupt: Ctrl-C or SIGTERM, once the other process has ended.
    """
    begun: list[subprocess.Popen[bytes]] = []

    def interrupt(*_: object) -> None:
        for process in begun:
            process.terminate()
        raise KeyboardInterrupt

    signal.signal(signal.SIGTERM, interrupt)
    with subprocess.Popen(command, env=environment) as process:
        begun.append(process)
        try:
            return process.wait()
        except KeyboardInterrupt:  # a terminal's Ctrl-C is for both
            with suppress(subprocess.TimeoutExpired, KeyboardInterrupt):
                process.wait(_PATIENCE)
            process.kill()
            raise


def train_command() -> list[str]:
    """Return what starts a training in a process of its own."""
    return [sys.executable, "-m", "ffd_lightning", "train"]
