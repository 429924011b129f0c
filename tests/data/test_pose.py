import numpy as np
import pytest

from ffd_lightning import shapes
from ffd_lightning.data.preparation.pose import embedded_category, guess_pose
from ffd_lightning.data.reading.frame import turn
from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.geometry.sampling import sample_surface

POSES = [(up, yaw) for up in ("y", "z") for yaw in (0.0, 90.0, 180.0, 270.0)]


def clouds_of(category, count=16, points=256):
    """Clouds of embedded shapes that no reference is made of."""
    clouds = []
    for index in range(count):
        mesh, _ = shapes.build(category, index, seed=7)
        vertices, rng = normalize(mesh.vertices, mesh.faces), np.random.default_rng(index)
        clouds.append(sample_surface(vertices, mesh.faces, points, rng)[0])
    return clouds


@pytest.fixture(scope="module")
def chairs():
    return clouds_of("chair")


def as_found(clouds, pose):
    """Clouds as a data set has them that needs this pose."""
    return [cloud @ turn(np.eye(3), *pose).T for cloud in clouds]


@pytest.mark.parametrize("pose", POSES)
def test_chairs_that_were_turned_are_seen(chairs, pose):
    guess = guess_pose(as_found(chairs, pose), "chair")
    if pose == ("y", 0.0):
        assert guess is None
    else:
        assert guess.poses[0] == pose
        assert guess.known
        assert guess.gain > 1.5


def test_the_settings_that_are_told_are_the_ones_to_give(chairs):
    """Whatever the present settings are: not those to be added to them."""
    raw = as_found(chairs, ("z", 270.0))
    for up, yaw in (("y", 0.0), ("y", 90.0), ("z", 90.0)):
        seen = [turn(cloud, up, yaw) for cloud in raw]
        assert guess_pose(seen, "chair", up, yaw).poses[0] == ("z", 270.0)
    assert guess_pose([turn(cloud, "z", 270.0) for cloud in raw], "chair", "z", 270.0) is None


@pytest.mark.parametrize("category", ["plane", "car", "lamp"])
def test_what_stands_right_is_never_called_wrong(category):
    assert guess_pose(clouds_of(category), category) is None


def test_of_an_unknown_category_only_the_sides_are_told_apart(chairs):
    assert guess_pose(chairs, "mug") is None
    turned = as_found(chairs, ("y", 90.0))
    guess = guess_pose(turned, "mug")
    assert set(guess.poses) == {("y", 90.0), ("y", 270.0)}
    assert not guess.known


def test_categories_of_the_same_objects_are_known_by_other_names(chairs):
    turned = as_found(chairs, ("z", 180.0))
    by_name, by_synset = (guess_pose(turned, name) for name in ("chair", "03001627"))
    assert by_name == by_synset
    assert by_name.known
    assert [embedded_category(name) for name in ("rifle", "telephone", "04090263", "mug")] == [
        "firearm",
        "cellphone",
        "firearm",
        "",
    ]


def test_of_few_shapes_nothing_is_said(chairs):
    assert guess_pose(as_found(chairs, ("y", 90.0))[:3], "chair") is None


def test_flat_shapes_are_left_alone():
    """Points of a poster are their own mirror images in its plane: that is no symmetry."""
    rng = np.random.default_rng(0)
    for sides in ((1, 0.7, 0), (0, 0.7, 1)):
        posters = [rng.uniform(-0.5, 0.5, (256, 3)) * sides for _ in range(8)]
        assert guess_pose(posters, "poster") is None


def test_shapes_without_a_front_are_left_alone():
    angles = np.random.default_rng(0).random(256) * 2 * np.pi
    ring = np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1) / 3
    assert guess_pose([ring + 0.01 * k for k in range(8)], "wheel") is None
