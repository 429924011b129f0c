"""Against trimesh, naive loops, and deformations whose folds and stretches are known."""

import numpy as np
import pytest
import torch
import trimesh

from ffd_lightning.geometry.deformation import deform, deformation_matrix
from ffd_lightning.geometry.jacobian import deformation_jacobian
from ffd_lightning.geometry.lattice import Lattice
from ffd_lightning.geometry.subdivision import subdivide
from ffd_lightning.metrics.mesh_quality import (
    edge_stretch,
    folded_share,
    is_watertight,
    mesh_quality,
)


def arrays(mesh):
    return np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64)


def quality_under(matrix, vertices, faces):
    jacobians = np.tile(np.asarray(matrix, float), (len(vertices), 1, 1))
    return mesh_quality(vertices, vertices @ np.transpose(matrix), faces, jacobians)


def test_a_mesh_left_alone():
    quality = quality_under(np.eye(3), *arrays(trimesh.creation.icosphere(2)))
    assert quality == (0, 1, 1, 0, 0, 0, True, True)


def test_linear_maps():
    vertices, faces = arrays(trimesh.creation.icosphere(2))
    assert quality_under(np.diag([1, 1, -1]), vertices, faces).folded == 1
    turned = trimesh.transformations.rotation_matrix(1, [1, 2, 3])[:3, :3]
    quality = quality_under(0.25 * turned, vertices, faces)
    assert quality.folded == 0
    assert quality[1:3] == pytest.approx((4, 4))  # shrinking counts as growing
    wide = quality_under(np.diag([3, 1, 1]), vertices, faces)
    assert 1 < wide.stretch_median < wide.stretch_95 < 3


def fold_box(pull):
    """The unit cube's surface, deformed by x -> x + 2 pull x (1 - x), which turns back."""
    box = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
    fine = subdivide(*arrays(box), 0.08)
    vertices = torch.from_numpy(fine.vertices)
    lattice = Lattice.bounding(vertices, (2, 1, 1))
    offsets = torch.zeros(12, 3, dtype=torch.float64)
    offsets[4:8, 0] = pull
    deformed = deform(deformation_matrix(vertices, lattice), lattice.control_points(), offsets)
    return vertices, deformed, fine.faces, deformation_jacobian(vertices, lattice, offsets)


def test_a_box_pulled_over_itself():
    vertices, deformed, faces, jacobians = fold_box(0.9)
    x = vertices[:, 0]
    np.testing.assert_allclose(deformed[:, 0], x + 1.8 * x * (1 - x), atol=1e-12)
    quality = mesh_quality(vertices, deformed, faces, jacobians)
    turn = (1 + 1 / 1.8) / 2  # where the derivative is 0
    assert quality.folded == pytest.approx((4 * (1 - turn) + 1) / 6, abs=0.03)
    # The walls along x lie on themselves from where the far wall ends up.
    start = (2.8 - np.sqrt(2.8**2 - 4 * 1.8)) / 3.6
    assert quality.intersecting == pytest.approx(4 * (1 - start) / 6, abs=0.03)
    assert quality.newly_intersecting == quality.intersecting
    assert quality.intersecting_before == 0
    assert quality.watertight_before
    assert quality.watertight


def test_vertices_that_come_to_lie_on_others_hide_nothing():
    quality = mesh_quality(*fold_box(1.0))  # x and 1.5 - x are vertices, and end up together
    assert quality.newly_intersecting > 0.2
    assert quality.watertight_before
    assert not quality.watertight


def test_arrays_and_tensors_give_the_same():
    case = fold_box(0.9)
    assert mesh_quality(*case) == mesh_quality(*(np.asarray(x) for x in case))


def test_folds_are_weighed_by_area():
    # One large folded triangle, many small ones that are not.
    vertices = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    vertices = np.vstack([vertices, *(0.1 * vertices + 10 * k for k in range(1, 9))])
    faces = np.arange(27).reshape(-1, 3)
    jacobians = np.tile(np.eye(3), (27, 1, 1))
    jacobians[:3, 2, 2] = -0.5
    assert folded_share(vertices, faces, jacobians) == pytest.approx(1 / 1.08)


