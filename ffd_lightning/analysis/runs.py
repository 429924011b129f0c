"""Finding and reading run folders."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable, Mapping
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


def own_protocol(run: RunFolder) -> str:
    """Return the name of the protocol that a run's training ended with, or will."""
    ended = run.status.get("evaluation") or {}
    return str(ended.get("protocol") or select(run.settings, "protocol.name") or "paper")


def described_protocols(run: RunFolder) -> dict[str, ProtocolDescription]:
    """Return the protocols that a run was evaluated under, by name, that of its training first.

    They are as its `summary.json` files describe them, so that they need not be installed.
    Evaluations whose summary is damaged, or describes no protocol, are left out.
    """
    found = {}
    for file in sorted(run.path.glob("evaluation/*/summary.json")):
        try:
            content = json.loads(file.read_text(encoding="utf-8"))["protocol"]
            found[file.parent.name] = ProtocolDescription.from_json(content)
        except (OSError, ValueError, KeyError, TypeError):
            continue
    own = own_protocol(run) if len(found) > 1 else ""
    return {name: found[name] for name in sorted(found, key=lambda name: name != own)}


def find_protocol(runs: Iterable[RunFolder], name: str | None = None) -> ProtocolDescription:
    """Return the protocol that runs were evaluated under; most of them, where they differ.

    Args:
        runs: evaluated runs.
        name: of the protocol; whichever most runs have where it is None.

    Raises:
        ConfigError: no run was evaluated under a protocol of this name.
        DataError: no run was evaluated at all.
    """
    runs = list(runs)
    found = [each for run in runs for each in described_protocols(run).values()]
    asked = [each for each in found if name in (None, each.name)]
    if asked:
        return Counter(asked).most_common(1)[0][0]
    command = f"ffd evaluate run={runs[0].path if runs else 'DIR'} protocol={name or 'paper'}"
    if found:
        names = ", ".join(dict.fromkeys(each.name for each in found))
        raise ConfigError(
            f"no run was evaluated under protocol {name!r}: choose one of {names}, or evaluate "
            f"one: {command}"
        )
    raise DataError(f"no run was evaluated, or its summary.json is of another version: {command}")


def load_runs(runs: Iterable[RunFolder], protocol: str | None = None) -> pd.DataFrame:
    """Read runs into one table, a row each.

    Columns: `run` (path), `category`, `regime`, `templates`, `seed`, `state`, `reason` (of a
    failure), `protocol`, `seconds_per_step` and, for runs that were evaluated under it, all numbers
    of their `summary.json`.

    Args:
        runs: their folders.
        protocol: whose numbers are read; what the run's training ended with where it is None.

    Raises:
        ConfigError: a `config.yaml` that is damaged.
    """
    rows = []
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

    Columns: `run`, `regime`, `templates`, `seed`, and those of `samples.csv`: `id`, `category` (the
    shape's), `family`, `view`, `template`, `weight` and every measure of every shape. Runs that
    were not evaluated under the protocol are left out.

    Raises:
        DataError: no run has samples.
    """
    parts = []
    for run in runs:
        file = run.evaluation(protocol) / "samples.csv"
        if not file.is_file():
            continue
        samples = pd.read_csv(file, dtype={"id": str, "family": str, "template": str})
        settings = run.settings
        samples.insert(0, "run", str(run.path))
        for place, name in enumerate(("regime", "templates", "seed"), start=1):
            samples.insert(place, name, select(settings, COLUMN_KEYS[name]))
        parts.append(samples)
    if not parts:
        raise DataError(
            f"no run has been evaluated under protocol {protocol}: ffd evaluate run=DIR "
            f"protocol={protocol}"
        )
    return pd.concat(parts, ignore_index=True)


def load_settings(runs: Iterable[RunFolder]) -> pd.DataFrame:
    """Read the settings of runs into one table: a row per run (index `run`), a column per key.

    Keys are as on the command line: `regime.min_weight`.
    """
    rows = {str(run.path): pd.json_normalize(run.settings).iloc[0].to_dict() for run in runs}
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("run")
