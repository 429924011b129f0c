"""`ffd sweep`: a study, from its runs to its report."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

import yaml

from ffd_lightning.app.commands.train import run_to_end, train_command
from ffd_lightning.app.configuration import config_folder
from ffd_lightning.app.settings import read_options, two_columns
from ffd_lightning.app.studies import Study, check_study, key_of, load_study, sweeps, value_of
from ffd_lightning.errors import ConfigError
from ffd_lightning.files import write_atomic
from ffd_lightning.pretrained import KERAS_ADDRESS, KERAS_FILES

_INTERRUPTED = 130
_FOLDER = config_folder("sweeps")
_ALIASES = {"quick=true": ["--quick"], "dry_run=true": ["--dry-run"]}
_ALIASES |= {"quick=false": [], "dry_run=false": []}
_HELP = """Run a study: all its sweeps of train.py, then a report. The same command again
resumes where it was interrupted, and tries again what failed.

  python sweep.py template_counts --quick
  python sweep.py regimes category=chair,lamp 'seed=range(5)'
  python sweep.py paper_table data=shapenet data.root=DIR encoder.weights=FILE

As the paper does, 100,000 steps a run, train {paper}
unless --quick is given. They must be told the encoder's first weights: encoder.weights=none, or
encoder.weights=FILE for ImageNet's by Keras, FILE being
  {weights}, from
  {address}

Studies (or a file of your own):

{studies}

Settings:

  --quick, quick=true      a version that ends on two cores
  --dry-run, dry_run=true  print the sweeps, run nothing
  --config-dir DIR         a folder with options of your own
  key=value ...            settings as for train.py, before the study's"""


def read_request(arguments: Sequence[str]) -> tuple[argparse.Namespace, str, list[str]]:
    """Return what a command line asks for, see `_HELP`: options, the study, overrides."""
    given = [word for each in arguments for word in _ALIASES.get(each, [each])]
    options, words = read_options("sweep", given, "--quick", "--dry-run")
    named = [x for x in words if "=" not in x or x.startswith("study=")]
    if len(named) != 1:
        there = ", ".join(sorted(file.stem for file in _FOLDER.glob("*.yaml")))
        raise ConfigError(f"name one study: {there}; got {' and '.join(named) or 'none'}")
    return options, named[0].removeprefix("study="), [x for x in words if x not in named]


def main(arguments: Sequence[str]) -> int:
    """Run the study that the command line names, or list what there is."""
    if arguments and not {"-h", "--help"} & set(arguments):
        return run_study(arguments)
    studies = {file.stem: load_study(file) for file in sorted(_FOLDER.glob("*.yaml"))}
    listed = two_columns((name, study.question) for name, study in studies.items())
    paper = ", ".join(n for n, study in studies.items() if "schedule=paper" in study.overrides)
    keras = {"weights": KERAS_FILES[0.25], "address": KERAS_ADDRESS}
    print(_HELP.format(**keras, studies=listed, paper=paper))
    return 0


def run_study(arguments: Sequence[str]) -> int:
    """Run a study, resuming where it was interrupted; return 0 if all runs are finished."""
    options, asked, given = read_request(arguments)
    file = Path(asked)
    file = file if file.suffix in (".yaml", ".yml") else _FOLDER / f"{file}.yaml"
    study, stem = load_study(file), file.stem
    name = value_of("name", given, f"{stem}-quick" if options.quick else stem)
    overrides = ["callbacks.report=false", *given]  # one at the end instead
    stages = sweeps(study, name, options.quick, overrides)
    tried = study.search.ends if study.search else [[]]
    checked = [[*stage, *values] for stage in stages for values in tried]
    if study.search:
        keys = set(map(key_of, given))
        if taken := [key for key in study.search.parameters if key.lstrip("+") in keys]:
            raise ConfigError(f"{', '.join(taken)}: the study searches it, leave it out")
    first, problems = check_study(checked, options.config_dir)
    folder = Path(first.paths.runs) / first.name
    more = ["--config-dir", options.config_dir] if options.config_dir else []
    print(f"{study.question}\n\n{folder}\n", flush=True)
    if options.dry_run:
        for stage in stages:
            print(shlex.join(["python", "train.py", "-m", *more, *stage]))
        if problems:
            print(f"\nIt would be refused: {problems}", file=sys.stderr)
        return 0
    if problems:
        raise ConfigError(problems)
    _note(folder, stem, study, arguments)
    if study.search is not None:
        from ffd_lightning.app.search import run_search

        trials = study.search.quick_trials if options.quick else study.search.trials
        code = run_search(study.search, trials, folder, stages[0], lambda x: train([*x, *more]))
    else:
        # A stage of which a run has failed does not keep the next from the others' results.
        code = max([train([*stage, *more]) for stage in stages])
    from ffd_lightning.app.sweep_end import report_quietly

    report_quietly(folder)
    return code


def train(overrides: Sequence[str]) -> int:
    """Sweep with `train` in a process of its own, and return 0, or 1 if a run has failed."""
    environment = {k: v for k, v in os.environ.items() if k != "HYDRA_FULL_ERROR"}
    code = run_to_end([*train_command(), "-m", *overrides], environment)
    if code == _INTERRUPTED:
        raise KeyboardInterrupt
    return int(code != 0)


def _note(folder: Path, name: str, study: Study, arguments: Sequence[str]) -> None:
    """Keep with the runs what they are for."""
    command = shlex.join(["python", "sweep.py", *arguments])
    content: dict[str, object] = {"study": name, "question": study.question, "command": command}
    content |= {"beside_paper": True} if study.beside_paper else {}
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    write_atomic(folder / "study.yaml", text)
