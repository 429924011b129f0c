from dataclasses import replace

import numpy as np
import pytest

from ffd_lightning.geometry.mesh import Mesh, normalize
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.framing import frame_photo
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.seen_side import choose_viewpoint, photo_colored
from ffd_lightning.nn.viewpoint import Viewpoint
from ffd_lightning.shapes.kit import Builder, Material

RED, GREEN, BLUE, GREY = (220, 20, 20), (20, 200, 20), (20, 20, 220), (128, 128, 128)


def tower(colors):
    """A high box at the left, a low one at the right, and a plate hidden below; a colour each."""
    b = Builder()
    materials = [Material(tuple(c / 255 for c in color)) for color in colors]
    b.box("high", materials[0], (-0.5, 1, 0), (1, 2, 1))
    b.box("low", materials[1], (0.5, 0.4, 0), (1, 0.8, 1))
    b.box("hidden", materials[2], (-0.5, 1, 0), (0.2, 0.2, 0.2))
    mesh = b.mesh()
    return mesh.with_vertices(normalize(mesh.vertices, mesh.faces))


def photo(mesh, camera):
    image = render(mesh, camera, height=240, width=320)
    return frame_photo(image, height=96, width=128, fill=0.8).image


def color_of(mesh: Mesh, part: str):
    own = mesh.face_colors[mesh.face_parts == mesh.part_names.index(part), :3]
    assert len(np.unique(own, axis=0)) == 1
    return own[0].astype(int)


@pytest.mark.parametrize("azimuth", [20, 160, 290])
def test_parts_take_the_colours_that_the_photograph_shows_from_its_side(azimuth):
    image = photo(tower([RED, BLUE, GREEN]), Camera(azimuth, 20))
    plain = tower([GREY, GREY, GREY])
    plain.face_colors[:, 3] = 120
    found = photo_colored(plain, Viewpoint(azimuth, 20.0, 1.0), image)
    assert color_of(found, "high").argmax() == 0
    assert color_of(found, "low").argmax() == 2
    of_all = np.median(image[image[..., 3] > 127][:, :3], axis=0)
    assert np.abs(color_of(found, "hidden") - of_all).max() < 40, "the object's"
    assert (found.face_colors[:, 3] == 255).all(), "also where the template is of glass"
    np.testing.assert_array_equal(found.vertices, plain.vertices)


def test_materials_of_one_part_are_told_apart():
    two = tower([RED, BLUE, GREEN])
    one_part = replace(two, face_parts=np.zeros(len(two.faces), np.uint8), part_names=("all",))
    found = photo_colored(one_part, Viewpoint(20, 20.0, 1.0), photo(two, Camera(20, 20)))
    high, low = (found.face_colors[two.face_parts == k, :3].astype(int)[0] for k in (0, 1))
    assert (high.argmax(), low.argmax()) == (0, 2)


@pytest.mark.parametrize("true", [30, 210])
def test_the_outline_tells_front_from_back_where_the_network_hesitates(true):
    mesh = tower([GREY, GREY, GREY])
    image = photo(mesh, Camera(true, 20))
    right = Viewpoint(true, 20.0, 0.4)
    wrong = Viewpoint((true + 180) % 360, 20.0, 0.45)
    assert choose_viewpoint([wrong, right], mesh, image) is right
    sure = wrong._replace(confidence=0.95)
    assert choose_viewpoint([sure, right], mesh, image) is sure
