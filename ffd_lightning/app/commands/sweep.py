"""`ffd sweep`: a study, from its runs to its report."""

from __future__ import annotations

import argparse
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
from ffd_lightning.app.studies import Study, check_categories, jobs, load_study, sweeps, value_of
from ffd_lightning.errors import ConfigError, UserError
from ffd_lightning.files import write_atomic

SCHEMA = TrainConfig
_INTERRUPTED = 130
_ALIASES = {"quick=true": ["--quick"], "dry_run=true": ["--dry-run"]}
_ALIASES |= {"quick=false": [], "dry_run=false": []}
_HELP = """Run a study: all its sweeps of train.py, then a report. The same command again
resumes where it was interrupted, and tries again what failed.

  python sweep.py template_counts --quick
  python sweep.py regimes category=chair,lamp 'seed=range(5)'
  python sweep.py paper_table data=shapenet data.root=DIR encoder.weights=FILE

Without --quick all but search train as the paper does (schedule=paper): 100,000
steps, batch-norm momentum 0.01, ImageNet weights. Those are Keras' file
  {weights}, from
  {address}
encoder.weights=none trains from scratch instead; one of the two must be said.

Studies (or a file of your own):

{studies}

Settings:

  --quick, quick=true      a version that ends on two cores
  --dry-run, dry_run=true  print the sweeps, run nothing
  --config-dir DIR         a folder with options of your own
  key=value ...            settings as for train.py, before the study's"""


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

    study: str
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
        parser = argparse.ArgumentParser("ffd sweep", allow_abbrev=False, add_help=False)
        for name in ("--quick", "--dry-run"):
            parser.add_argument(name, action="store_true")
        parser.add_argument("--config-dir")
        found, words = parser.parse_known_args(
            [word for each in arguments for word in _ALIASES.get(each, [each])]
        )
        if unknown := [word for word in words if word.startswith("-")]:
            raise ConfigError(f"no option {unknown[0]}: --quick, --dry-run, --config-dir")
        named = [word.removeprefix("study=") for word in words if _names_study(word)]
        if len(named) != 1:
            there = ", ".join(sorted(file.stem for file in config_folder("sweeps").glob("*.yaml")))
            few = f"name a study: {there}"
            raise ConfigError(f"two studies: {' and '.join(named)}" if named else few)
        overrides = [word for word in words if not _names_study(word)]
        return cls(named[0], found.quick, found.dry_run, overrides, found.config_dir)


def _names_study(word: str) -> bool:
    return "=" not in word or word.startswith("study=")


def main(arguments: Sequence[str]) -> int:
    """Run the study that the command line names, or list what there is."""
    if arguments and not {"-h", "--help"} & set(arguments):
        return run_study(Request.parse(arguments))
    files = sorted(config_folder("sweeps").glob("*.yaml"))
    studies = "\n".join(f"  {file.stem:<17}{_summary(file)}" for file in files)
    print(_HELP.format(weights=KERAS_FILES[0.25], address=KERAS_ADDRESS, studies=studies))
    return 0


def _summary(file: Path) -> str:
    try:
        question = load_study(file).question
    except UserError:
        return "(damaged)"
    return question if len(question) <= 70 else f"{question[:67]}..."


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
    stages = sweeps(study, name, request.quick, overrides)
    folder = _folder(name, request)
    print(f"{study.question}\n\n{folder}\n", flush=True)
    for stage in stages if request.dry_run else []:
        print(shlex.join(["python", "train.py", "-m", *request.options, *stage]))
    problems = _problems(stages, request)
    if request.dry_run:
        if problems:
            print(f"\nIt would be refused: {problems}", file=sys.stderr)
        return 0
    if problems:
        raise ConfigError(problems)
    check_categories(stages, request.config_dir)
    _note(folder, file.stem, study, request)
    if study.search is not None:
        from ffd_lightning.app.search import run_search

        trials = study.search.quick_trials if request.quick else study.search.trials
        code = run_search(
            study.search, trials, folder, stages[0], lambda x: train([*x, *request.options])
        )
    else:
        # A stage of which a run has failed does not keep the next from the others' results.
        code = max([_stage([*stage, *request.options]) for stage in stages])
    from ffd_lightning.app.sweep_end import print_beside_paper, report_quietly

    if study.beside_paper:
        print_beside_paper(folder)
    report_quietly(folder)
    return code


def _problems(stages: Sequence[Sequence[str]], request: Request) -> str:
    """Return what would stop jobs of a study at their start, after others have run perhaps."""
    found: list[str] = []
    for stage in stages:
        elsewhere = any("submitit" in x for x in stage)  # on a cluster's machines
        asked = {
            tuple(x for x in job if x.startswith(("schedule=", "encoder"))): job
            for job in reversed(jobs(stage))
        }
        for job in asked.values():
            cfg = compose_config("train", TrainConfig, job, request.config_dir)
            found += [*encoder_problems(cfg), *([] if elsewhere else device_problems(cfg))]
    return "; ".join(dict.fromkeys(found))


def _stage(sweep: Sequence[str]) -> int:
    code = train(sweep)
    if code == _INTERRUPTED:
        raise KeyboardInterrupt
    return int(code != 0)


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
    content = {"study": name, "question": study.question, "command": command}
    beside: dict[str, bool] = {"beside_paper": True} if study.beside_paper else {}
    try:
        write_atomic(folder / "study.yaml", OmegaConf.to_yaml(OmegaConf.create(content | beside)))
    except OSError as error:
        raise ConfigError(f"cannot write {folder}: {error}") from None
