"""Preparing shapes, evaluating samples, and how soon a run takes its first step."""

import contextlib
import io
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from benchmarks.timing import Row, compete, seconds_of
from benchmarks.training_step import build
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.evaluation.candidates import PreparedShape, TemplateShape
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.metrics.emd import earth_movers_distance
from ffd_lightning.parallel import available_cores, in_threads

_FIRST_STEP = """
import os, runpy, sys
from ffd_lightning.training.callbacks import Clock
Clock.on_train_batch_end = lambda *_: os._exit(0)
sys.argv[0] = "train.py"
runpy.run_path("train.py", run_name="__main__")
"""


def preparation(quick: bool) -> list[Row]:
    """Time shapes of the embedded dataset: one view of 192 x 256 and 16,384 points each."""
    rows = []
    for category in ("table",) if quick else ("table", "chair", "car"):
        source = ProceduralSource(20 if quick else 200)
        with tempfile.TemporaryDirectory() as root, contextlib.redirect_stderr(io.StringIO()):
            start = time.perf_counter()
            prepared = Preparation(source, category, 16384, RenderSettings(), Path(root)).run()
            seconds = (time.perf_counter() - start) / len(prepared)
        rows.append(Row("preparation", f"a {category}", seconds, note=f"{1 / seconds:.1f}/s"))
    return rows


def evaluation(quick: bool) -> list[Row]:
    """Time samples of protocol paper on all cores, and its EMD against scipy's."""
    count, rounds = (8, 2) if quick else (48, 7)
    protocol, workers = PaperProtocol(), available_cores()
    with tempfile.TemporaryDirectory() as folder:
        _, data = build(Path(folder))
        pairs = []
        for k in range(count):
            offsets = np.random.default_rng(k).normal(0, 0.03, (64, 3)).astype(np.float32)
            template = TemplateShape(data.bank, k % len(data.bank), offsets)
            pairs.append((template, PreparedShape(data.prepared, k)))

        def score(k: int) -> dict[str, float]:
            rng = np.random.default_rng(k)
            return protocol.score(pairs[k][0], protocol.truth(pairs[k][1], rng), rng)

        def everything() -> None:
            list(in_threads(score, range(count), workers))

        everything()  # compiles
        seconds = min(seconds_of(everything) for _ in range(rounds)) / count
        note = f"Chamfer + EMD + IoU: {1 / seconds:.1f} samples/s with {workers} threads"
        clouds = [shape.cloud(1024, np.random.default_rng(0)) for shape in pairs[0]]

    def scipy() -> None:
        distances = cdist(*clouds)
        distances[linear_sum_assignment(distances)].mean()

    emd = {"ffd_lightning": (lambda: earth_movers_distance(*clouds), 1.0), "scipy": (scipy, 1.0)}
    whole = Row("evaluation", "one sample of protocol paper", seconds, note=note)
    return [whole, *compete("EMD of 1,024 points", emd, rounds)]


def start(quick: bool) -> list[Row]:
    """Time processes: to the first step, to the help text, and what they cannot avoid importing."""
    with tempfile.TemporaryDirectory() as name:
        run = [f"paths.data={name}/data", f"paths.runs={name}/runs", "schedule=paper"]
        run += ["data.num_models=60", "encoder.weights=none", "trainer.progress_bar=false"]
        commands = {
            "train.py, prepared data, to the end of step 1": ["-c", _FIRST_STEP, *run],
            "import torch, lightning": ["-c", "import torch, lightning"],
            "train.py --help": ["train.py", "--help"],
        }
        # The first round, not counted, prepares the data and fills the system's caches.
        candidates = {title: (_process(arguments), 1.0) for title, arguments in commands.items()}
        return compete("start", candidates, 1 if quick else 4)


class _process:
    """Runs Python with arguments."""

    def __init__(self, arguments: list[str]) -> None:
        self._command = [sys.executable, *arguments]

    def __call__(self) -> None:
        done = subprocess.run(self._command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr[-500:])
