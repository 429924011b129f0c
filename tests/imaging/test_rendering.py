import numpy as np
import pytest

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render

RED, GREEN, BLUE = [200, 0, 0, 255], [0, 200, 0, 255], [0, 0, 200, 255]


def triangles(corners, colors) -> Mesh:
    vertices = np.asarray(corners, float).reshape(-1, 3)
    faces = np.arange(len(vertices)).reshape(-1, 3)
    return Mesh(vertices, faces, np.asarray(colors, np.uint8).reshape(-1, 4))


def pane(z: float, color, half: float = 0.3) -> list:
    """Two triangles facing the front camera at depth z."""
    a, b, c, d = (-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)
    return [(a, b, c), (a, c, d)], [color, color]


def panes(*layers) -> Mesh:
    parts = [pane(z, color) for z, color in layers]
    return triangles([p[0] for p in parts], [p[1] for p in parts])


def naive_faces(mesh: Mesh, height: int, width: int, elevation: float, azimuth: float):
    """Return the face seen at each pixel's centre, -1 for none, by Moller and Trumbore."""
    e, a = np.deg2rad([elevation, azimuth])
    eye = np.array([np.cos(e) * np.sin(a), np.sin(e), -np.cos(e) * np.cos(a)])
    eye = eye * 0.5 / np.sin(np.deg2rad(20))
    gaze = -eye / np.linalg.norm(eye)
    right = np.cross(gaze, [0, 1, 0])
    right /= np.linalg.norm(right)
    up = np.cross(right, gaze)
    pixel = 2 * np.tan(np.deg2rad(20)) / height
    seen = np.full((height, width), -1)
    for row in range(height):
        for column in range(width):
            x, y = (column + 0.5 - width / 2) * pixel, (height / 2 - row - 0.5) * pixel
            ray, nearest = gaze + x * right + y * up, np.inf
            for face, (p, q, r) in enumerate(mesh.vertices[mesh.faces]):
                matrix = np.column_stack([q - p, r - p, -ray])
                if abs(np.linalg.det(matrix)) < 1e-12:
                    continue
                u, v, t = np.linalg.solve(matrix, eye - p)
                if u >= 0 and v >= 0 and u + v <= 1 and 0 < t < nearest:
                    nearest, seen[row, column] = t, face
    return seen


@pytest.mark.parametrize(("elevation", "azimuth"), [(30, 45), (0, 0), (-20, 200), (70, 300)])
def test_agrees_with_a_naive_ray_caster(elevation: float, azimuth: float) -> None:
    rng = np.random.default_rng(3)
    colors = np.eye(3, dtype=np.uint8)[rng.integers(3, size=20)] * 255
    mesh = triangles(rng.uniform(-0.4, 0.4, (60, 3)), np.insert(colors, 3, 255, axis=1))
    image = render(mesh, Camera(azimuth, elevation), height=18, width=24, samples=1)
    seen = naive_faces(mesh, 18, 24, elevation, azimuth)
    assert (seen >= 0).sum() > 50
    np.testing.assert_array_equal(image[..., 3], np.where(seen >= 0, 255, 0))
    hit = seen >= 0
    np.testing.assert_array_equal(image[hit][:, :3].argmax(1), colors[seen[hit]].argmax(1))
    np.testing.assert_array_equal(image[~hit], [[255, 255, 255, 0]] * int((~hit).sum()))


def test_coverage_is_the_share_of_samples_hit() -> None:
    mesh = triangles(*pane(0, RED))
    fine = render(mesh, Camera(20, 0), height=60, width=60, samples=3)[..., 3]
    rays = render(mesh, Camera(20, 0), height=180, width=180, samples=1)[..., 3]
    share = (rays / 255).reshape(60, 3, 60, 3).mean((1, 3))
    np.testing.assert_allclose(fine, 255 * share, atol=0.51)
    assert ((fine > 0) & (fine < 255)).any()


def test_see_through_faces_let_the_rest_show() -> None:
    def middle(mesh: Mesh) -> np.ndarray:
        return render(mesh, Camera(0, 0))[96, 128].astype(int)

    glass = [200, 0, 0, 102]  # 40% opaque
    alone = middle(panes((0, glass)))
    assert alone[3] == 102
    assert alone[0] > 180  # the white behind shows
    assert alone[1] == alone[2] > 150
    backed = middle(panes((0.2, BLUE), (0, glass)))
    assert backed[3] == 255
    assert backed[0] > 0
    assert backed[2] > 0
    assert backed[1] == 0
    np.testing.assert_array_equal(middle(panes((0.2, RED), (0, [0, 0, 200, 0])))[:3],
                                  middle(panes((0.2, RED)))[:3])  # fmt: skip
    np.testing.assert_array_equal(middle(panes((0, glass), (1e-6, glass))), alone)
    stacked = middle(panes(*((0.1 * k, glass) for k in range(3))))
    assert stacked[3] == round(255 * (1 - 0.6**3))


def textured(uvs, texture, alpha=255) -> Mesh:
    corners, colors = pane(0, [9, 9, 9, alpha])
    plain = triangles(corners, colors)
    a, b, c, d = np.asarray(uvs, np.float32)
    return Mesh(
        plain.vertices,
        plain.faces,
        plain.face_colors,
        textures=(np.asarray(texture, np.uint8),),
        face_textures=np.zeros(2, np.int16),
        face_uvs=np.stack([[a, b, c], [a, c, d]]),
    )


# Seen from the front, the pane's corners are: low right, low left, high left, high right.
FULL = np.array([[1, 0], [0, 0], [0, 1], [1, 1]])
QUARTERS = np.array([[RED, GREEN], [BLUE, [200, 200, 0, 128]]])


def test_textures_stand_upright_and_replace_colour_and_alpha() -> None:
    image = render(textured(FULL, QUARTERS), Camera(0, 0)).astype(int)
    upper_left, upper_right = image[70, 102], image[70, 154]
    lower_left, lower_right = image[122, 102], image[122, 154]
    assert upper_left[0] > 3 * upper_left[1:3].max()
    assert upper_right[1] > 3 * upper_right[[0, 2]].max()
    assert lower_left[2] > 3 * lower_left[:2].max()
    assert lower_right[3] < 200 < lower_left[3]
    one = render(textured(FULL, [[RED]]), Camera(0, 0))
    np.testing.assert_array_equal(one, render(triangles(*pane(0, RED)), Camera(0, 0)))
