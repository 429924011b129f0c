"""Score networks that are told real meshes: each is rebuilt from four fifths of the others.

    python docs/tools/own_scores.py MESHES SET RUN...

MESHES is a folder of chairs, say, that `docs/tools/furniture.py` has sorted; SET the folder of the
same shapes that `ffd prepare` has made; RUN a run of heads=conditioned on generated shapes. Five
times, a fifth of the meshes is tested on with the others as templates. It prints mean scores
x 1000, and differences to the network with intervals of 95% for other trainings and other shapes;
bold are those that are shown, corrected for their number, as in `analysis.compare`. The same
command resumes.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
from own_meshes import METRICS, link, score

from ffd_lightning.analysis.uncertainty import LEVEL, difference, holm
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
            found += [score(RunFolder(run), settings).assign(run=str(run)) for run in runs]
    print(table(pd.concat(found)))


def table(samples: pd.DataFrame) -> str:
    """Return a Markdown table of samples, a row per `run` and shape `id`; bold is what is shown."""
    scores = 1000 * samples.set_index(["id", "run"]).select_dtypes("number").unstack()
    left = {(of, m): scores[m] - scores[of + m] for of in OTHERS for m in METRICS}
    found = {key: difference([(x, 0 * x)])[0] for key, x in left.items()}
    p_values = dict(zip(found, holm([x.p_differs() for x in found.values()]), strict=True))

    def told(key: tuple[str, str]) -> str:
        low, high = found[key].interval
        text = f"{found[key].mean:+.1f} [{low:+.1f}, {high:+.1f}]"
        return f"**{text}**" if p_values[key] < LEVEL else text

    rows = ["| | Chamfer ↓ | EMD ↓ | IoU ↑ |", "|---|---:|---:|---:|"]
    for of, title in {"": "the network", "best_deformed_": BEST, **OTHERS}.items():
        rows.append(_row(title, [f"{scores[of + m].mean(axis=None):.1f}" for m in METRICS]))
        if of in OTHERS:
            rows.append(_row("difference", [told((of, m)) for m in METRICS]))
    return "\n".join(rows)


def _row(title: str, cells: list[str]) -> str:
    return f"| {' | '.join([title, *cells])} |"


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]), [Path(run) for run in sys.argv[3:]])
