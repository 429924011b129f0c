"""Small valid files of every format that is read, held in memory."""

import base64
import io
import json
import struct
import zlib
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
from PIL import Image

from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.data.sources.procedural import ProceduralSource


@dataclass(frozen=True)
class Held:
    """A file in memory, so that any opening of a file on the disk is seen to be wrong."""

    path: str
    content: bytes

    name = property(lambda self: PurePosixPath(self.path).name)
    stem = property(lambda self: PurePosixPath(self.path).stem)
    suffix = property(lambda self: PurePosixPath(self.path).suffix)
    parts = property(lambda self: PurePosixPath(self.path).parts)

    def read_bytes(self):
        return self.content


@dataclass(frozen=True)
class Case:
    """A shape: the name of its mesh file, and the contents of all its files by name."""

    mesh: str
    files: dict[str, bytes]

    def __repr__(self):
        return f"Case({self.mesh}, { {name: data[:300] for name, data in self.files.items()} })"


def read(case):
    files = [Held(name, content) for name, content in case.files.items()]
    return read_mesh(next(f for f in files if f.name == case.mesh), files)


def png(width, height, data=None):
    """A grey PNG of these sizes; its pixels are `data` instead if that is given."""
    if data is None:
        data = zlib.compress(bytes((width + 1) * height))
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", data), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(c)) + kind + c + struct.pack(">I", zlib.crc32(kind + c))
        for kind, c in chunks
    )


def picture(kind):
    data = io.BytesIO()
    pixels = np.arange(12 * 10 * 3, dtype=np.uint8).reshape(12, 10, 3)
    Image.fromarray(pixels).save(data, kind)
    return data.getvalue()


def _chair():
    mesh = ProceduralSource(1).load("chair", "chair-000000").mesh
    used, faces = np.unique(mesh.faces[:40], return_inverse=True)
    return mesh.vertices[used].astype(np.float32), faces.reshape(-1, 3)


def _rows(rows, head=""):
    return "".join(head + " ".join(f"{x:.6g}" for x in row) + "\n" for row in rows.tolist())


def _obj(texture="x.png"):
    vertices, faces = _chair()
    lines = ["mtllib m.mtl\n", _rows(vertices, "v "), _rows(vertices[:, :2], "vt ")]
    for k, part in enumerate(np.array_split(faces + 1, 2)):
        lines.append(f"usemtl m{k}\n" + "".join(f"f {a}/{a} {b}/{b} {c}/{c}\n" for a, b, c in part))
    mtl = f"newmtl m0\nKd 0.2 0.5 1\nd 1\nmap_Kd {texture}\nnewmtl m1\nNs 3\nKd 1 0 0.5\n"
    kind = texture[2:].replace("jpg", "jpeg")
    files = {"m.obj": "".join(lines).encode(), "m.mtl": mtl.encode(), texture: picture(kind)}
    return Case("m.obj", files)


def _off():
    vertices, faces = _chair()
    head = f"OFF\n{len(vertices)} {len(faces)} 0\n"
    return Case("m.off", {"m.off": (head + _rows(vertices) + _rows(faces, "3 ")).encode()})


def _ply(binary):
    vertices, faces = _chair()
    form = "binary_little_endian" if binary else "ascii"
    head = f"ply\nformat {form} 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property float {c}\n" for c in "xyz")
    head += "".join(f"property uchar {c}\n" for c in ("red", "green", "blue"))
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    if binary:
        body = b"".join(v.tobytes() + b"\x10\x20\x30" for v in vertices)
        body += b"".join(b"\x03" + f.astype("<i4").tobytes() for f in faces)
    else:
        colored = np.c_[vertices, np.tile([16, 32, 48], (len(vertices), 1))]
        body = (_rows(colored) + _rows(faces, "3 ")).encode()
    return Case("m.ply", {"m.ply": head.encode() + body})


def _stl(binary):
    vertices, faces = _chair()
    corners = vertices[faces]
    if binary:
        body = b"".join(bytes(12) + t.tobytes() + bytes(2) for t in corners)
        return Case("m.stl", {"m.stl": bytes(80) + struct.pack("<I", len(faces)) + body})
    facet = "facet normal 0 0 0\nouter loop\n{}endloop\nendfacet\n"
    text = "solid s\n" + "".join(facet.format(_rows(t, "vertex ")) for t in corners)
    return Case("m.stl", {"m.stl": (text + "endsolid s\n").encode()})


def scene(**changes):
    """A glTF header and its buffer: a textured chair in two nodes, the second in the first."""
    vertices, faces = _chair()
    image = picture("png")
    parts = [vertices.tobytes(), faces.astype("<u4").tobytes(), vertices[:, :2].tobytes(), image]
    starts = np.cumsum([0, *map(len, parts)]).tolist()
    primitive = {"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}
    tree = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "children": [1]}, {"mesh": 0, "translation": [1, 0, 0]}],
        "meshes": [{"primitives": [primitive]}],
        "materials": [
            {
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": 0},
                    "baseColorFactor": [1, 0.5, 1, 1],
                },
                "alphaMode": "MASK",
                "alphaCutoff": 0.5,
            }
        ],
        "textures": [{"source": 0}],
        "images": [{"bufferView": 3, "mimeType": "image/png"}],
        "buffers": [{"byteLength": starts[-1]}],
        "bufferViews": [
            {"buffer": 0, "byteOffset": starts[k], "byteLength": len(part)}
            for k, part in enumerate(parts)
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(vertices), "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": faces.size, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": len(vertices), "type": "VEC2"},
        ],
    }
    return tree | changes, b"".join(parts)


def glb(**changes):
    tree, data = scene(**changes)
    header = json.dumps(tree).encode()
    header += b" " * (-len(header) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<I4s", len(header), b"JSON") + header
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return Case("m.glb", {"m.glb": struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks})


def gltf(**changes):
    tree, data = scene(**changes)
    for buffer in tree["buffers"]:
        buffer.setdefault("uri", "data:;base64," + base64.b64encode(data).decode())
    return Case("m.gltf", {"m.gltf": json.dumps(tree).encode()})


WHOLE = {
    "obj": _obj(),
    "off": _off(),
    "ply": _ply(False),
    "ply binary": _ply(True),
    "stl": _stl(False),
    "stl binary": _stl(True),
    "gltf": gltf(),
    "glb": glb(),
}
WHOLE |= {f"obj {name}": _obj(name) for name in ("x.png", "x.jpg", "x.tga")}
