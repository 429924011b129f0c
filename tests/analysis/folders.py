"""Run folders that are made up, as training and evaluation leave them."""

import json

from analysis.made import PAPER

from ffd_lightning.files import write_csv
from ffd_lightning.run_folder import RunFolder


def write_run(
    folder,
    regime="b",
    templates=4,
    seed=0,
    category="table",
    protocol=PAPER,
    settings="",
    **columns,
):
    """Write a finished run without a checkpoint; a column is a value for all samples, or a list."""
    run = RunFolder(folder)
    run.path.mkdir(parents=True)
    run.config.write_text(
        f"category: {{name: {category}}}\nregime: {{name: {regime}}}\n"
        f"templates: {{count: {templates}}}\nseed: {seed}\n{settings}"
    )
    place = run.evaluation(protocol.name)
    given = {m.name: 0.5 for m in protocol.metrics} | {"family": "", "template": "x"} | columns
    count = max((len(x) for x in given.values() if isinstance(x, list)), default=2)
    summary = {"protocol": protocol.to_json(), "num_samples": count}
    rows = [
        {"id": f"{k:03}", "category": category, "view": 0}
        | {name: x[k] if isinstance(x, list) else x for name, x in given.items()}
        for k in range(count)
    ]
    write_csv(place / "samples.csv", rows)
    (place / "summary.json").write_text(json.dumps(summary))
    ended = {"name": protocol.name}
    run.set_status("finished", summary={"seconds_per_step": 0.5}, evaluation=ended)
    return run
