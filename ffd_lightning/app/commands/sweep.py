"""`ffd sweep`: a study, from its runs to its report."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from omegaconf import OmegaConf

from ffd_lightning.app.checks import device_problems, encoder_problems
from ffd_lightning.app.commands.train import train_command
from ffd_lightning.app.config import TrainConfig
from ffd_lightning.app.configuration import compose_config, config_folder
from ffd_lightning.app.first_weights import KERAS_ADDRESS, KERAS_FILES
from ffd_lightning.app.studies.categories import check_categories
from ffd_lightning.app.studies.study import (
    Study,
    commands,
    load_study,
    sample_jobs,
    value_of,
)
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.files import write_atomic

SCHEMA = TrainConfig
_INTERRUPTED = 130
_YES = ("true", "1", "yes")


@dataclass
class Request:
    """What a command line asks for.

    Attributes:
        study: its name, or a file.
        quick: the version that ends on two cores.
        dry_run: print the sweeps, and run nothing.
        overrides: settings as for `train`, before the study's.
        config_dir: a folder with options of the user's own.
    """

    study: str = ""
    quick: bool = False
    dry_run: bool = False
    overrides: list[str] = field(default_factory=list)
    config_dir: str | None = None

    @property
    def options(self) -> list[str]:
        """What the command line of each sweep has beside its overrides."""
        return [] if self.config_dir is None else ["--config-dir", self.config_dir]

    @classmethod
    def parse(cls, arguments: Sequence[str]) -> Request:
        """Read a command line.

        Raises:
            ConfigError: no study, two of them, or an option that there is not.
        """
        found, rest = cls(), list(arguments)
        while rest:
            argument = rest.pop(0)
            key, equals, value = argument.partition("=")
            if key in ("--quick", "quick", "--dry-run", "dry_run"):
                on = not equals or value.lower() in _YES
                found.quick, found.dry_run = (
                    (on, found.dry_run) if "quick" in key else (found.quick, on)
                )
            elif key == "--config-dir":
                found.config_dir = value or (rest.pop(0) if rest else "")
            elif argument.startswith("-"):
                raise ConfigError(f"no option {argument}: --quick, --dry-run, --config-dir")
            elif key == "study" or not equals:
                if found.study:
                    raise ConfigError(f"two studies: {found.study} and {value or argument}")
                found.study = value or argument
            else:
                found.overrides.append(argument)
        if not found.study:
            raise ConfigError(f"name a study: {', '.join(_studies())}")
        return found


def main(arguments: Sequence[str]) -> int:
    """Run the study that the command line names, or list what there is."""
    if not arguments or {"-h", "--help"} & set(arguments):
        print(_help())
        return 0
    return run_study(Request.parse(arguments))


def run_study(request: Request) -> int:
    """Run a study, resuming where it was interrupted.

    Returns:
        The exit code: 0 if all runs are finished.

    Raises:
        ConfigError: no such study, or settings that cannot work.
    """
    path = Path(request.study)
    file = path if path.suffix in (".yaml", ".yml") else config_folder("sweeps") / f"{path}.yaml"
    study = load_study(file)
    name = f"{file.stem}-quick" if request.quick else file.stem
    name = value_of("name", request.overrides, name)
    overrides = ["callbacks.report=false", *request.overrides]  # one at the end instead
    sweeps = commands(study, name, request.quick, overrides)
    folder = _folder(name, request)
    print(f"{study.question}\n\n{folder}\n", flush=True)
    for sweep in sweeps if request.dry_run else []:
        print(shlex.join(["python", "train.py", "-m", *request.options, *sweep]))
    problems = _problems(sweeps, request)
    if request.dry_run:
        if problems:
            print(f"\nIt would be refused: {problems}", file=sys.stderr)
        return 0
    if problems:
        raise ConfigError(problems)
    check_categories(sweeps, request.config_dir)
    _note(folder, file.stem, study, request)
    if study.search is not None:
        from ffd_lightning.app.studies.search import run_search

        trials = study.search.quick_trials if request.quick else study.search.trials
        code = run_search(
            study.search, trials, folder, sweeps[0], lambda x: train([*x, *request.options])
        )
    else:
        code = _run_stages([[*sweep, *request.options] for sweep in sweeps])
    from ffd_lightning.app.sweep_summary import print_beside_paper, report_quietly

    if study.beside_paper:
        print_beside_paper(folder)
    report_quietly(folder)
    return code


def _problems(sweeps: Sequence[Sequence[str]], request: Request) -> str:
    """Return what would stop jobs of a study at their start, after others have run perhaps."""
    found: list[str] = []
    for sweep in sweeps:
        elsewhere = any("submitit" in x for x in sweep)  # on a cluster's machines
        for job in sample_jobs(sweep):
            cfg = compose_config("train", TrainConfig, job, request.config_dir)
            found += [*encoder_problems(cfg), *([] if elsewhere else device_problems(cfg))]
    return "; ".join(dict.fromkeys(found))


def _run_stages(sweeps: Sequence[Sequence[str]]) -> int:
    codes: list[int] = []
    for number, sweep in enumerate(sweeps, 1):
        if len(sweeps) > 1:
            print(f"stage {number} of {len(sweeps)}", flush=True)
        # A stage of which a run has failed does not keep the next from the others' results.
        codes.append(train(sweep))
        if codes[-1] == _INTERRUPTED:
            raise KeyboardInterrupt
    return int(any(codes))


def train(overrides: Sequence[str]) -> int:
    """Sweep with `train`, in a process of its own, and return its exit code."""
    environment = {k: v for k, v in os.environ.items() if k != "HYDRA_FULL_ERROR"}
    command = [*train_command(), "-m", *overrides]
    return subprocess.run(command, check=False, env=environment).returncode


def _folder(name: str, request: Request) -> Path:
    """Return where the study's runs go; checks the overrides of paths on the way."""
    paths = [x for x in request.overrides if x.startswith(("paths", "plugins"))]
    composed = compose_config("train", TrainConfig, [f"name={name}", *paths], request.config_dir)
    return Path(composed.paths.runs) / name


