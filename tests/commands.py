"""Run the project's commands in this process: starting Python and loading torch takes seconds.

What only a process of its own can show (signals, what is imported when) starts one.
"""

import contextlib
import io
import json
import logging
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from hydra import compose, initialize_config_dir
from hydra.core.hydra_config import HydraConfig
from hydra.core.singleton import Singleton

from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import (
    compose_config,
    config_folder,
    prepare_hydra,
    typed_config,
)
from ffd_lightning.app.main import run
from ffd_lightning.app.settings import read_settings

ROOT = Path(__file__).parents[1]
SAVING = "lightning.pytorch.callbacks.ModelCheckpoint"


@dataclass(frozen=True)
class Done:
    """What a command left, named as `subprocess.run` names it."""

    returncode: int
    stdout: str
    stderr: str


def train_config(*overrides):
    """The settings of `ffd train overrides...`."""
    return typed_config(compose_config("train", TrainConfig, overrides), TrainConfig)


def run_command(name, *arguments, cwd=ROOT):
    """Run `ffd name arguments...`."""
    argv, environment = sys.argv, dict(os.environ)
    hydra = Singleton.get_state()
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    terminate = signal.getsignal(signal.SIGTERM)
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
        signal.signal(signal.SIGTERM, terminate)
        sys.argv = argv
        os.environ.clear()
        os.environ.update(environment)
        Singleton.set_state(hydra)
        root.handlers[:] = handlers
        root.setLevel(level)
    return Done(code or 0, stdout.getvalue(), stderr.getvalue())


@contextlib.contextmanager
def composed_job(*overrides):
    """The configuration of a job of `ffd train` as Hydra has it within the job, itself included."""
    prepare_hydra(TrainConfig, overrides)
    with initialize_config_dir(str(config_folder()), version_base="1.3"):
        composed = compose("train", list(overrides), return_hydra_config=True)
        HydraConfig.instance().set_config(composed)
        yield composed


def call(module, *words):
    """Return what a plain command returns, without its messages for the terminal."""
    return module.main(read_settings(module.Settings, words, module.MAIN))


def python(*arguments, folder=ROOT, path=ROOT):
    """Run Python in a folder, by the package in `path`."""
    command, environment = [sys.executable, *arguments], {"PYTHONPATH": str(path), "COLUMNS": "200"}
    options = {"env": os.environ | environment, "capture_output": True, "text": True}
    return subprocess.run(command, cwd=folder, **options)


def in_one_process(*commands, folder, path=ROOT):
    """Run commands of `ffd` in a folder one after the other, in one process of their own."""
    code = (
        "import json, sys; from commands import run_command; "
        "print(json.dumps([vars(run_command(*c, cwd='.')) for c in json.loads(sys.argv[1])]))"
    )
    words = json.dumps([list(map(str, command)) for command in commands])
    done = python("-c", code, words, folder=folder, path=f"{path}:{Path(__file__).parent}")
    assert done.returncode == 0, done.stderr
    return [Done(**found) for found in json.loads(done.stdout)]


def wait_for(condition):
    """Wait until something is so; the limit only ends a test that would hang."""
    end = time.monotonic() + 600
    while not condition():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.01)


def killed(command, place, name, nth):
    """Return Python that runs `ffd command` and dies as a method is called the nth time.

    Args:
        command: whose arguments follow.
        place: module and class.
        name: of the method.
        nth: 1 for its first call.
    """
    module, _, owner = place.rpartition(".")
    return f"""
import os, signal
from {module} import {owner}
from ffd_lightning.app.main import run

method, calls = {owner}.{name}, []

def killed(*arguments):
    calls.append(1)
    if len(calls) == {nth}:
        os.kill(os.getpid(), signal.SIGKILL)
    return method(*arguments)

{owner}.{name} = killed
if __name__ == "__main__":
    run("{command}")
"""
