"""Part labels carried from annotated points to a shape's mesh and to points on it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ffd_lightning.data.source import PartCloud
from ffd_lightning.geometry.mesh import UNKNOWN_PART
from ffd_lightning.geometry.sampling import sample_surface

_PLACES = 200_000  # on the surface, that vote for their faces

Points = NDArray[np.float64]


def label_points(parts: PartCloud, points: Points) -> NDArray[np.uint8]:
    """Return the label of the annotated point nearest to each of some points, (N, 3).

    Returns (N,) uint8, indices into `parts.names`, 255 where that is not known.
    """
    if len(parts.points) == 0:
        return np.full(len(points), UNKNOWN_PART, np.uint8)
    return np.asarray(parts.labels[cKDTree(parts.points).query(points)[1]], np.uint8)


def label_faces(parts: PartCloud, vertices: Points, faces: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return the label that covers most of each face (F, 3), (F,) uint8 as `label_points` does.

    A face asks the nearest annotated point at its centroid and at points drawn evenly over the
    surface, so that large and long faces are not labelled by what happens to be near their middle.
    """
    drawn, face = sample_surface(vertices, faces, _PLACES, np.random.default_rng(0))
    face = np.concatenate([np.arange(len(faces)), face])
    votes = label_points(parts, np.concatenate([vertices[faces].mean(axis=1), drawn]))
    labels, which = np.unique(votes, return_inverse=True)
    table = np.bincount(face * len(labels) + which, minlength=len(faces) * len(labels))
    return labels[table.reshape(len(faces), -1).argmax(axis=1)]
