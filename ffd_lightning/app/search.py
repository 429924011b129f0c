"""Searching settings with Optuna, each trial a sweep of `ffd train`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from filelock import FileLock

from ffd_lightning import components
from ffd_lightning.app.studies import Search, key_of, merged, value_of
from ffd_lightning.data.preparation.prepared import digest_of
from ffd_lightning.errors import ConfigError
from ffd_lightning.files import lock_folder, write_csv, write_json
from ffd_lightning.run_folder import decides, find_runs

if TYPE_CHECKING:
    import optuna

_DIGITS = 6  # of a digest in a name


def run_search(
    search: Search,
    trials: int,
    folder: Path,
    overrides: Sequence[str],
    train: Callable[[Sequence[str]], int],
) -> int:
    """Look for the settings with the best score on the validation shapes; resumes.

    Writes `search.db` (Optuna's own, for its dashboard), `trials.csv` and `best.json`. Trial k's
    runs are in `search-DIGEST/trial-k`, whose digest is of the search and its overrides. `train`
    sweeps with overrides and returns an exit code; so does this, 0 if all trials are finished.

    Raises:
        ConfigError: no Optuna, no such measure, another subset; another process does this search.
    """
    try:
        import optuna
    except ImportError:
        raise ConfigError("a search needs optuna: pip install 'ffd_lightning[search]'") from None
    protocol = value_of("protocol", overrides, "paper")
    measures = {m.name: m for m in components.make("protocol", protocol).metrics}
    if search.measure not in measures:
        raise ConfigError(f"protocol {protocol} has no {search.measure}: {', '.join(measures)}")
    if value_of("evaluation.subset", overrides, "val") != "val":
        raise ConfigError("a search looks at the validation shapes: leave evaluation.subset out")
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    maximize = measures[search.measure].higher_is_better
    deciding = sorted(x for x in overrides if _decides(key_of(x)))
    settings = [deciding, search.measure, asdict(search)["parameters"]]
    name = f"search-{digest_of(settings)[:_DIGITS]}"
    with lock_folder(folder / name, f"another process does {folder / name}: wait for it"):
        with FileLock(folder / ".search.lock"):  # two searches at once would both make the tables
            study = optuna.create_study(
                study_name=name,
                storage=f"sqlite:///{folder.absolute() / 'search.db'}",
                direction="maximize" if maximize else "minimize",
                load_if_exists=True,
            )
        code = 0
        for number, chosen in _trials(study, search, trials):
            place = f"{name}/trial-{number:03d}"
            values = [f"{key}={value!r}" for key, value in chosen.items()]
            subdir = f'hydra.sweep.subdir="{place}/${{run_folder:}}"'
            print(f"\ntrial {number + 1} of {trials}: {' '.join(values)}", flush=True)
            failed = train(merged([*overrides, "evaluation.subset=val", *values, subdir]))
            runs = [run for run in find_runs(folder / place) if run.finished]
            if failed or not runs:
                code = 1  # the trial stays open: the same command tries it again
                continue
            scores = [run.status["summary"][search.measure] for run in runs]
            study.tell(number, float(np.mean(scores)))
            _write(study, folder)
        _write(study, folder)  # another search of this name may have written its own meanwhile
    return code


def _write(study: optuna.Study, folder: Path) -> None:
    """Write the scores of the trials so far, the best first."""
    done = [trial for trial in study.get_trials() if trial.value is not None]
    rows = [{"trial": t.number, "score": t.value, **t.params} for t in done]
    rows.sort(key=lambda row: row["score"], reverse=study.direction.name == "MAXIMIZE")
    if rows:
        write_csv(folder / "trials.csv", rows)
        write_json(folder / "best.json", rows[0])


def _decides(key: str) -> bool:
    """Tell whether an override makes the scores of trials others."""
    group = key.replace("/", ".").partition(".")[0]
    return group in ("protocol", "evaluation") or (group != "hydra" and decides(key))


def _trials(
    study: optuna.Study, search: Search, count: int
) -> Iterator[tuple[int, dict[str, float]]]:
    """Yield number and settings of the trials without a score, those begun earlier first."""
    from optuna.distributions import BaseDistribution, FloatDistribution
    from optuna.samplers import TPESampler
    from optuna.trial import TrialState

    space: dict[str, BaseDistribution] = {
        key: FloatDistribution(r.low, r.high, log=r.log) for key, r in search.parameters.items()
    }
    for trial in study.get_trials(states=[TrialState.RUNNING]):
        if trial.params.keys() == search.parameters.keys():
            yield trial.number, trial.params
        else:  # cut off while its settings were chosen
            study.tell(trial.number, state=TrialState.FAIL)
    while len(study.get_trials(states=[TrialState.RUNNING, TrialState.COMPLETE])) < count:
        # A sampler per trial: what it suggests then depends on the scores so far, not on whether
        # the search was cut off.
        study.sampler = TPESampler(seed=len(study.get_trials()))
        new = study.ask(space)
        yield new.number, new.params
