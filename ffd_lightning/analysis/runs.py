"""Finding and reading run folders."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.evaluation.protocols import ProtocolDescription
from ffd_lightning.run_folder import RunFolder

COLUMN_KEYS = {
    "category": "category.name",
    "regime": "regime.name",
    "templates": "templates.count",
    "seed": "seed",
}
"""Columns of tables, and the keys of the settings that they hold."""

_NOT_DECIDING = (
    *("seed", "name", "restart", "base", "plugins", "provided", "paths", "preparation", "trainer"),
    *("logger", "callbacks", "protocol", "evaluation"),
)  # settings, and groups of them, of where, how fast and how measured; see `decides`
_HOW = ("format", "protocol", "all_views", "seed")  # in `summary.json`: decide scores, with weights


def find_runs(root: Path) -> list[RunFolder]:
    """Return all run folders below a path, in order of their names."""
    return [RunFolder(path.parent) for path in sorted(root.rglob("config.yaml"))]


def require_runs(root: Path) -> list[RunFolder]:
    """Return all run folders below a path, as `find_runs` does.

    Raises:
        DataError: there is none.
    """
    runs = find_runs(root)
    if not runs:
        raise DataError(f"no run in {root}: give a folder that ffd train has written to")
    return runs


def select(settings: Mapping[str, Any], key: str) -> Any:
    """Return a setting of a run by its name on the command line, None where it is not set.

    >>> select({"regime": {"name": "b"}}, "regime.name")
    'b'
    """
    value: Any = settings
    for name in key.split("."):
        value = value.get(name) if isinstance(value, Mapping) else None
    return value


def decides(key: str) -> bool:
    """Tell whether runs that differ in a setting are no seeds of each other.

    It then decides what is computed, not where, how fast or under what name.

    >>> [decides(key) for key in ("schedule.steps", "seed", "trainer.devices", "trainer.precision")]
    [True, False, False, True]
    """
    where = any(f"{key}.".startswith(f"{name}.") for name in _NOT_DECIDING)
    return not where or key == "trainer.precision"


def _setting(settings: Mapping[str, Any]) -> str:
    """Return what is equal for runs that are seeds of each other, and for no others."""
    told = repr(sorted(_deciding(settings).items()))
    return f"setting {hashlib.sha256(told.encode()).hexdigest()[:12]}"


def without_seed(value: Any, seed: Any) -> Any:
    """Return a setting's value; the folder of a run of the same seed is the same for all seeds.

    >>> without_seed("runs/a/seed1_steps-9/template_ranking.csv", 1)
    'runs/a/seed_steps-9/template_ranking.csv'
    """
    named = isinstance(value, str)
    return re.sub(rf"(?<=/)seed{seed}(?=[/_])", "seed", value) if named else value


def _deciding(settings: Mapping[str, Any]) -> dict[str, str]:
    """Return what decides a run but its seed, by name; null is the same as nothing."""
    values = pd.json_normalize(dict(settings)).iloc[0].to_dict()
    return {
        key: repr(without_seed(value, settings.get("seed")))
        for key, value in values.items()
        if decides(key) and value is not None
    }


def different_settings(a: RunFolder, b: RunFolder) -> list[str]:
    """Return the settings that decide what runs compute and in which two differ, but for the seed.

    Raises:
        ConfigError: a `config.yaml` that is damaged.
    """
    one, other = _deciding(a.settings), _deciding(b.settings)
    return [key for key in sorted({*one, *other}) if one.get(key) != other.get(key)]


def is_mixed(table: pd.DataFrame, keys: Sequence[str]) -> bool:
    """Tell whether runs that have these columns in common differ in more than their seed."""
    return "setting" in table and bool(table.groupby(list(keys))["setting"].nunique().max() > 1)


def own_protocol(run: RunFolder) -> str:
    """Return the name of the results that a run's training ended with, or will."""
    ended = run.status.get("evaluation") or {}
    before = ended.get("protocol") or select(run.settings, "protocol.name")
    return str(ended.get("name") or before or "paper")


