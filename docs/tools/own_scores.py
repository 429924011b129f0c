"""Score networks that are told real meshes: each is rebuilt from four fifths of the others.

    python docs/tools/own_scores.py MESHES SET RUN...

MESHES is a folder of chairs, say, that `docs/tools/furniture.py` has sorted; SET the folder of the
same shapes that `ffd prepare` has made; RUN a run of heads=conditioned on generated shapes. Five
times, a fifth of the meshes is tested on with the others as templates. It prints mean scores
x 1000, and differences to the network with bootstrap intervals of 95% over the shapes, of which
the runs are averaged. The same command resumes.
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pandas as pd
from own_meshes import METRICS, link, score
from scipy.stats import bootstrap

from ffd_lightning.run_folder import RunFolder

FOLDS = 5
BEST = "the best of the deformed templates, an oracle"
OTHERS = {
    "best_undeformed_": "the nearest template as it is, an oracle",
    "feature_retrieval_": "the template of the most similar image",
}


def main(meshes: Path, prepared: Path, runs: list[Path]) -> None:
    """See the top of this file."""
    shapes, found = sorted(meshes.iterdir()), []
    with TemporaryDirectory() as folder:
        for fold in range(FOLDS):
            templates = Path(folder) / f"templates-{fold}"
            link([s for k, s in enumerate(shapes) if k % FOLDS != fold], templates)
            settings = (f"templates={templates}", "yaw=180", f"prepared={prepared}")
            found += [score(RunFolder(run), settings) for run in runs]
    scores = 1000 * pd.concat(found).groupby("id").mean(numeric_only=True)
    print(f"{len(scores)} shapes, {len(runs)} runs\n")
    print("| | Chamfer ↓ | EMD ↓ | IoU ↑ |\n|---|---:|---:|---:|")
    for of, title in {"": "the network", "best_deformed_": BEST, **OTHERS}.items():
        _row(title, [f"{scores[of + m].mean():.1f}" for m in METRICS])
        if of in OTHERS:
            _row("difference", [_difference(scores[m] - scores[of + m]) for m in METRICS])


def _row(title: str, cells: list[str]) -> None:
    print("|", " | ".join([title, *cells]), "|")


def _difference(values: pd.Series) -> str:
    low, high = bootstrap((values,), np.mean, rng=0).confidence_interval
    text = f"{values.mean():+.1f} [{low:+.1f}, {high:+.1f}]"
    return f"**{text}**" if low * high > 0 else text


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]), [Path(run) for run in sys.argv[3:]])
