"""Running a study: its sweeps, one after the other, and a report of them all."""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from omegaconf import OmegaConf

from ffd_lightning.app.cli import compose_config, register, run_app
from ffd_lightning.app.studies.search import run_search
from ffd_lightning.app.studies.study import Study, commands, load_study, value_of
from ffd_lightning.app.sweep_summary import report_quietly
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.files import write_atomic

_ROOT = Path(__file__).parents[3]
_STUDIES = _ROOT / "sweeps"
_INTERRUPTED = 130


def main() -> None:
    """Run the study that the command line names."""
    register()
    run_app(lambda: sys.exit(run_study(_arguments())))


def run_study(arguments: argparse.Namespace) -> int:
    """Run a study, going on where it was cut off.

    Returns:
        The exit code: 0 if all runs are finished.

    Raises:
        ConfigError: no such study.
    """
    path = Path(arguments.study)
    file = path if path.suffix in (".yaml", ".yml") else _STUDIES / f"{path.name}.yaml"
    study = load_study(file)
    name = f"{file.stem}-quick" if arguments.quick else file.stem
    name = value_of("name", arguments.overrides, name)
    overrides = ["callbacks.report=false", *arguments.overrides]  # one at the end instead
    sweeps = commands(study, name, arguments.quick, overrides)
    folder = _folder(name, arguments.overrides)
    print(f"{study.question}\n\n{folder}\n", flush=True)
    for sweep in sweeps if arguments.dry_run else []:
        print(shlex.join(["python", "train.py", "-m", *sweep]))
    if arguments.dry_run:
        return 0
    _note(folder, file.stem, study, arguments)
    if study.search is not None:
        trials = study.search.quick_trials if arguments.quick else study.search.trials
        code = run_search(study.search, trials, folder, sweeps[0], train)
    else:
        code = _run_stages(sweeps)
    report_quietly(folder)
    return code


def _run_stages(sweeps: Sequence[Sequence[str]]) -> int:
    codes = []
    for sweep in sweeps:
        # A stage of which a run has failed does not keep the next from the others' results.
        codes.append(train(sweep))
        if codes[-1] == _INTERRUPTED:
            raise KeyboardInterrupt
    return int(any(codes))


def train(overrides: Sequence[str]) -> int:
    """Sweep with `train.py`, in a process of its own, and return its exit code."""
    command = [sys.executable, str(_ROOT / "train.py"), "-m", *overrides]
    return subprocess.run(command, check=False).returncode


def _folder(name: str, overrides: Sequence[str]) -> Path:
    """Return where the study's runs go; checks the overrides of paths on the way."""
    paths = [x for x in overrides if x.startswith("paths")]
    return Path(compose_config("train", [f"name={name}", *paths]).paths.runs) / name


def _note(folder: Path, name: str, study: Study, arguments: argparse.Namespace) -> None:
    """Keep with the runs what they are for."""
    quick = ["--quick"] if arguments.quick else []
    command = shlex.join(["python", "sweep.py", arguments.study, *quick, *arguments.overrides])
    content = {"study": name, "question": study.question, "command": command}
    try:
        write_atomic(folder / "study.yaml", OmegaConf.to_yaml(OmegaConf.create(content)))
    except OSError as error:
        raise ConfigError(f"cannot write {folder}: {error}") from None


def _arguments() -> argparse.Namespace:
    studies = [f"  {file.stem:<17}{_summary(file)}" for file in sorted(_STUDIES.glob("*.yaml"))]
    parser = argparse.ArgumentParser(
        prog="python sweep.py",
        description="Run a study of sweeps/: all its sweeps of train.py, then a report. The same "
        "command again goes on where it was cut off, and tries again what failed.",
        epilog="\n".join(
            [
                "studies:",
                *studies,
                "",
                "examples:",
                "  python sweep.py template_counts --quick",
                "  python sweep.py regimes category=chair,lamp 'seed=range(5)'",
                "  python sweep.py paper_table data=shapenet data.root=DIR hydra/launcher=joblib",
            ]
        ),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("study", help="its name, or a file")
    parser.add_argument("overrides", nargs="*", help="settings as for train.py, before the study's")
    parser.add_argument("--quick", action="store_true", help="a version that ends on two cores")
    parser.add_argument("--dry-run", action="store_true", help="print the sweeps, run nothing")
    return parser.parse_intermixed_args()


def _summary(file: Path) -> str:
    try:
        question = load_study(file).question
    except UserError:
        return "(damaged)"
    return question if len(question) <= 70 else f"{question[:67]}..."