def described_protocol(run: RunFolder, name: str) -> ProtocolDescription | None:
    """Return the protocol of a run's results of this name, None where there are none.

    It is as their `summary.json` describes it, so that it need not be installed, and None where
    that is damaged. Its name is that of the results.
    """
    try:
        text = (run.evaluation(name) / "summary.json").read_text(encoding="utf-8")
        content = json.loads(text)
        how = {key: value for key, value in content.get("settings", {}).items() if key in _HOW}
        found = ProtocolDescription.from_json(content["protocol"])
        return replace(found, name=name, settings=json.dumps(how, sort_keys=True) if how else "")
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None


def described_protocols(run: RunFolder) -> dict[str, ProtocolDescription]:
    """Return the protocols that a run was evaluated under, by name, that of its training first.

    Results are of the network that the run was trained to, on its test shapes. Those whose summary
    is damaged, or describes no protocol, are left out.
    """
    names = sorted(folder.name for folder in run.path.glob("evaluation/*"))
    found = {name: known for name in names if (known := described_protocol(run, name))}
    own = own_protocol(run) if len(found) > 1 else ""
    return {name: found[name] for name in sorted(found, key=lambda name: name != own)}


def find_protocol(runs: Iterable[RunFolder], name: str | None = None) -> ProtocolDescription:
    """Return the protocol that runs were evaluated under; most of them, where they differ.

    Args:
        runs: evaluated runs.
        name: of the results, as in `paper` or `paper-points-300`; whichever most runs have where it
            is None.

    Raises:
        ConfigError: no run was evaluated under a protocol of this name.
        DataError: no run was evaluated at all.
    """
    runs = list(runs)
    found = [each for run in runs for each in described_protocols(run).values()]
    asked = [each for each in found if name in (None, each.name)]
    if asked:
        return Counter(asked).most_common(1)[0][0]
    command = evaluate_command(runs[0].path if runs else "DIR", name or "paper")
    if found:
        names = ", ".join(dict.fromkeys(each.name for each in found))
        raise ConfigError(
            f"no run was evaluated under protocol {name!r}: choose one of {names}, or evaluate "
            f"one: {command}"
        )
    raise DataError(f"no run was evaluated, or its summary.json is of another version: {command}")


def evaluate_command(run: object, name: str) -> str:
    """Return the command that makes a run's results of this name.

    >>> evaluate_command("runs/a", "paper")
    'ffd evaluate run=runs/a protocol=paper'
    >>> evaluate_command("DIR", "paper-points-300")
    'ffd evaluate run=DIR protocol=paper (with the settings that paper-points-300 names)'
    """
    protocol = re.split("[-/]", name)[0]
    told = "" if protocol == name else f" (with the settings that {name} names)"
    return f"ffd evaluate run={run} protocol={protocol}{told}"


def _require_one_way(runs: Iterable[RunFolder], name: str) -> None:
    """Raise a DataError if results of one name were not measured in one way.

    As by versions of this package, or of another whose protocol it is, that measured otherwise.
    """
    known = [(run, how) for run in runs if (how := described_protocol(run, name))]
    usual = Counter(how for _, how in known).most_common(1)
    for run, how in known:
        if how != usual[0][0]:
            raise DataError(
                f"{run.path} was evaluated in another way under protocol {name} than other runs. "
                f"Evaluate it again: {evaluate_command(run.path, name)} restart=true"
            )