def _note(folder: Path, name: str, study: Study, request: Request) -> None:
    """Keep with the runs what they are for."""
    options = [*(["--quick"] if request.quick else []), *request.options]
    command = shlex.join(["python", "sweep.py", request.study, *options, *request.overrides])
    content: dict[str, str | bool] = {
        "study": name,
        "question": study.question,
        "command": command,
    }
    if study.beside_paper:
        content["beside_paper"] = True
    try:
        write_atomic(folder / "study.yaml", OmegaConf.to_yaml(OmegaConf.create(content)))
    except OSError as error:
        raise ConfigError(f"cannot write {folder}: {error}") from None


def _studies() -> list[str]:
    return sorted(file.stem for file in config_folder("sweeps").glob("*.yaml"))


def _help() -> str:
    folder = config_folder("sweeps")
    listed = [f"  {name:<17}{_summary(folder / f'{name}.yaml')}" for name in _studies()]
    weights = KERAS_FILES[0.25]
    return "\n".join(
        [
            "Run a study: all its sweeps of train.py, then a report. The same command again",
            "resumes where it was interrupted, and tries again what failed.",
            "",
            "  python sweep.py template_counts --quick",
            "  python sweep.py regimes category=chair,lamp 'seed=range(5)'",
            "  python sweep.py paper_table data=shapenet data.root=DIR encoder.weights=FILE",
            "",
            "Without --quick all but search train as the paper does (schedule=paper): 100,000",
            "steps, batch-norm momentum 0.01, ImageNet weights. Those are Keras' file",
            f"  {weights}, from",
            f"  {KERAS_ADDRESS}",
            "encoder.weights=none trains from scratch instead; one of the two must be said.",
            "",
            "Studies (or a file of your own):",
            "",
            *listed,
            "",
            "Settings:",
            "",
            "  --quick, quick=true      a version that ends on two cores",
            "  --dry-run, dry_run=true  print the sweeps, run nothing",
            "  --config-dir DIR         a folder with options of your own",
            "  key=value ...            settings as for train.py, before the study's",
        ]
    )


def _summary(file: Path) -> str:
    try:
        question = load_study(file).question
    except UserError:
        return "(damaged)"
    return question if len(question) <= 70 else f"{question[:67]}..."
