"""Section: test samples to be looked at."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ffd_lightning.analysis.gallery import ExampleMaker, choose_runs, meshes_json
from ffd_lightning.analysis.plots import measure_title
from ffd_lightning.analysis.report import fragments as html
from ffd_lightning.analysis.report.sweep import Sweep
from ffd_lightning.errors import UserError

_MESH_BYTES = 2_600_000  # of all meshes before base64: a page of some 4 MB


def gallery(sweep: Sweep, data_root: Path | None, limit: int) -> tuple[str, str]:
    """Return the examples, and the meshes that they show as JSON."""
    scored = sweep.scored
    if scored.empty or limit < 1:
        return "", "{}"
    chosen = choose_runs(scored, limit, sweep.keys)
    measure = sweep.main_measure
    maker = ExampleMaker(measure, data_root, _MESH_BYTES // (6 * len(chosen)))
    runs = {str(run.path): run for run in sweep.runs}
    parts: list[str] = []
    meshes: dict[str, Any] = {}
    for name in chosen:
        samples = sweep.samples[sweep.samples["run"] == name]
        try:
            shown = maker.examples(runs[name], samples)
        except (UserError, OSError) as error:
            parts.append(
                html.paragraph(f"{sweep.labels[name]}: no examples, since {error}", "note")
            )
            continue
        meshes |= meshes_json(shown)
        parts.append(html.examples(sweep.title(name), shown, sweep.protocol))
    told = f"Best, median and worst test sample of each run by {measure_title(measure.name)}."
    if len(chosen) < len(scored):
        told += (
            f" Shown are {len(chosen)} of {len(scored)} runs: the first seed of each setting, and "
            f"of more than {limit} settings a spread at even distances (gallery=N shows more)."
        )
    if meshes:
        told += (
            " Meshes are simplified to travel in this page. Drag to turn them; pinch, or click and "
            "use the wheel, to zoom. Keys: arrows turn, + and - zoom, 0 resets."
        )
    return html.section("examples", "Examples", html.paragraph(told), *parts), json.dumps(meshes)