def load_runs(runs: Iterable[RunFolder], protocol: str | None = None) -> pd.DataFrame:
    """Read runs into one table, a row each.

    Columns: `run` (path), `category`, `regime`, `templates`, `seed`, `setting` (equal for runs that
    differ in their seed alone, and for no others), `state`, `reason` (of a failure), `protocol`,
    `seconds_per_step` and, for runs that were evaluated under it, all numbers of their
    `summary.json`.

    Args:
        runs: their folders.
        protocol: the name of the results whose numbers are read; those that the run's training
            ended with where it is None.

    Raises:
        ConfigError: a `config.yaml` that is damaged.
        DataError: results of this name that were not all measured in one way.
    """
    rows, runs = [], list(runs)
    if protocol is not None:
        _require_one_way(runs, protocol)
    for run in runs:
        settings, status = run.settings, run.status
        name = protocol or own_protocol(run)
        trained = status.get("summary") or {}
        numbers = _numbers(run.evaluation(name) / "summary.json")
        if protocol is None and not numbers:  # it ended with the validation shapes (a search)
            numbers = trained
        rows.append(
            {
                "run": str(run.path),
                **{column: select(settings, key) for column, key in COLUMN_KEYS.items()},
                "setting": _setting(settings),
                "state": status.get("state", "unknown"),
                "reason": status.get("reason", ""),
                "protocol": name,
                "seconds_per_step": trained.get("seconds_per_step", float("nan")),
                **numbers,
            }
        )
    return pd.DataFrame(rows)


def _numbers(file: Path) -> dict[str, float]:
    """Return the numbers of a `summary.json`, {} where there is none or it is damaged."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        return {name: value for name, value in content.items() if isinstance(value, float)}
    except (OSError, ValueError, AttributeError):
        return {}


def load_samples(runs: Iterable[RunFolder], protocol: str = "paper") -> pd.DataFrame:
    """Read the samples of runs under a protocol into one table, a row per test image and run.

    Columns: `run`, `regime`, `templates`, `seed`, `setting` (see `load_runs`), and those of
    `samples.csv`: `id`, `category` (the shape's), `family`, `view`, `template`, `weight` and every
    measure of every shape. Runs that were not evaluated under the protocol are left out.

    Raises:
        DataError: no run has samples, or not all were measured in one way; samples that are
            damaged.
    """
    runs, parts = list(runs), []
    _require_one_way(runs, protocol)
    for run in runs:
        file = run.evaluation(protocol) / "samples.csv"
        if not file.is_file():
            continue
        try:
            samples = _read_samples(file, described_protocol(run, protocol))
        except (OSError, ValueError) as error:
            raise DataError(
                f"{file} is damaged ({' '.join(str(error).split())}): "
                f"{evaluate_command(run.path, protocol)} restart=true"
            ) from None
        settings = run.settings
        samples.insert(0, "run", str(run.path))
        for place, name in enumerate(("regime", "templates", "seed"), start=1):
            samples.insert(place, name, select(settings, COLUMN_KEYS[name]))
        samples.insert(4, "setting", _setting(settings))
        parts.append(samples)
    if not parts:
        raise DataError(
            f"no run has been evaluated under protocol {protocol}: "
            f"{evaluate_command('DIR', protocol)}"
        )
    return pd.concat(parts, ignore_index=True)


def _read_samples(file: Path, protocol: ProtocolDescription | None) -> pd.DataFrame:
    """Read a `samples.csv`.

    Raises:
        OSError, ValueError: it cannot be read, or lacks what all have.
    """
    samples = pd.read_csv(file, dtype={"id": str, "family": str, "template": str})
    if samples.empty:
        raise ValueError("no rows")
    measures = [] if protocol is None else [measure.name for measure in protocol.metrics]
    missing = [x for x in ("id", "category", "view", "template", *measures) if x not in samples]
    if missing:
        raise ValueError(f"no column {', '.join(missing)}")
    for name in measures:
        numbers = pd.to_numeric(samples[name], errors="coerce")
        if not (numbers.notna() & (numbers.abs() < float("inf"))).all():
            raise ValueError(f"{name} is not a finite number everywhere")
    return samples


def load_settings(runs: Iterable[RunFolder]) -> pd.DataFrame:
    """Read the settings of runs into one table: a row per run (index `run`), a column per key.

    Keys are as on the command line: `regime.min_weight`.
    """
    rows = {str(run.path): pd.json_normalize(run.settings).iloc[0].to_dict() for run in runs}
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("run")
