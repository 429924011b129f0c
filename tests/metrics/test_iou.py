import numpy as np
import pytest
import torch
import trimesh

from ffd_lightning.metrics.iou import mesh_iou, voxel_iou


def pairs(batch=(2, 3), seed=0):
    rng = np.random.default_rng(seed)
    return rng.random((*batch, 4, 5, 6)) < 0.4, rng.random((*batch, 4, 5, 6)) < 0.6


def naive(a, b):
    a, b = set(map(tuple, np.argwhere(a))), set(map(tuple, np.argwhere(b)))
    return len(a & b) / len(a | b)


def cube(voxels, shift=0.0):
    """A cube of so many voxels along each side, at the centre of 32^3, and shifted along x."""
    mesh = trimesh.creation.box((voxels / 32,) * 3)
    return np.asarray(mesh.vertices) + [shift / 32, 0, 0], np.asarray(mesh.faces)


def test_matches_a_naive_count():
    a, b = pairs()
    values = voxel_iou(a, b)
    assert values.shape == (2, 3)
    assert values.dtype == np.float64
    for index in np.ndindex(2, 3):
        assert values[index] == naive(a[index], b[index])
        assert voxel_iou(a[index], b[index]) == naive(a[index], b[index])


def test_tensors_give_tensors():
    a, b = pairs()
    for inputs in ((torch.tensor(a), torch.tensor(b)), (a, torch.tensor(b))):
        values = voxel_iou(*inputs)
        assert isinstance(values, torch.Tensor)
        np.testing.assert_array_equal(values.numpy(), voxel_iou(a, b))
    assert isinstance(voxel_iou(a[0, 0], b[0, 0]), float)


def test_same_disjoint_and_nested():
    a, _ = pairs((1,))
    assert voxel_iou(a, a)[0] == 1
    assert voxel_iou(a, ~a)[0] == 0
    assert voxel_iou(a, np.ones_like(a))[0] == a.mean()


def test_empty_grids():
    empty, full = np.zeros((2, 4, 4, 4), bool), np.ones((2, 4, 4, 4), bool)
    assert voxel_iou(empty[0], full[0]) == 0
    full[1] = False
    with pytest.raises(ValueError, match="empty in 1 of"):
        voxel_iou(empty, full)


@pytest.mark.parametrize(
    ("a", "b", "message"),
    [
        (np.ones((4, 4, 4), bool), np.ones((1, 4, 4, 4), bool), "one shape"),
        (np.ones((4, 4, 4), bool), np.ones((4, 4, 5), bool), "one shape"),
        (np.ones((4, 4), bool), np.ones((4, 4), bool), "one shape"),
        (np.ones((4, 4, 4)), np.ones((4, 4, 4), bool), "bool"),
        (np.ones((4, 4, 4), bool), torch.ones(4, 4, 4), "bool"),
    ],
)
def test_refuses(a, b, message):
    with pytest.raises(ValueError, match=message):
        voxel_iou(a, b)


def test_meshes_of_known_overlap():
    # 16 voxels each, of which 12 are shared along x.
    assert mesh_iou(cube(15), cube(15, shift=4)) == 12 / 20
    assert mesh_iou(cube(15, shift=4), cube(15)) == 12 / 20
    assert mesh_iou(cube(15), cube(7)) == (8 / 16) ** 3
    assert mesh_iou(cube(15.99), cube(15)) == 16**3 / 18**3
    assert mesh_iou(cube(15.99), cube(15), half_size=0.5) == 1
    assert mesh_iou(cube(15), cube(15, shift=4), resolution=64) == 24 / 40


def test_meshes_are_cut_off_at_the_shared_box():
    """Never scaled to a box of their own, and open where they are cut off."""
    cut = 14 * 20**2 - 13 * 18**2  # walls one voxel thick, but for the missing sixth
    assert mesh_iou(cube(19, shift=12), cube(19, shift=12)) == 1
    shared = 8 * 20**2 - 7 * 18**2
    assert mesh_iou(cube(19, shift=12), cube(19)) == shared / (cut + 20**3 - shared)
    assert mesh_iou(cube(15, shift=40), cube(15)) == 0
    with pytest.raises(ValueError, match="both grids are empty"):
        mesh_iou(cube(15, shift=40), cube(15, shift=40))


def test_meshes_may_be_tensors():
    (vertices, faces), other = cube(15), cube(15, shift=4)
    tensors = torch.tensor(vertices, requires_grad=True), torch.tensor(faces)
    assert mesh_iou(tensors, other) == mesh_iou(cube(15), other)
