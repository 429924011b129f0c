import json

import pytest

from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.render_settings import CameraModel, RenderSettings
from ffd_lightning.imaging.viewpoints import Viewpoints

AROUND = [45.0 * k for k in range(8)]


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (RenderSettings(), "azimuth 45 (0 is the front), elevation 30, lens 40 degrees"),
        (
            RenderSettings(camera=CameraModel.authors),
            "azimuth 45 (0 is the front), elevation 31, lens 38 degrees",
        ),
        (
            RenderSettings(azimuths=[90.0, -45.0], elevation=10),
            "azimuth 90, 315 (0 is the front), elevation 10, lens 40 degrees",
        ),
        (
            RenderSettings(azimuths=[], random_views=8),
            "all sides, elevation -5 to 60, lens 25 to 60 degrees",
        ),
    ],
)
def test_cameras_of_settings_in_words(settings, words):
    assert str(Viewpoints.of_settings(settings)) == words


def test_fixed_views_are_listed_and_others_are_not():
    assert Viewpoints.of_settings(RenderSettings(azimuths=AROUND)).azimuths == (*(AROUND),)
    half = Viewpoints.of([Camera(3.0 * k - 60) for k in range(40)])
    assert (half.azimuths, half.all_sides) == ((), False)
    assert "many sides" in str(half)


def test_cameras_nobody_knows_are_said_to_be_unknown():
    assert str(Viewpoints.of([])) == "unknown cameras"


@pytest.mark.parametrize("cameras", [[], [Camera()], [Camera(7.0 * k, k) for k in range(52)]])
def test_they_come_back_from_a_file(cameras):
    found = Viewpoints.of(cameras)
    content = json.loads(json.dumps(found.to_json()))
    assert Viewpoints.from_json(content) == found
    assert content["in_words"] == str(found)


def test_shapes_are_drawn_as_the_images_are_if_those_have_one_camera():
    authors = RenderSettings(camera=CameraModel.authors, azimuths=[90.0])
    assert authors.picture_camera == authors.cameras()[0]
    for several in (
        RenderSettings(azimuths=AROUND),
        RenderSettings(azimuths=[], random_views=8),
        RenderSettings(azimuths=[0.0], random_views=1),
    ):
        assert several.picture_camera == Camera(45, 30)
