"""Finding and reading run folders."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

import pandas as pd
from omegaconf import OmegaConf

from ffd_lightning.errors import DataError
from ffd_lightning.run_folder import RunFolder

_SETTINGS = {
    "category": "category.name",
    "regime": "regime.name",
    "templates": "templates.count",
    "seed": "seed",
}


def find_runs(root: Path) -> list[RunFolder]:
    """Return all run folders below a path, in order of their names."""
    return [RunFolder(path.parent) for path in sorted(root.rglob("config.yaml"))]


def load_runs(runs: Iterable[RunFolder], protocol: str | None = None) -> pd.DataFrame:
    """Read runs into one table, a row each.

    Columns: `run` (path), `category`, `regime`, `templates`, `seed`, `state`, `reason` (of a
    failure), `protocol`, `seconds_per_step` and, for runs that were evaluated under it, all numbers
    of their `summary.json`.

    Args:
        runs: their folders.
        protocol: whose numbers are read; what the run's training ended with where it is None.
    """
    rows = []
    for run in runs:
        config = OmegaConf.load(run.config)
        status = run.status
        own = OmegaConf.select(config, "evaluation.protocol", default="paper")
        name = protocol or (status.get("evaluation") or {}).get("protocol", own)
        trained = status.get("summary") or {}
        rows.append(
            {
                "run": str(run.path),
                **{column: OmegaConf.select(config, key) for column, key in _SETTINGS.items()},
                "state": status.get("state", "unknown"),
                "reason": status.get("reason", ""),
                "protocol": name,
                "seconds_per_step": trained.get("seconds_per_step", float("nan")),
                **_numbers(run.evaluation(name) / "summary.json"),
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
    model's), `family`, `view`, `template`, `weight` and every measure of every shape. Runs that
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
        config = OmegaConf.load(run.config)
        samples.insert(0, "run", str(run.path))
        for place, (name, key) in enumerate(_SETTINGS.items(), start=1):
            if name != "category":
                samples.insert(place, name, OmegaConf.select(config, key))
        parts.append(samples)
    if not parts:
        raise DataError(
            f"no run has been evaluated under protocol {protocol}: python evaluate.py "
            f"run=RUN_DIR protocol={protocol}"
        )
    return pd.concat(parts, ignore_index=True)


def load_settings(runs: Iterable[RunFolder]) -> pd.DataFrame:
    """Read the settings of runs into one table: a row per run (index `run`), a column per key.

    Keys are as on the command line: `regime.entropy_weight`.
    """
    rows = {}
    for run in runs:
        config = OmegaConf.to_container(OmegaConf.load(run.config))
        flat = pd.json_normalize(config).iloc[0].to_dict() if isinstance(config, dict) else {}
        rows[str(run.path)] = flat
    return pd.DataFrame.from_dict(rows, orient="index").rename_axis("run")
