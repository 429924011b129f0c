"""Results that are made up."""

import pandas as pd

from ffd_lightning.analysis.naming import GROUP
from ffd_lightning.analysis.results import Results
from ffd_lightning.evaluation.protocols import PaperProtocol, ProtocolDescription

PAPER = ProtocolDescription.of(PaperProtocol())


def run_samples(n, regime="b", *, seed=0, category="table", templates=16, **columns):
    """The samples of one run, n of them."""
    return pd.DataFrame(
        {
            "run": f"{category}/{regime}/t{templates}/seed{seed}",
            "regime": regime,
            "templates": templates,
            "variant": "",
            "seed": seed,
            "id": [f"m{k:05}" for k in range(n)],
            "category": category,
            "family": None,
            "view": 0,
            "template": "x",
            **columns,
        }
    )


def results(*samples, protocol=PAPER, families=None, **settings):
    """Results of runs; a setting is a value for each run, by its name with __ for dots."""
    samples = pd.concat(samples, ignore_index=True)
    runs = samples[["run", *GROUP, "seed"]].drop_duplicates("run")
    runs = runs.assign(state="finished", reason="", seconds_per_step=0.5)
    columns = {key.replace("__", "."): values for key, values in settings.items()}
    table = pd.DataFrame(columns, index=runs["run"])
    return Results(samples, runs, table, protocol, families or {}, pd.DataFrame())
