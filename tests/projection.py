"""Where points fall in an image."""

import numpy as np


def pixels_of(camera, points, height, width):
    """Columns and rows (N, 2) of points (N, 3), the first pixel from 0 to 1, and their depths."""
    slopes, depth = camera.slopes(points)
    scaled = slopes * np.array([1, -1]) * height / 2 / camera.half_height
    return scaled + np.array([width, height]) / 2, depth
