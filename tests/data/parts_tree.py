"""Miniature part annotations of procedural shapes, as the benchmark with normals has them."""

import functools

import numpy as np

from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.geometry.sampling import sample_surface

SYNSETS = {"chair": "03001627", "plane": "02691156", "table": "04379243"}
FIRST = {"chair": 12, "plane": 0, "table": 47}  # each category's first label among all 50
SOURCE = ProceduralSource(100)


@functools.cache
def shape_of(category, index):
    """A mesh with at most as many parts as the benchmark has for it: the rest are one."""
    mesh = SOURCE.load(category, f"{category}-{index:06d}").mesh
    most = {"chair": 4, "plane": 4, "table": 3}[category]
    return mesh, np.minimum(mesh.face_parts, most - 1), mesh.part_names[:most]


@functools.cache
def annotate(category, index, turns=0, noise=0.003, count=2500, seed=0):
    """Return points on the mesh, the same turned, noisy and scaled to a sphere, and labels."""
    mesh, parts, _ = shape_of(category, index)
    rng = np.random.default_rng([seed, index])
    points, faces = sample_surface(mesh.vertices, mesh.faces, count, rng)
    x, y, z = points.astype(float).T
    for _ in range(turns):
        x, z = z, -x
    own = np.stack([x, y, z], axis=1)
    own += rng.normal(size=own.shape) * noise * np.linalg.norm(np.ptp(own, axis=0))
    own -= own.mean(axis=0)
    own /= np.linalg.norm(own, axis=1).max()
    return points, own + (0.1, -0.2, 0.05), parts[faces]


def annotation(category, points, labels):
    """Return the text of a shape's file."""
    rows = np.column_stack([points, np.zeros_like(points), labels + FIRST[category]])
    return "".join(" ".join(f"{x:.6f}" for x in row) + "\n" for row in rows)


def tree(category, indices, turns=0):
    """Return {path: text} of shapes `m0`, `m1`..."""
    shapes = {k: annotate(category, k, turns)[1:] for k in indices}
    top = SYNSETS[category]
    return {f"{top}/m{k}.txt": annotation(category, *shape) for k, shape in shapes.items()}
