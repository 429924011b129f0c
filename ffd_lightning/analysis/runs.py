"""Finding and reading run folders."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pandas as pd
from omegaconf import OmegaConf

from ffd_lightning.run_folder import RunFolder


def find_runs(root: Path) -> list[RunFolder]:
    """Return all run folders below a path, in order of their names."""
    return [RunFolder(path.parent) for path in sorted(root.rglob("config.yaml"))]


def load_runs(runs: Iterable[RunFolder]) -> pd.DataFrame:
    """Read runs into one table, a row each.

    Columns: `run` (path), `category`, `regime`, `templates`, `seed`, `state`, `reason` (of a
    failure), `protocol` and, for finished runs, everything of their summary under it.
    """
    rows = []
    for run in runs:
        config = OmegaConf.load(run.config)
        status = run.status
        rows.append(
            {
                "run": str(run.path),
                "category": OmegaConf.select(config, "category.name"),
                "regime": OmegaConf.select(config, "regime.name"),
                "templates": OmegaConf.select(config, "templates.count"),
                "seed": OmegaConf.select(config, "seed"),
                "state": status.get("state", "unknown"),
                "reason": status.get("reason", ""),
                "protocol": OmegaConf.select(config, "evaluation.protocol", default="paper"),
                **(status.get("summary") or {}),
            }
        )
    return pd.DataFrame(rows)
