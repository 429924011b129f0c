"""Evaluation under the paper's protocol: samples a second, and parts against other libraries."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
import trimesh
from scipy.optimize import linear_sum_assignment, minimize
from scipy.spatial.distance import cdist

from benchmarks.timing import Row, compete, seconds_of
from benchmarks.training_step import build
from ffd_lightning.evaluation.protocols import PaperProtocol
from ffd_lightning.evaluation.shapes import Cloud, PreparedShape, Surface, TemplateShape
from ffd_lightning.geometry.hemisphere import bounding_hemisphere
from ffd_lightning.geometry.voxels import PAPER_HALF_SIZE, voxelize
from ffd_lightning.metrics import earth_movers_distance
from ffd_lightning.parallel import available_cores, in_threads

_SECTION = "evaluation"


def measure(quick: bool) -> list[Row]:
    """Time whole samples on all cores, then each part on one core against its peers."""
    count, rounds = (8, 2) if quick else (48, 7)
    with tempfile.TemporaryDirectory() as folder:
        _, data = build(Path(folder))
        pairs = []
        for k in range(count):
            offsets = np.random.default_rng(k).normal(0, 0.03, (64, 3)).astype(np.float32)
            template = TemplateShape(data.bank, k % len(data.bank), offsets)
            pairs.append((template, PreparedShape(data.prepared, k)))
        rows = [_throughput(pairs, rounds)]
        torch.set_num_threads(1)
        for part in (_emd, _voxels, _hemisphere):
            rows += part(pairs, rounds)
        torch.set_num_threads(os.cpu_count() or 1)
    return rows


def _throughput(pairs: list[tuple[TemplateShape, PreparedShape]], rounds: int) -> Row:
    protocol, workers = PaperProtocol(), available_cores()

    def score(k: int) -> dict[str, float]:
        rng = np.random.default_rng(k)
        return protocol.score(pairs[k][0], protocol.truth(pairs[k][1], rng), rng)

    def everything() -> None:
        list(in_threads(score, range(len(pairs)), workers))

    everything()  # compiles
    times = [seconds_of(everything) for _ in range(rounds)]
    note = f"Chamfer + EMD + IoU: {len(pairs) / min(times):.1f} samples/s with {workers} threads"
    return Row(_SECTION, "one sample of protocol paper", min(times) / len(pairs), note=note)


def _clouds(pairs: list[tuple[TemplateShape, PreparedShape]]) -> list[tuple[Cloud, Cloud]]:
    draws = [np.random.default_rng(k) for k in range(4)]
    return [(a.cloud(1024, g), b.cloud(1024, g)) for (a, b), g in zip(pairs, draws, strict=False)]


def _emd(pairs: list[tuple[TemplateShape, PreparedShape]], rounds: int) -> list[Row]:
    def scipy(a: Cloud, b: Cloud) -> None:
        distances = cdist(a, b)
        distances[linear_sum_assignment(distances)].mean()

    ours = "ffd_lightning (POT)"
    candidates = {ours: earth_movers_distance, "scipy": scipy}
    return _compete("EMD of 1,024 points", ours, candidates, _clouds(pairs), rounds)


def _voxels(pairs: list[tuple[TemplateShape, PreparedShape]], rounds: int) -> list[Row]:
    """Conservative and filled against trimesh's sampled surface, which misses thin crossings."""

    def by_trimesh(vertices: Cloud, faces: Cloud) -> None:
        trimesh.Trimesh(vertices, faces, process=False).voxelized(1 / 32).fill()

    candidates: dict[str, Callable[..., object]] = {
        "ffd_lightning": lambda v, f: voxelize(v, f, 32, half_size=PAPER_HALF_SIZE),
        "trimesh (not conservative)": by_trimesh,
    }
    meshes = [template.mesh() for template, _ in pairs[:4]]
    faces = round(np.mean([len(faces) for _, faces in meshes]))
    name = f"32^3 voxels of subdivided templates, {faces:,} faces in the mean"
    return _compete(name, "ffd_lightning", candidates, meshes, rounds)


def _hemisphere(pairs: list[tuple[TemplateShape, PreparedShape]], rounds: int) -> list[Row]:
    def local(vertices: Cloud) -> None:
        raised = vertices - vertices.min(0) * (0, 1, 0)

        def radius(center: Cloud) -> float:
            return float(((raised - (center[0], 0, center[1])) ** 2).sum(1).max())

        minimize(radius, np.zeros(2), method="BFGS")

    candidates = {"ffd_lightning (exact)": bounding_hemisphere, "BFGS (local)": local}
    meshes = [(template.mesh()[0],) for template, _ in pairs[:4]]
    return _compete("hemisphere", "ffd_lightning (exact)", candidates, meshes, rounds)


def _compete(
    section: str,
    ours: str,
    candidates: dict[str, Callable[..., object]],
    inputs: list[tuple[Cloud, Cloud]] | list[Surface] | list[tuple[Cloud]],
    rounds: int,
) -> list[Row]:
    """Time candidates on all inputs; seconds are per input."""

    def on_all(function: Callable[..., object]) -> Callable[[], object]:
        return lambda: [function(*arguments) for arguments in inputs]

    rows = compete(
        f"{_SECTION}: {section}", ours, {k: on_all(f) for k, f in candidates.items()}, rounds
    )
    for row in rows:
        if row.seconds is not None and row.median is not None:
            row.seconds, row.median = row.seconds / len(inputs), row.median / len(inputs)
    return rows
