"""Images of meshes by ray casting: flat-shaded, textured, see-through, the same to the byte.

Embree is called directly, on the processor; nothing else is needed to make an image.
"""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore import EmbreeDevice
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera

Floats = NDArray[np.float32]

_FRAMING = Camera()
_NEAR = 1e-3  # vertices before that, or behind the camera, have no place in the image
_LAYERS = 6
_LAYER_GAP = 1e-4  # further along the ray, so that doubled faces count once
_OPAQUE = 0.999
_AMBIENT = 0.38
# Directions to the lights and their strengths: above, and on both sides. None leans forward or
# back, so the front and the back of an object are lit alike from all azimuths.
_LIGHTS = (((0.0, 1.0, 0.0), 0.34), ((0.9, 0.44, 0.0), 0.26), ((-0.9, 0.44, 0.0), 0.26))


def _to_linear(encoded: NDArray[np.float64]) -> Floats:
    """Decode sRGB values in [0, 1] to linear light."""
    low = encoded <= 0.04045
    return np.where(low, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _to_srgb(linear: Floats) -> Floats:
    """Encode linear light in [0, 1] as sRGB."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055)


_LINEAR = _to_linear(np.arange(256) / 255)
_LINEAR_FINE = _to_linear(np.arange(4096) / 4095)


def render(
    mesh: Mesh,
    camera: Camera = _FRAMING,
    *,
    height: int = 192,
    width: int = 256,
    samples: int = 3,
) -> NDArray[np.uint8]:
    """Render a mesh over white, as a `Camera` sees it.

    Faces are lit from both sides by ambient light and fixed lights above, left and right, without
    shadows. See-through faces are blended front to back, six deep.

    Args:
        mesh: what is seen; what lies outside of the image is cut off.
        camera: by default, all normalised shapes are seen whole, and at the same scale.
        height: of the image in pixels.
        width: of the image in pixels.
        samples: rays per pixel along each axis, averaged in linear light.

    Returns:
        (height, width, 4) uint8: sRGB over white, and the coverage as alpha.
    """
    rows, columns, directions = _rays(mesh, camera, height, width, samples)
    image = np.full((height, width, 4), (255, 255, 255, 0), np.uint8)
    if len(directions) == 0:
        return image
    light = _trace(mesh, camera.pose.position, directions)
    boxes = light.reshape(rows[1] - rows[0], samples, columns[1] - columns[0], samples, 4)
    pixels = boxes.mean(axis=1).mean(axis=2)
    pixels[..., :3] += 1 - pixels[..., 3:]
    pixels = np.clip(pixels, 0, 1)
    pixels[..., :3] = _to_srgb(pixels[..., :3])
    image[slice(*rows), slice(*columns)] = np.round(255 * pixels)
    return image


def seen_faces(mesh: Mesh, camera: Camera, side: int) -> NDArray[np.int64]:
    """Return the face that each pixel's middle shows, (side, side), -1 where there is none."""
    rows, columns, directions = _rays(mesh, camera, side, side, 1)
    found = np.full((side, side), -1, np.int64)
    if len(directions):
        origins = np.broadcast_to(camera.pose.position.astype(np.float32), directions.shape)
        hits = _scene(mesh).run(origins.copy(), directions, output=1)["primID"]
        box = rows[1] - rows[0], columns[1] - columns[0]
        found[slice(*rows), slice(*columns)] = hits.reshape(box)
    return found


def _rays(
    mesh: Mesh, camera: Camera, height: int, width: int, samples: int
) -> tuple[tuple[int, int], tuple[int, int], Floats]:
    """Return the rows and columns the mesh can be seen in, and directions (rays, 3) through them.

    Rays run along rows of samples, top left first; their length is 1 along the optical axis.
    """
    half_y, pose = camera.half_height, camera.pose
    half_x = half_y * width / height
    rows, columns = (0, height), (0, width)
    vertices = mesh.used_vertices()
    if len(vertices) == 0:
        return (0, 0), (0, 0), np.zeros((0, 3), np.float32)
    seen, depth = camera.slopes(vertices)
    if (depth >= _NEAR).all():
        (x0, y0), (x1, y1) = seen.min(axis=0), seen.max(axis=0)
        rows = _span(-y1 / half_y, -y0 / half_y, height)
        columns = _span(x0 / half_x, x1 / half_x, width)
    down, along = (np.arange(a * samples, b * samples) + 0.5 for a, b in (rows, columns))
    y = half_y * (1 - 2 * down / height / samples)
    x = half_x * (2 * along / width / samples - 1)
    grid = pose.forward + y[:, None, None] * pose.up + x[None, :, None] * pose.right
    return rows, columns, grid.reshape(-1, 3).astype(np.float32)


def _span(low: float, high: float, size: int) -> tuple[int, int]:
    """Return the first pixel and the one past the last between two positions in [-1, 1]."""
    first = int(np.clip(np.floor((low + 1) / 2 * size), 0, size))
    return first, int(np.clip(np.ceil((high + 1) / 2 * size), first, size))


def _trace(mesh: Mesh, position: NDArray[np.float64], directions: Floats) -> Floats:
    """Return the linear light that each ray brings, and its opacity, (R, 4)."""
    scene = _scene(mesh)
    brightness = _brightness(mesh, position)
    plain = np.empty((len(mesh.faces), 4), np.float32)
    plain[:, :3] = _LINEAR[mesh.face_colors[:, :3]] * brightness
    plain[:, 3] = mesh.face_colors[:, 3] / 255

    light = np.zeros((len(directions), 4), np.float32)
    rays = np.arange(len(directions))
    origins = np.broadcast_to(position.astype(np.float32), directions.shape).copy()
    for _ in range(_LAYERS):
        hits = scene.run(origins, directions, output=1)
        struck = np.flatnonzero(hits["primID"] >= 0)
        faces, u, v, t = (hits[key].take(struck) for key in ("primID", "u", "v", "tfar"))
        rays = rays.take(struck)
        color = plain.take(faces, axis=0)
        _apply_textures(mesh, color, brightness, faces, u, v)
        through = 1 - light[:, 3].take(rays)
        opacity = through * color[:, 3]
        color[:, :3] *= opacity[:, None]
        color[:, 3] = opacity
        light[rays] += color
        beyond = np.flatnonzero(through - opacity > 1 - _OPAQUE)
        if len(beyond) == 0:
            break
        again = struck.take(beyond)
        rays, directions = rays.take(beyond), directions.take(again, axis=0)
        origins = origins.take(again, axis=0)
        origins += (t.take(beyond) + np.float32(_LAYER_GAP))[:, None] * directions
    return light


def _scene(mesh: Mesh) -> EmbreeScene:
    scene = EmbreeScene(EmbreeDevice())
    TriangleMesh(scene, mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32))
    return scene