def test_edge_stretch_is_what_a_loop_finds():
    rng = np.random.default_rng(0)
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
    np.testing.assert_allclose(np.sort(edge_stretch(vertices, deformed, faces)), np.sort(ratios))


def test_an_edge_that_collapses_is_stretched_without_bound():
    vertices, faces = arrays(trimesh.creation.box())
    flat = np.diag([1, 1, 0])
    quality = quality_under(flat, vertices, faces)
    assert quality.stretch_95 == np.inf
    assert quality.stretch_median == pytest.approx(1)
    assert quality.folded == 0  # a determinant of 0 turns nothing inside out


def with_part_twice():
    sphere = trimesh.creation.icosphere(1)
    return sphere.vertices, np.vstack([sphere.faces, sphere.faces[:1]])


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.box(),
        trimesh.creation.torus(1, 0.3),
        trimesh.util.concatenate([trimesh.creation.box(), trimesh.creation.icosphere(1)]),
        trimesh.Trimesh(*with_part_twice(), process=False),
        trimesh.Trimesh(trimesh.creation.box().vertices, trimesh.creation.box().faces[1:]),
        trimesh.creation.annulus(0.5, 1, 1),
    ],
    ids=["box", "torus", "two", "a face thrice", "open", "annulus"],
)
def test_watertight_as_trimesh_says(mesh):
    vertices, faces = arrays(mesh)
    assert is_watertight(vertices, faces) == mesh.is_watertight
    soup = vertices[faces].reshape(-1, 3)
    assert is_watertight(soup, np.arange(len(soup)).reshape(-1, 3)) == mesh.is_watertight


def test_watertight_of_degenerate_meshes():
    vertices, faces = arrays(trimesh.creation.box())
    assert is_watertight(vertices, np.vstack([faces, [[0, 0, 1]]]))
    assert not is_watertight(vertices, faces[:0])
    assert not is_watertight(np.zeros((8, 3)), faces)


@pytest.mark.parametrize(("noise", "closed"), [(1e-9, True), (1e-3, False)])
def test_rounding_tears_no_holes_but_a_tear_does(noise, closed):
    sphere = trimesh.creation.icosphere(2)
    soup = np.asarray(sphere.triangles).reshape(-1, 3)
    torn = soup + noise * np.random.default_rng(0).normal(size=soup.shape)
    faces = np.arange(len(soup)).reshape(-1, 3)
    quality = mesh_quality(soup, torn, faces, np.tile(np.eye(3), (len(soup), 1, 1)))
    assert quality.watertight_before
    assert quality.watertight == closed


def test_new_intersections_are_told_from_old_ones():
    boxes = [trimesh.creation.box() for _ in range(3)]
    boxes[1].apply_translation([0.7, 0.6, 0.8])  # through the first
    boxes[2].apply_translation([5, 0.3, 0.2])
    vertices, faces = arrays(trimesh.util.concatenate(boxes))
    moved = vertices.copy()
    moved[16:, 0] -= 5.8  # the third through the first on its other side
    quality = mesh_quality(vertices, moved, faces, np.tile(np.eye(3), (24, 1, 1)))
    assert quality.intersecting_before > 0
    assert quality.intersecting > quality.newly_intersecting > 0
    assert quality.intersecting <= quality.intersecting_before + quality.newly_intersecting


BOX = arrays(trimesh.creation.box())
EYES = np.tile(np.eye(3), (8, 1, 1))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((BOX[0], BOX[0][:4], BOX[1], EYES), "go together"),
        ((BOX[0], BOX[0], BOX[1], EYES[:4]), "go together"),
        ((BOX[0], BOX[0], BOX[1][:0], EYES), "no faces"),
        ((BOX[0], BOX[0], BOX[1] + 9, EYES), "index"),
        ((BOX[0], BOX[0] * np.nan, BOX[1], EYES), "finite"),
        ((BOX[0], BOX[0], BOX[1], EYES + np.inf), "jacobians"),
        ((BOX[0] * 0, BOX[0], BOX[1], EYES), "length|area"),
        ((BOX[0] * [1, 0, 0], BOX[0], BOX[1], EYES), "area"),
    ],
)
def test_refuses_what_cannot_be_measured(arguments, message):
    with pytest.raises(ValueError, match=message):
        mesh_quality(*arguments)
