"""Run the project's commands in this process: starting Python and loading torch takes seconds.

What only a process of its own can show (signals, what is imported when) starts one.
"""

import contextlib
import io
import logging
import os
import sys
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from hydra.core.singleton import Singleton

from ffd_lightning.app.main import run

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Done:
    """What a command left, named as `subprocess.run` names it."""

    returncode: int
    stdout: str
    stderr: str


def run_command(name, *arguments, cwd=ROOT):
    """Run `ffd name arguments...`."""
    argv, environment = sys.argv, dict(os.environ)
    hydra = Singleton.get_state()
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    stdout, stderr = io.StringIO(), io.StringIO()
    try:
        sys.argv = [str(ROOT / "train.py")]
        with (
            contextlib.chdir(cwd),
            contextlib.redirect_stdout(stdout),
            contextlib.redirect_stderr(stderr),
            # Hydra sets logging up anew; handlers of this process shall not be closed for that.
            mock.patch("logging.config._clearExistingHandlers"),
        ):
            try:
                run(name, list(map(str, arguments)))
                code = 0
            except SystemExit as exit:
                code = exit.code
                if isinstance(code, str):  # as Python does where it ends
                    print(code, file=sys.stderr)
                    code = 1
    finally:
        sys.argv = argv
        os.environ.clear()
        os.environ.update(environment)
        Singleton.set_state(hydra)
        root.handlers[:] = handlers
        root.setLevel(level)
    return Done(code or 0, stdout.getvalue(), stderr.getvalue())


def killed_training(step, method="on_train_batch_start"):
    """Return Python that runs `ffd train` and dies at a step: as it begins, or before it is saved.

    Args:
        step: so many are done.
        method: of Lightning's `ModelCheckpoint`, whose call is the moment.
    """
    return f"""
import os, signal
from lightning.pytorch.callbacks import ModelCheckpoint
from ffd_lightning.app.main import run

method = ModelCheckpoint.{method}

def killed(self, trainer, *arguments):
    if trainer.global_step == {step}:
        os.kill(os.getpid(), signal.SIGKILL)
    return method(self, trainer, *arguments)

ModelCheckpoint.{method} = killed
if __name__ == "__main__":
    run("train")
"""
