"""The text of mesh files, mended where trimesh would misread it."""

from __future__ import annotations

import re
from collections import Counter

from ffd_lightning.data.sources.files import File
from ffd_lightning.errors import RejectedModelError


def read_mended(path: File) -> bytes:
    """Return the content of a mesh file in the form that trimesh reads rightly.

    Raises:
        RejectedModelError: the file is empty or compressed.
        OSError: the file cannot be read.
    """
    data = path.read_bytes()
    if not data.strip():
        raise RejectedModelError(f"{path.name} is empty")
    if b"KHR_draco_mesh_compression" in data:
        raise RejectedModelError(
            f"{path.name} is compressed by Draco, which is not supported: export it without"
        )
    kind = path.suffix.lower()
    if kind in (".obj", ".off") or (kind == ".stl" and b"endfacet" in data):
        data = as_utf8(data)
    if kind == ".ply":
        header, end, body = data.partition(b"end_header")
        data = as_utf8(header) + end + body
    repair = {".obj": _absolute_indices, ".off": _fan_polygons}.get(kind)
    return repair(data) if repair else data


def as_utf8(data: bytes) -> bytes:
    """Return text in UTF-8, whatever it was in: older exporters write the system's encoding."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace").encode()
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data.removeprefix(b"\xef\xbb\xbf")


def _absolute_indices(data: bytes) -> bytes:
    """Replace an OBJ's negative indices, which count back from the line they stand in.

    trimesh takes them to count back from the end of the file.
    """
    if not re.search(rb"^f[^\n]*[ \t/]-\d", data, re.MULTILINE):
        return data
    lines = re.sub(rb"\\\r?\n", b" ", data).splitlines()
    seen: Counter[bytes] = Counter()
    for i, line in enumerate(lines):
        words = line.split()
        if not words:
            continue
        if words[0] != b"f":
            seen[words[0]] += 1
            continue
        counts = (seen[b"v"], seen[b"vt"], seen[b"vn"])
        for k, word in enumerate(words[1:], 1):
            pairs = zip(word.split(b"/"), counts, strict=False)
            words[k] = b"/".join(
                b"%d" % (int(x) + n + 1) if x.startswith(b"-") else x for x, n in pairs
            )
        lines[i] = b" ".join(words)
    return b"\n".join(lines)


def _fan_polygons(data: bytes) -> bytes:
    """Split an OFF's polygons into fans of triangles; trimesh reads triangles and quads only."""
    head, _, body = data.partition(b"OFF")
    rows = [row for line in body.splitlines() if (row := line.split(b"#")[0].split())]
    num_vertices, num_faces = int(rows[0][0]), int(rows[0][1])
    faces = rows[1 + num_vertices : 1 + num_vertices + num_faces]
    if all(row[0] == b"3" for row in faces):
        return data
    fans = [[b"3", r[1], r[k], r[k + 1]] for r in faces for k in range(2, int(r[0]))]
    counts = b"%d %d 0" % (num_vertices, len(fans))
    lines = [head + b"OFF", counts, *map(b" ".join, rows[1 : 1 + num_vertices] + fans)]
    return b"\n".join(lines)
