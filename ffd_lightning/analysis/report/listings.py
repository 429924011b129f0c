"""Sections: settings of the runs, and runs without results."""

from __future__ import annotations

from ffd_lightning.analysis.report import fragments as html
from ffd_lightning.analysis.report.sweep import Sweep, varying

_MANY = 12  # rows that are shown unasked
# Where a run is made, not what it computes.
_MACHINE = (
    "trainer.",
    "preparation.",
    "paths.",
    "logger.",
    "callbacks.",
    "evaluation.",
    "restart",
    "name",
    "data.residency",
    "data.root",
    "data.images_root",
    "data.parts_root",
)


def settings(sweep: Sweep) -> str:
    """Return the settings in which runs differ, and those that all share."""
    table = sweep.settings
    kept = [k for k in table if not any(k == m or k.startswith(m) for m in _MACHINE)]
    shown = table[kept].map(html.cell)
    different = varying(shown, kept)
    shared = [f"{key}={shown[key].iloc[0]}" for key in sorted(set(kept) - set(different))]
    rows = [
        [sweep.name(str(run)), *(row[key] for key in different)] for run, row in shown.iterrows()
    ]
    main = (
        html.table("Settings that differ", ["run", *different], rows)
        if different
        else html.paragraph("All runs have the same settings.")
    )
    if len(rows) > _MANY:
        main = html.details(f"{len(rows)} runs differ in {', '.join(different)}", main)
    return html.section(
        "settings",
        "Settings",
        main,
        html.details(f"{len(shared)} settings that all runs share", html.items(shared)),
    )


def missing(sweep: Sweep) -> str:
    """Return the runs that are not in the results, and why."""
    rows = [
        [sweep.name(row["run"]), row["state"], str(row["reason"])]
        for row in sweep.unscored.to_dict("records")
    ]
    rows += [[name, "damaged", why] for name, why in sweep.damaged.items()]
    if not rows:
        return ""
    return html.section(
        "missing",
        "Runs without results",
        html.table("Runs without results", ["run", "state", "reason"], rows, text=["reason"]),
    )
