"""Scales of other papers, as data: what they scale by, and what they report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ffd_lightning.metrics.surface import SurfaceSample, surface_scores


@dataclass(frozen=True)
class Scaling:
    """The scale and the numbers that another paper reports.

    Attributes:
        rule: "factor" multiplies coordinates (of meshes whose box has the diagonal 1) by `size`;
            "longest_side" makes the longest side of the target's box `size`; "radius" makes the
            greatest distance of a target point from the mean of the target points `size`.
        size: see `rule`.
        thresholds: of the F-score, for unsquared distances after scaling.
        num_points: drawn from either surface.
        reported: printed name -> (name in `surface_scores`, factor that it is printed with).
        source: where this was read.
        unclear: what differs or is not settled; nothing is guessed for it.
    """

    rule: Literal["factor", "longest_side", "radius"]
    size: float
    thresholds: tuple[float, ...]
    num_points: int
    reported: dict[str, tuple[str, float]]
    source: str
    unclear: str


SCALINGS = {
    "pixel2mesh": Scaling(
        "factor",
        0.57,
        (1e-4**0.5, 2e-4**0.5),
        10_000,
        {
            "CD": ("chamfer_l2", 1000),
            "F(1e-4)": ("fscore@0.01", 100),
            "F(2e-4)": ("fscore@0.0141421", 100),
        },
        "nywang16/Pixel2Mesh eval_testset.py; facebookresearch/meshrcnn evaluate_test_p2m",
        "Pixel2Mesh itself scores its 2,466 vertices against all points of its data, Mesh R-CNN "
        "10,000 points of either surface. Its EMD is an approximate matching: not given here.",
    ),
    "atlasnet": Scaling(
        "radius",
        1.0,
        (1e-3**0.5,),
        2500,
        {"chamfer": ("chamfer_l2", 1), "fscore": ("fscore@0.0316228", 1)},
        "ThibaultGROUEIX/AtlasNet of 2019: trainer_loss.py, fscore.py, argument_parser.py",
        "Values as the code logs them: what the paper's tables multiply by, and how many points "
        "they take, was not checked. Its targets are points seen from outside, without interiors.",
    ),
    "mesh_rcnn": Scaling(
        "longest_side",
        10.0,
        (0.1, 0.3, 0.5),
        10_000,
        {
            "Chamfer": ("chamfer_l2", 1),
            "Normal": ("normal_consistency", 1),
            "F1(0.1)": ("fscore@0.1", 100),
            "F1(0.3)": ("fscore@0.3", 100),
            "F1(0.5)": ("fscore@0.5", 100),
        },
        "facebookresearch/meshrcnn meshrcnn/utils/metrics.py, shapenet/evaluation/eval.py",
        "",
    ),
    "occnet": Scaling(
        "longest_side",
        10.0,
        (),
        100_000,
        {"Chamfer-L1": ("chamfer_l1", 1), "Normal Consistency": ("normal_consistency", 1)},
        "autonomousvision/occupancy_networks im2mesh/eval.py and issue 61: a tenth of the longest "
        "side is the unit, so values at side 1 are printed times 10",
        "Its targets are watertight remeshings, without interiors; ours are the shapes' surfaces.",
    ),
}
"""Scales of other papers. Their splits, images and meshes differ too: comparable, not equal."""


def score_like(
    name: str, pred: SurfaceSample, target: SurfaceSample, target_side: float | None = None
) -> dict[str, float]:
    """Score one pair at another paper's scale, under its names and factors.

    Args:
        name: one of `SCALINGS`.
        pred: points (N, 3) in the frame of meshes whose box has the diagonal 1, with normals where
            the paper reports their consistency.
        target: the same of the target.
        target_side: longest side of the target mesh's box; that of its points, a little shorter,
            when None.

    Raises:
        ValueError: no such name, normals missing, a target without extent.

    >>> line = SurfaceSample(np.array([[0.0, 0, 0], [0, 0, 1]]), np.eye(3)[:2])
    >>> moved = SurfaceSample(line.points + [0.02, 0, 0], line.normals)
    >>> {k: round(v, 6) for k, v in score_like("mesh_rcnn", moved, line).items()}
    {'Chamfer': 0.08, 'Normal': 1.0, 'F1(0.1)': 0.0, 'F1(0.3)': 100.0, 'F1(0.5)': 100.0}
    """
    if name not in SCALINGS:
        raise ValueError(f"no scaling {name!r}: use one of {sorted(SCALINGS)}")
    scaling, points = SCALINGS[name], target.points
    extent = {
        "factor": 1.0,
        "longest_side": target_side or np.ptp(points, axis=0).max(),
        "radius": np.linalg.norm(points - points.mean(0), axis=1).max(),
    }[scaling.rule]
    if not extent > 0:
        raise ValueError("the target has no extent to scale by")
    factor = scaling.size / extent
    scaled = pred._replace(points=factor * pred.points)
    scores = surface_scores(scaled, target._replace(points=factor * points), scaling.thresholds)
    missing = {score for score, _ in scaling.reported.values()} - scores.keys()
    if missing:
        raise ValueError(f"{name} reports {sorted(missing)}: give both samples normals")
    return {k: scores[score] * times for k, (score, times) in scaling.reported.items()}
