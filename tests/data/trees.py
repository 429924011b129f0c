"""Files and trees of miniature shapes."""

import io

import numpy as np
import trimesh
from PIL import Image

from ffd_lightning.geometry.mesh import Mesh

TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
TEXTURED = TRIANGLE + "vt 0 0\nvt 1 0\nvt 0 1\nmtllib m.mtl\nusemtl m\nf 1/1 2/2 3/3\n"


def write_folder(root, files):
    """Write {path: text or bytes} below a root, and return it."""
    for path, content in files.items():
        target = root / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content.encode() if isinstance(content, str) else content)
    return root


def encoded(picture, kind="PNG", **options):
    """Return the bytes of a picture's file."""
    data = io.BytesIO()
    picture.save(data, kind, **options)
    return data.getvalue()


def png(color=(200, 30, 30), size=(8, 8)):
    """Return the bytes of a PNG of one colour."""
    return encoded(Image.new("RGB" if len(color) == 3 else "RGBA", size, color))


def textured_box(textures, face_textures, face_uvs=None, **more):
    """A box that shows, unless UVs are given, a part of a picture on each side."""
    box = trimesh.creation.box((0.6, 0.5, 0.4))
    corners = box.vertices[box.faces]
    usual = corners[..., :2] + 0.3 * corners[..., 2:]
    return Mesh(
        vertices=np.asarray(box.vertices, float),
        faces=np.asarray(box.faces, np.int64),
        face_colors=np.arange(48, dtype=np.uint8).reshape(12, 4),
        textures=textures,
        face_textures=np.array(face_textures, np.int16),
        face_uvs=(usual if face_uvs is None else face_uvs).astype(np.float32),
        **more,
    )


def face_areas(mesh):
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def area(mesh):
    return float(face_areas(mesh).sum())
