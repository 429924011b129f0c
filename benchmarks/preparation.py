"""Preparing data, and how soon a run takes its first step."""

from __future__ import annotations

import contextlib
import io
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.timing import Row
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.source import Source
from ffd_lightning.data.sources.folder import FolderSource
from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.imaging.render_settings import RenderSettings

_POINTS = 16384
_FIRST_STEP = """
import os, runpy, sys
from ffd_lightning.training.callbacks import StepTimer
StepTimer.on_train_batch_end = lambda *_: os._exit(0)
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def measure(meshes: Path | None, quick: bool) -> list[Row]:
    """Return rates of preparation and times of starting."""
    return [*_rates(meshes, quick), *_starts(quick)]


def _rates(meshes: Path | None, quick: bool) -> list[Row]:
    section = "preparation, 1 view of 192 x 256 and 16,384 points a shape"
    rows = []
    with tempfile.TemporaryDirectory() as name:
        root = Path(name)
        for category in ("table",) if quick else ("table", "chair", "car"):
            count = 20 if quick else 200
            rows.append(
                _rate(section, f"procedural {category}s", ProceduralSource(count), category, root)
            )
        folder = meshes or _write_meshes(root / "meshes", 8 if quick else 100)
        title = "meshes of --meshes" if meshes else "OBJ files of 10,000 faces"
        own = _rate(section, title, FolderSource(folder), "all", root)
        rows += [own, _trimesh(section, folder / "all")]
    for row in rows:
        row.ratio = row.seconds / own.seconds if row.seconds and own.seconds else None
    return rows


def _rate(section: str, title: str, source: Source, category: str, root: Path) -> Row:
    start = time.perf_counter()
    with contextlib.redirect_stderr(io.StringIO()):
        prepared = Preparation(source, category, _POINTS, RenderSettings(), root).run()
    seconds = (time.perf_counter() - start) / len(prepared)
    faces = float(np.median([len(prepared.mesh(row).faces) for row in range(len(prepared))]))
    note = f"{1 / seconds:.1f} shapes a second, {len(prepared)} shapes, median {faces:,.0f} faces"
    return Row(section, title, seconds, seconds, note=note, extra={"faces": faces})


def _trimesh(section: str, folder: Path) -> Row:
    """Loading and sampling alone, in one process, with the library that everyone has."""
    models = sorted(folder.iterdir())[:30]
    start = time.perf_counter()
    for model in models:
        mesh = trimesh.load(next(model.glob("*.obj")), force="mesh")
        trimesh.sample.sample_surface(mesh, _POINTS)
    seconds = (time.perf_counter() - start) / len(models)
    note = f"one process, no image, no normalisation; {len(models)} shapes"
    return Row(section, "trimesh: load and sample", seconds, seconds, note=note)


def _write_meshes(root: Path, count: int) -> Path:
    """Write OBJ files of some 10,000 faces in six coloured pieces each."""
    rng = np.random.default_rng(0)
    for k in range(count):
        pieces = []
        for _ in range(6):
            piece = trimesh.creation.torus(0.3, 0.1, major_sections=42, minor_sections=20)
            piece.apply_transform(trimesh.transformations.random_rotation_matrix(rng.random(3)))
            piece.apply_translation(rng.uniform(-0.4, 0.4, 3))
            color = rng.integers(0, 255, 3).tolist()
            material = trimesh.visual.material.SimpleMaterial(diffuse=[*color, 255])
            uv = rng.random((len(piece.vertices), 2))
            piece.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
            pieces.append(piece)
        folder = root / "all" / f"model{k:03d}"
        folder.mkdir(parents=True)
        with contextlib.chdir(folder):
            trimesh.Scene(pieces).export("model.obj", mtl_name="model.mtl")
    return root


def _starts(quick: bool) -> list[Row]:
    """Time processes: to the first step, to the help text, and what they cannot avoid importing."""
    section = "start"
    models = "data.num_models=60"
    with tempfile.TemporaryDirectory() as name:
        run = [f"paths.data={name}/data", f"paths.runs={name}/runs", "schedule=paper", models]
        run += ["templates=t30", "encoder.weights=none", "trainer.progress_bar=false"]
        commands = {
            "python train.py, prepared data, to the end of step 1": ["-c", _FIRST_STEP, *run],
            "python -c 'import torch, lightning'": ["-c", "import torch, lightning"],
            "python train.py --help": ["train.py", "--help"],
            "python -c 'import hydra, omegaconf'": ["-c", "import hydra, omegaconf"],
        }
        times: dict[str, list[float]] = {title: [] for title in commands}
        for k in range(2 if quick else 5):
            for title, arguments in commands.items():
                seconds = _process(arguments)
                if k:  # the first prepares the data, compiles, and fills the system's caches
                    times[title].append(seconds)
    best = {title: min(values) for title, values in times.items()}
    titles = list(commands)
    rows = []
    for title, peer in ((titles[0], titles[1]), (titles[2], titles[3])):
        for name_ in (title, peer):
            values = times[name_]
            ratio = best[name_] / best[title]
            rows.append(Row(section, name_, best[name_], statistics.median(values), ratio))
    return rows


def _process(arguments: list[str]) -> float:
    command = [sys.executable, *arguments]
    if arguments[0] == "-c" and len(arguments) > 2:
        # The script reads its own name from argv[0].
        code = f"import sys; sys.argv[0] = 'train.py'\n{arguments[1]}"
        command = [sys.executable, "-c", code, *arguments[2:]]
    start = time.perf_counter()
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    seconds = time.perf_counter() - start
    if done.returncode:
        raise RuntimeError(f"{' '.join(arguments[:1])} failed: {done.stderr[-500:]}")
    return seconds
