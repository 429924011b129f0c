"""Files and trees of miniature shapes."""

import io

import numpy as np
from PIL import Image

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


def face_areas(mesh):
    a, b, c = mesh.vertices[mesh.faces].swapaxes(0, 1)
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def area(mesh):
    return float(face_areas(mesh).sum())
