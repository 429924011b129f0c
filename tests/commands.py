"""Run the project's commands in this process: starting Python and loading torch takes seconds.

What only a process of its own can show (signals, what is imported when) starts one.
"""

import contextlib
import io
import logging
import os
import runpy
import sys
from dataclasses import dataclass
from pathlib import Path
from unittest import mock

from hydra.core.singleton import Singleton

ROOT = Path(__file__).parents[1]


@dataclass(frozen=True)
class Done:
    """What a command left, named as `subprocess.run` names it."""

    returncode: int
    stdout: str
    stderr: str


def run_command(name, *arguments, cwd=ROOT):
    """Run `python name.py arguments...`, or `python -m name arguments...` for a module's name."""
    script = ROOT / f"{name}.py"
    argv, environment = sys.argv, dict(os.environ)
    hydra = Singleton.get_state()
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    stdout, stderr = io.StringIO(), io.StringIO()
    try:
        sys.argv = [str(script), *map(str, arguments)]
        with (
            contextlib.chdir(cwd),
            contextlib.redirect_stdout(stdout),
            contextlib.redirect_stderr(stderr),
            # Hydra sets logging up anew; handlers of this process shall not be closed for that.
            mock.patch("logging.config._clearExistingHandlers"),
        ):
            try:
                if script.is_file():
                    runpy.run_path(str(script), run_name="__main__")
                else:
                    runpy.run_module(name, run_name="__main__", alter_sys=True)
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
