"""Score a network that is told its templates against the number of meshes that one has.

    python docs/tools/own_meshes.py MESHES RUN OUT

MESHES is a folder of chairs, say, that `docs/tools/furniture.py` has sorted; RUN a run of
heads=conditioned on generated shapes; OUT a folder for what is trained. A third of the meshes is
tested on. Of the others, so many as `COUNTS` says are one's own: they are the templates. RUN's
network is scored as it is, and after 200 steps of training on the own meshes, with variants of
them and without; beside it the own mesh whose image is most alike to its encoder. It prints a table
and draws `OUT/own-meshes.png`. The same command resumes.
"""

import hashlib
import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import matplotlib.pyplot as plt
import pandas as pd

from ffd_lightning.run_folder import RunFolder

COUNTS, SEEDS = (5, 10, 20, 40), (0, 1, 2)
STEPS = 200
METRICS = ["chamfer", "emd", "iou"]
CURVES = {
    "": "the network as it is",
    "variants": f"trained for {STEPS} steps, with variants",
    "plain": f"trained for {STEPS} steps, without",
    "feature_retrieval_": "the template of the most similar image, as it is",
    "best_undeformed_": "the nearest template as it is, an oracle",
}
"""What is drawn; of what is scored beside a network, the beginning of its scores' names."""
_SHARE = 3  # one of so many is tested on


def main(meshes: Path, start: Path, out: Path) -> None:
    """See the top of this file."""

    def position(shape: Path) -> str:
        return hashlib.sha256(shape.name.encode()).hexdigest()

    shapes = sorted(meshes.iterdir(), key=position)
    tested, own = shapes[: len(shapes) // _SHARE], shapes[len(shapes) // _SHARE :]
    rows = []
    for count in COUNTS:
        root, templates = out / f"meshes-{count}", out / f"templates-{count}"
        link((*tested, *own[:count]), root / meshes.name)
        link(own[:count], templates)
        listed = out / "tested.txt"
        listed.write_text("".join(f"{shape.name}\n" for shape in tested))
        for seed in SEEDS:
            for name, variants in (("variants", "auto"), ("plain", "0")):
                run = _train(start, root, listed, out, count, seed, variants)
                scores = score(run, ("templates=train", "evaluation.references=false"))
                rows.append([count, name, seed, *scores[METRICS].mean()])
        name = json.loads((run.path / "data.json").read_text())["prepared"][meshes.name]
        other = f"prepared={out / 'data' / 'prepared' / name}"  # what is a template is not tested
        scores = score(RunFolder(start), (f"templates={templates}", "yaw=180", other))
        for of in ("", "feature_retrieval_", "best_undeformed_"):
            rows.append([count, of, 0, *scores[[f"{of}{name}" for name in METRICS]].mean()])
        print(f"{count} own meshes: done", flush=True)
    table = pd.DataFrame(rows, columns=["count", "curve", "seed", *METRICS])
    table[METRICS] *= 1000
    table.to_csv(out / "own-meshes.csv", index=False)
    _draw(table, out / "own-meshes.png", f"{len(tested)} real {meshes.name}s that are tested on")
    print(table.groupby(["curve", "count"])[METRICS].agg(["mean", "std"]).round(1).to_string())


def link(shapes: Sequence[Path], folder: Path) -> None:
    """Make a folder of links to shapes."""
    folder.mkdir(parents=True, exist_ok=True)
    for shape in shapes:
        if not (folder / shape.name).is_symlink():
            (folder / shape.name).symlink_to(shape.resolve())


def _train(
    start: Path, root: Path, listed: Path, out: Path, count: int, seed: int, variants: str
) -> RunFolder:
    """Train on own meshes, from another run's network on."""
    (category,) = root.iterdir()
    settings = (
        *(f"category={category.name}", "data=folder", f"data.root={root}", "data.yaw=180"),
        *(f"data.variants={variants}", "split=listed", f"split.file={listed}"),
        *("heads=conditioned", "regime=posterior", "templates=t4", f"network.weights={start}"),
        *(f"schedule.steps={STEPS}", f"seed={seed}", "evaluation.references=false"),
        *(f"name={count}-{variants}", f"paths.runs={out / 'runs'}", f"paths.data={out / 'data'}"),
    )
    _ffd("train", *settings)
    (found,) = (out / "runs" / f"{count}-{variants}").glob(f"*/*/*/seed{seed}*")
    return RunFolder(found)


def score(run: RunFolder, settings: Sequence[str]) -> pd.DataFrame:
    """Return the scores of a run's network with other templates than its own."""
    said = _ffd("evaluate", f"run={run.path}", *settings)
    return pd.read_csv(Path(said.split()[-1]) / "samples.csv")


def _ffd(*arguments: str) -> str:
    """Run a command; return what it prints."""
    command = [sys.executable, "-m", "ffd_lightning", *arguments]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def _draw(table: pd.DataFrame, file: Path, title: str) -> None:
    figure, axes = plt.subplots(figsize=(6, 4), layout="constrained")
    for curve, label in CURVES.items():
        found = table[table["curve"] == curve].groupby("count")["chamfer"].agg(["mean", "std"])
        axes.errorbar(found.index, found["mean"], found["std"], marker="o", capsize=3, label=label)
    axes.set(xscale="log", xlabel="own meshes, which are the templates", title=title)
    axes.set_xticks(COUNTS, map(str, COUNTS))
    axes.minorticks_off()
    axes.set_ylabel("Chamfer distance x 1000 (protocol paper)")
    axes.legend(frameon=False)
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    main(*map(Path, sys.argv[1:]))
