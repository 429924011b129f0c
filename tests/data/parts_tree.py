"""Miniature part annotations of procedural shapes, in the three published layouts."""

import functools
import json

import numpy as np
from ffd_lightning.data.sources.parts import BENCHMARK, NORMAL, RELEASE

from ffd_lightning.data.sources.procedural import ProceduralSource
from ffd_lightning.geometry.sampling import sample_surface

SYNSETS = {"chair": "03001627", "plane": "02691156", "table": "04379243"}
LAYOUTS = (RELEASE, BENCHMARK, NORMAL)
FIRST = {"chair": 12, "plane": 0, "table": 47}  # each category's first label among all 50
SOURCE = ProceduralSource(100)


@functools.cache
def model(category, index):
    """A mesh with at most as many parts as the benchmarks have for it: the rest are one."""
    mesh = SOURCE.load(category, f"{category}-{index:06d}").mesh
    most = {"chair": 4, "plane": 4, "table": 3}[category]
    return mesh, np.minimum(mesh.face_parts, most - 1), mesh.part_names[:most]


@functools.cache
def annotate(category, index, turns=0, noise=0.003, count=2500, seed=0):
    """Return points on the mesh, the same turned, noisy and scaled to a sphere, and labels."""
    mesh, parts, _ = model(category, index)
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


def text(table):
    return "".join(" ".join(f"{x:.6g}" for x in np.atleast_1d(row)) + "\n" for row in table)


def release(synset, shape_id, points, labels, names, expert=None):
    """Return {path: text} in the layout of 2016; `expert` are numbers from 1 on, 0 for none."""
    files = {f"{synset}/points/{shape_id}.pts": text(points)}
    for k, name in enumerate(names):
        if (labels == k).any():
            files[f"{synset}/points_label/{name}/{shape_id}.seg"] = text(labels == k)
    if expert is not None:
        files[f"{synset}/expert_verified/points_label/{shape_id}.seg"] = text(expert)
    return files


def benchmark(synset, shape_id, points, labels):
    return {
        f"{synset}/points/{shape_id}.pts": text(points),
        f"{synset}/points_label/{shape_id}.seg": text(labels + 1),
    }


def with_normals(synset, shape_id, points, labels, first):
    rows = np.column_stack([points, np.zeros_like(points), labels + first])
    lines = (" ".join(f"{x:.6f}" for x in row) + "\n" for row in rows)
    return {f"{synset}/{shape_id}.txt": "".join(lines)}


def tree(layout, category, indices, turns=0):
    """Return {path: text} of shapes `m0`, `m1`..., the even ones expert-verified."""
    files = {}
    for k in indices:
        _, points, labels = annotate(category, k, turns)
        synset, names = SYNSETS[category], model(category, k)[2]
        if layout == RELEASE:
            expert = labels + 1 if k % 2 == 0 else None
            files |= release(synset, f"m{k}", points, labels, names, expert)
            files["metadata.json"] = metadata({synset: names})
        elif layout == BENCHMARK:
            files |= benchmark(synset, f"m{k}", points, labels)
        else:
            files |= with_normals(synset, f"m{k}", points, labels, FIRST[category])
            files["synsetoffset2category.txt"] = "".join(f"{n}\t{s}\n" for n, s in SYNSETS.items())
    return files


def metadata(names, key="lables"):
    return json.dumps({s: {"directory": s, key: list(n)} for s, n in names.items()})


def write(root, files):
    for path, content in files.items():
        target = root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content if isinstance(content, bytes) else content.encode())
    return root