def _brightness(mesh: Mesh, position: NDArray[np.float64]) -> Floats:
    """Return how brightly each face is lit on the side that is seen from `position`, (F, 1)."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    # The whole plane of a face shows a camera the same side: one test a face, not one a ray.
    normals[np.einsum("ij,ij->i", normals, a - position) > 0] *= -1
    lit = np.full(len(normals), _AMBIENT)
    for direction, strength in _LIGHTS:
        lit += strength * np.maximum(np.einsum("ij,j->i", normals, np.array(direction)), 0)
    return lit[:, None].astype(np.float32)


def _apply_textures(
    mesh: Mesh, color: Floats, brightness: Floats, faces: NDArray[np.int32], u: Floats, v: Floats
) -> None:
    """Replace `color` (h, 4) where a textured face is hit, at barycentric u, v (h,)."""
    if mesh.face_textures is None or mesh.face_uvs is None:
        return
    textures = mesh.face_textures.take(faces)
    for index in np.unique(textures[textures >= 0]):
        hit = np.flatnonzero(textures == index)
        face = faces.take(hit)
        corner = mesh.face_uvs.take(face, axis=0)
        s, t = u.take(hit)[:, None], v.take(hit)[:, None]
        uv = (1 - s - t) * corner[:, 0] + s * corner[:, 1] + t * corner[:, 2]
        texel = _bilinear(mesh.textures[index], uv)
        texel[:, :3] *= brightness.take(face, axis=0)
        color[hit] = texel


def _bilinear(texture: NDArray[np.uint8], uv: Floats) -> Floats:
    """Return linear RGBA (h, 4) of a wrapping texture at uv (h, 2).

    Texels are mixed as they are encoded, which spares decoding each of the four.
    """
    height, width = texture.shape[:2]
    texels = np.ascontiguousarray(texture).reshape(-1, 4).view(np.uint32)[:, 0]
    x = (uv[:, 0] - np.floor(uv[:, 0])) * width - np.float32(0.5)
    y = (np.ceil(uv[:, 1]) - uv[:, 1]) * height - np.float32(0.5)
    left, top = np.floor(x).astype(np.int32), np.floor(y).astype(np.int32)
    along, down = x - left.astype(np.float32), y - top.astype(np.float32)
    mixed = np.zeros((len(uv), 4), np.float32)
    for row, row_weight in ((top % height, 1 - down), ((top + 1) % height, down)):
        for column, weight in ((left % width, 1 - along), ((left + 1) % width, along)):
            texel = texels.take(row * width + column).view(np.uint8).reshape(-1, 4)
            mixed += (row_weight * weight)[:, None] * texel
    mixed /= 255
    mixed[:, :3] = _LINEAR_FINE.take(np.round(mixed[:, :3] * 4095).astype(np.intp))
    return mixed
