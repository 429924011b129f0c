"""Model files that are made to do harm.

Run as a script it reads all of them with little memory and writes what came of each as JSON.
"""

import base64
import functools
import json
import resource
import struct
import sys
import time

import numpy as np
from whole_files import WHOLE, Case, glb, gltf, png, read, scene

from ffd_lightning.errors import RejectedShapeError

_HEAD = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nmtllib m.mtl\nusemtl m\n"
_FACE = "f 1/1 2/2 3/3\n"
_XYZ = "property float x\nproperty float y\nproperty float z\n"


def obj(text=_HEAD + _FACE, mtl="newmtl m\nKd 1 0 0\nmap_Kd x.png\n", **files):
    files = {name.replace("_", "."): data for name, data in files.items()}
    return Case("m.obj", {"m.obj": text.encode(), "m.mtl": mtl.encode(), **files})


def ply(form, vertices, faces, count="uchar", body=b""):
    text = f"ply\nformat {form} 1.0\nelement vertex {vertices}\n{_XYZ}element face {faces}\n"
    text += f"property list {count} int vertex_indices\nend_header\n"
    return Case("m.ply", {"m.ply": text.encode() + body})


def _zeros(count, kind="VEC3", **more):
    return {"componentType": 5126, "count": count, "type": kind, **more}


def _swapped(accessor):
    return glb(accessors=[accessor, *scene()[0]["accessors"][1:]])


def _gloss():
    kind = {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 0}}}
    image = "data:;base64," + base64.b64encode(png(2500, 2500)).decode()
    return gltf(materials=[{"extensions": kind}], images=[{"uri": image}])


def _instances(count):
    """One face of a part with many vertices, shown many times."""
    points = np.random.default_rng(0).random((200_000, 3), np.float32).tobytes()
    buffer = "data:;base64," + base64.b64encode(points + bytes([0, 1, 2])).decode()
    size = len(points)
    views = [{"byteLength": size}, {"byteOffset": size, "byteLength": 3}]
    return gltf(
        images=[],
        nodes=[{"mesh": 0}] * count,
        scenes=[{"nodes": list(range(count))}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        buffers=[{"byteLength": size + 3, "uri": buffer}],
        bufferViews=[{"buffer": 0, **view} for view in views],
        accessors=[
            {"bufferView": 0, "componentType": 5126, "count": 200_000, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"},
        ],
    )


def _repeated(count):
    """Many materials that name one texture."""
    text = _HEAD + "".join(f"usemtl m{k}\n{_FACE}" for k in range(count))
    mtl = "".join(f"newmtl m{k}\nmap_Kd x.png\n" for k in range(count))
    return obj(text, mtl, x_png=png(1500, 1500))


_TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
_EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 9 9\n%%EndComments\nshowpage\n%%EOF\n"
_FACET = b"solid a\nfacet\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendfacet\nendsolid a\n"
_VIEW = {"buffer": 0, "byteLength": 900}
_NODES = 500


def _bare(mesh, data):
    return Case(mesh, {mesh: data})


def _outside(path):
    return obj(_HEAD.replace("m.mtl", path) + _FACE, f"newmtl m\nmap_Kd {path}\n")


_LITTLE = "binary_little_endian"
_LONG_LIST = _TRIANGLE + struct.pack("<I3i", 4 * 10**8, 0, 1, 2)
_STATEMENTS = "call /etc/passwd\ninclude /etc/passwd\ncsh -touch x\nmaplib /etc/passwd\n"
_STATEMENTS += "shadow_obj /etc/passwd\ntrace_obj http://localhost/\n"
_PATHS = ("../../etc/passwd", "http://localhost/x")
_CHAIN = [*({"children": [k + 1]} for k in range(_NODES)), {"mesh": 0}]
_GRID = {"scenes": [{"nodes": list(range(_NODES))}], "nodes": [{"mesh": 0}] * _NODES}
_VIEWS = [*scene()[0]["bufferViews"], *[_VIEW] * 5000]
_UNUSED = [*scene()[0]["accessors"], _zeros(10**8, "MAT4")]

# What makes it, and the number of faces that come of it or the reason why it is rejected.
DANGERS = {
    "PLY promises": (lambda: ply(_LITTLE, 4 * 10**9, 1, body=_TRIANGLE), "m.ply"),
    "PLY list": (lambda: ply(_LITTLE, 3, 1, "uint", _LONG_LIST), "m.ply"),
    "OFF n-gon": (
        lambda: _bare("m.off", b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n"),
        "m.off",
    ),
    "OBJ index": (lambda: obj(_HEAD + "f 1 2 4000000000\n"), "m.obj"),
    "OBJ statements": (lambda: obj(_STATEMENTS + _HEAD + _FACE), 1),
    "many materials": (
        lambda: obj(_HEAD + "".join(f"usemtl m{k}\n{_FACE}" for k in range(3000))),
        3000,
    ),
    "one texture": (lambda: _repeated(100), 100),
    "many solids": (lambda: _bare("m.stl", _FACET * 20_000), 20_000),
    **{f"name {path}": (functools.partial(_outside, path), 1) for path in _PATHS},
    **{
        f"buffer {uri}": (functools.partial(gltf, buffers=[{"byteLength": 9, "uri": uri}]), "Found")
        for uri in _PATHS
    },
    **{f"image {uri}": (functools.partial(gltf, images=[{"uri": uri}]), 80) for uri in _PATHS},
    "cycle": (lambda: glb(nodes=[{"mesh": 0, "children": [1]}, {"children": [0]}]), "m.glb"),
    "deep": (lambda: glb(nodes=_CHAIN), "levels deep"),
    "many nodes": (lambda: glb(**_GRID), 40 * _NODES),
    "instances": (lambda: _instances(200), 200),
    "deep JSON": (lambda: _bare("m.gltf", b"[" * 100_000), "m.gltf"),
    "zeros": (lambda: _swapped(_zeros(10**12)), "claims 12,000,0"),
    "unused zeros": (lambda: glb(accessors=_UNUSED), "claims 6,400,0"),
    "views": (lambda: glb(bufferViews=_VIEWS), "claims 4,50"),
    "PNG bomb": (lambda: obj(x_png=png(9000, 9000)), 1),
    "glossy": (_gloss, 80),
    "PostScript": (lambda: obj(x_png=_EPS), 1),
}


def main():
    with open("/proc/self/statm", encoding="ascii") as stream:
        size = int(stream.read().split()[0]) * resource.getpagesize()
    for case in WHOLE.values():
        read(case)
    hard = resource.getrlimit(resource.RLIMIT_AS)[1]
    resource.setrlimit(resource.RLIMIT_AS, (size + (1 << 30), hard))
    report = {}
    for name, (make, _) in DANGERS.items():
        case = make()
        start = time.process_time()
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        try:
            outcome = len(read(case).faces)
        except RejectedShapeError as error:
            outcome = str(error)
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - peak
        report[name] = outcome, time.process_time() - start, grown / 1024
    json.dump(report, sys.stdout)


if __name__ == "__main__":
    main()
