"""Against naive loops, and deformations whose folds and stretches are known."""

import numpy as np
import pytest
import trimesh

from ffd_lightning.metrics.distortion import distortion, unique_edges


def arrays(mesh):
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)


def under(matrix, vertices, faces):
    jacobians = np.tile(np.asarray(matrix, float), (len(vertices), 1, 1))
    edges = unique_edges(vertices, faces)
    return distortion(vertices, vertices @ np.transpose(matrix), faces, edges, jacobians)


def test_linear_maps():
    vertices, faces = arrays(trimesh.creation.icosphere(2))
    assert under(np.eye(3), vertices, faces) == {"folded": 0, "stretch_median": 1, "stretch_95": 1}
    assert under(np.diag([1, 1, -1]), vertices, faces)["folded"] == 1
    turned = 0.25 * trimesh.transformations.rotation_matrix(1, [1, 2, 3])[:3, :3]
    assert under(turned, vertices, faces) == pytest.approx(
        {"folded": 0, "stretch_median": 4, "stretch_95": 4}  # shrinking counts as growing
    )
    flat = under(np.diag([1, 1, 0]), *arrays(trimesh.creation.box()))
    assert flat == pytest.approx({"folded": 0, "stretch_median": 1, "stretch_95": np.inf})


def test_folds_are_weighed_by_area():
    # One large folded triangle, many small ones that are not.
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    vertices = np.vstack([vertices, *(0.1 * vertices + 10 * k for k in range(1, 9))])
    jacobians = np.tile(np.eye(3), (27, 1, 1))
    jacobians[:3, 2, 2] = -0.5
    faces = np.arange(27).reshape(-1, 3)
    found = distortion(vertices, vertices, faces, unique_edges(vertices, faces), jacobians)
    assert found["folded"] == pytest.approx(1 / 1.08)


@pytest.mark.parametrize("seed", range(5))
def test_stretch_is_what_a_loop_finds(seed):
    rng = np.random.default_rng(seed)
    vertices, deformed = rng.random((2, 30, 3))
    faces = rng.integers(0, 30, (50, 3))
    vertices[7], deformed[7] = vertices[3], deformed[3]  # the same point twice
    edges, ratios = set(), []
    for face in np.where(faces == 7, 3, faces):
        edges |= {tuple(sorted((face[k], face[k - 1]))) for k in range(3)}
    for a, b in edges:
        if a != b:
            ratio = np.linalg.norm(deformed[a] - deformed[b]) / np.linalg.norm(
                vertices[a] - vertices[b]
            )
            ratios.append(max(ratio, 1 / ratio))
    jacobians = np.tile(np.eye(3), (30, 1, 1))
    found = distortion(vertices, deformed, faces, unique_edges(vertices, faces), jacobians)
    expected = np.sort(ratios)[[-(-len(ratios) // 2) - 1, -(-95 * len(ratios) // 100) - 1]]
    np.testing.assert_allclose([found["stretch_median"], found["stretch_95"]], expected)
