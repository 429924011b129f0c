import numpy as np
import pytest
from projection import pixels_of

from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.imaging.rendering import render


def test_points_fall_where_they_are_drawn():
    """Dots of a hundredth are rendered; the middle of what they cover is their pixel."""
    rng = np.random.default_rng(0)
    camera = Camera(200.0, -20.0, 1.3, 50.0, (0.1, -0.2, 0.05))
    for point in rng.uniform(-0.3, 0.3, (12, 3)):
        corners = point + 0.01 * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, -1, -1]])
        faces = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
        dot = Mesh(corners, faces, np.full((4, 4), 255, np.uint8))
        rows, columns = render(dot, camera, height=240, width=320)[..., 3].nonzero()
        pixels, depth = pixels_of(camera, corners, 240, 320)
        assert (depth > 0.5).all()
        low, high = pixels.min(0), pixels.max(0)
        np.testing.assert_allclose([columns.min(), rows.min()], low, atol=1.01)
        np.testing.assert_allclose([columns.max() + 1, rows.max() + 1], high, atol=1.01)


def test_the_authors_camera_is_that_of_their_script():
    """At (0, 1, 0.6) in Blender's frame, 35 mm on 32 mm, of which the wider side is the image's."""
    with pytest.raises(ConfigError, match="camera=author must be one of"):
        RenderSettings(camera="author")
    (camera,) = RenderSettings(camera="authors", azimuths=[0.0]).cameras()
    np.testing.assert_allclose(camera.pose.position, [0, 0.6, -1], atol=1e-12)
    focal = 35 / 32 * 256  # pixels
    points = np.random.default_rng(2).uniform(-0.5, 0.5, (50, 3))
    # Blender's camera at y = 1 looks down its -z; our +x is to the left of what looks at -z.
    toward = np.array([0, -0.6, 1]) / np.hypot(1, 0.6)
    up = np.array([0, 1, 0.6]) / np.hypot(1, 0.6)
    relative = points - [0, 0.6, -1]
    depth = relative @ toward
    x = 128 + focal * relative @ [-1, 0, 0] / depth
    y = 96 - focal * relative @ up / depth
    pixels, _ = pixels_of(camera, points, 192, 256)
    np.testing.assert_allclose(pixels, np.stack([x, y], 1), atol=1e-9)
