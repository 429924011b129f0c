"""A guess at how a set's shapes should be turned, where they do not stand as they should.

Shapes of the paper's 13 categories are held against embedded ones, which are known to stand right:
in the right pose a shape is nearest to one of them. Of other categories there is only symmetry.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from ffd_lightning import shapes
from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.reading.frame import Up, turn
from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.geometry.sampling import sample_surface

SHAPES = 24
"""Clouds that a guess is made from; more tell hardly more."""

_POINTS = 256
_REFERENCES = 32  # embedded shapes of a category
_MIN_SHAPES = 4
# On embedded shapes turned on purpose, 24 at a time: 95% of wrong `up` and of quarter turns are
# found, half of the half turns, and none that stands right is called wrong; where all references
# are of other families than the shapes, 84%, a quarter, and none.
_GAIN = 1.5  # times nearer, in squared distance, that shapes must come
_CERTAINTY = 3.0  # standard errors that the mean gain must be above zero
_RIVAL = 1.25  # poses that come as near as this are named too
_SYMMETRY_GAIN = 2.0


_ALIKE = {"rifle": "firearm", "telephone": "cellphone"}


def embedded_category(category: str) -> str:
    """Return the embedded category that is of the same objects, "" if there is none.

    >>> embedded_category("03001627"), embedded_category("rifle"), embedded_category("mug")
    ('chair', 'firearm', '')
    """
    names = {synset: name for name, synset in SYNSETS.items()}
    name = names.get(category, category)
    name = _ALIKE.get(name, name)
    return name if name in shapes.categories() else ""


@dataclass(frozen=True)
class PoseGuess:
    """Settings under which shapes would stand more like they should than under the present ones.

    Attributes:
        poses: (up, yaw in degrees) each, the likeliest first; several where they fit alike.
        gain: how many times nearer shapes come to known ones, in squared distance; of their mirror
            images where the category is not known.
        known: whether the category is one that there are embedded shapes of.
    """

    poses: tuple[tuple[Up, float], ...]
    gain: float
    known: bool


def guess_pose(
    clouds: Sequence[NDArray[np.floating]], category: str, up: Up = "y", yaw: float = 0.0
) -> PoseGuess | None:
    """Return how shapes should be turned, None where they stand well or nothing can be said.

    Args:
        clouds: points on the surface of each shape, (N, 3), box diagonal 1, as turned by `up` and
            `yaw`; the first 256 points of up to 24 shapes are used.
        category: of the shapes.
        up: the setting that they were turned by.
        yaw: the setting, degrees.
    """
    places = np.unique(np.linspace(0, len(clouds) - 1, min(len(clouds), SHAPES)).astype(int))
    chosen = [np.asarray(clouds[k][:_POINTS], np.float64) for k in places]
    if len(chosen) < _MIN_SHAPES:
        return None
    known = embedded_category(category)
    poses = _poses(yaw)
    if not known:  # a mirror image tells front and side apart, and not up from down
        poses = [(up, yaw), (up, (yaw + 90) % 360), (up, (yaw + 270) % 360)]
    back = turn(np.eye(3), up, yaw).T
    turns = [back @ turn(np.eye(3), *pose) for pose in poses]
    costs = np.log([_known_costs(c, known, turns) if known else _asymmetry(c) for c in chosen])
    present = poses.index((up, yaw))
    gains = costs[:, [present]] - costs
    best = int(gains.mean(axis=0).argmax())
    mean = float(gains[:, best].mean())
    error = float(gains[:, best].std(ddof=1)) / len(chosen) ** 0.5
    if mean < np.log(_GAIN if known else _SYMMETRY_GAIN) or mean < _CERTAINTY * error:
        return None
    ranked = [k for k in (-gains.mean(axis=0)).argsort(kind="stable") if k != present]
    near = [k for k in ranked if mean - gains[:, k].mean() <= np.log(_RIVAL)]
    return PoseGuess(tuple(poses[k] for k in near), float(np.exp(mean)), bool(known))


def _poses(yaw: float) -> list[tuple[Up, float]]:
    """Return the poses to try: either axis up, and quarter turns from the present yaw."""
    ups: tuple[Up, Up] = ("y", "z")
    return [
        (up, yaw if turned == 0 else (yaw + turned) % 360)
        for up in ups
        for turned in (0, 90, 180, 270)
    ]


def _known_costs(
    cloud: NDArray[np.float64], category: str, turns: Sequence[NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Return the Chamfer distance of a cloud, turned, to the embedded shape nearest to it, (K,)."""
    tree, count = KDTree(cloud), len(turns)
    turned = np.concatenate([cloud @ matrix for matrix in turns])
    costs = []
    for reference, reference_tree in _references(category):
        # Turning the reference back spares a tree for each turn of the cloud.
        unturned = np.concatenate([reference @ matrix.T for matrix in turns])
        there, back = reference_tree.query(turned)[0], tree.query(unturned)[0]
        costs.append(
            (there.reshape(count, -1) ** 2).mean(axis=1) + (back.reshape(count, -1) ** 2).mean(1)
        )
    return np.asarray(np.min(costs, axis=0), np.float64)


@cache
def _references(category: str) -> tuple[tuple[NDArray[np.float64], KDTree], ...]:
    """Return clouds of embedded shapes, (256, 3) each, and their trees."""
    clouds = []
    for index in range(_REFERENCES):
        mesh, _ = shapes.build(category, index)
        vertices = normalize(mesh.vertices, mesh.faces)
        rng = np.random.default_rng(index)
        clouds.append(sample_surface(vertices, mesh.faces, _POINTS, rng)[0].astype(np.float64))
    return tuple((cloud, KDTree(cloud)) for cloud in clouds)


def _asymmetry(cloud: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far a cloud is from its mirror image in x; in z, which is x after a turn, twice.

    Objects that face -z have their two sides alike. One half of the points is mirrored and held
    against the other: points in the mirror's plane, as all of a flat object's, would be their own.
    """
    tree, others = KDTree(cloud[::2]), cloud[1::2]
    in_x, in_z = (
        float((tree.query(others * mirror)[0] ** 2).mean()) for mirror in ((-1, 1, 1), (1, 1, -1))
    )
    return np.array([in_x, in_z, in_z])
