"""The text of mesh files, mended where trimesh would misread it."""

from __future__ import annotations

import re
from collections import Counter

from ffd_lightning.data.reading.files import File
from ffd_lightning.errors import RejectedShapeError

_OFF_HEADER = re.compile(rb"(?:ST)?C?N?OFF(\d*)")
_MANY_SOLIDS = 100


def read_mended(path: File) -> bytes:
    """Return the content of a mesh file in the form that trimesh reads rightly.

    Raises:
        RejectedShapeError: the file is empty, compressed or, for an OFF, incomplete.
        OSError: the file cannot be read.
    """
    data = path.read_bytes()
    if not data or data.isspace():
        raise RejectedShapeError(f"{path.name} is empty")
    if b"KHR_draco_mesh_compression" in data:
        raise RejectedShapeError(
            f"{path.name} is compressed by Draco, which is not supported: export it without"
        )
    kind = path.suffix.lower()
    if kind in (".obj", ".off") or (kind == ".stl" and b"endfacet" in data):
        data = as_utf8(data)
    if kind == ".ply" and not data[: (end := data.find(b"end_header"))].isascii():
        data = as_utf8(data[:end]) + data[end:]
    if kind == ".stl" and (b"endfacet" in data or b"ENDFACET" in data):
        return _one_solid(data)
    if kind == ".off":
        return _plain_off(data, path.name)
    return _absolute_indices(data) if kind == ".obj" else data


def as_utf8(data: bytes) -> bytes:
    """Return text in UTF-8, whatever it was in: older exporters write the system's encoding."""
    if data.isascii():
        return data
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", "replace").encode()
    try:
        data.decode()
    except UnicodeDecodeError:
        return data.decode("latin-1").encode()
    return data.removeprefix(b"\xef\xbb\xbf")


def mended_mtl(data: bytes) -> bytes:
    """Return an MTL whose materials say that they name a texture: trimesh forgets absent ones."""
    return re.sub(rb"(?im)^([ \t]*map_kd[ \t]+\S)", rb"textured yes\n\1", as_utf8(data))


def _one_solid(data: bytes) -> bytes:
    """Put the solids of a text STL into one: trimesh takes quadratic time to name them."""
    facets, count = re.subn(rb"(?im)^[ \t]*(?:end)?solid\b[^\n]*", b"", data)
    if count < _MANY_SOLIDS:
        return data
    return b"solid\n" + facets + b"\nendsolid\n"


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


def _plain_off(data: bytes, name: str) -> bytes:
    """Rewrite an OFF as its header, counts, positions and triangles, one a line.

    The counts may follow the header's word without a blank, as in ModelNet, or come later, and
    the number of edges may be missing. Normals, colours and texture coordinates of vertices and
    colours of faces are dropped, polygons become fans of triangles. trimesh reads triangles and
    quads only, takes a comment that mentions OFF for the header, and reads a file whose end is
    missing without a word.

    Raises:
        RejectedShapeError: it is of a kind that is not supported, or incomplete.
        ValueError: a number is none.
    """
    rows = [row for line in data.splitlines() if (row := line.split(b"#")[0].split())]
    header = _OFF_HEADER.fullmatch(rows[0][0]) if rows else None
    if header is None or b"BINARY" in rows[0]:
        raise RejectedShapeError(
            f"{name} is not of a kind of OFF that can be read: text that begins with OFF, or with "
            "COFF, NOFF or STOFF"
        )
    counts, start = [header[1], *rows[0][1:]] if header[1] else rows[0][1:], 1
    while len(counts) < 2 and start < len(rows):
        counts, start = counts + rows[start], start + 1
    if len(counts) < 2 or not (counts[0].isdigit() and counts[1].isdigit()):
        raise RejectedShapeError(f"{name} does not say how many vertices and faces it has")
    num_vertices, num_faces = int(counts[0]), int(counts[1])
    vertices = rows[start : start + num_vertices]
    faces = rows[start + num_vertices : start + num_vertices + num_faces]
    for kind, there, promised in (
        ("vertices", vertices, num_vertices),
        ("faces", faces, num_faces),
    ):
        if len(there) < promised:
            raise RejectedShapeError(
                f"{name} is incomplete: it has {len(there):,} of {promised:,} {kind}"
            )
    if any(len(row) < 3 for row in vertices) or any(len(row) <= int(row[0]) for row in faces):
        raise RejectedShapeError(f"{name} is incomplete: a vertex or a face lacks numbers")
    fans = [[b"3", r[1], r[k], r[k + 1]] for r in faces for k in range(2, int(r[0]))]
    lines = [b"OFF", b"%d %d 0" % (num_vertices, len(fans))]
    return b"\n".join(lines + [b" ".join(row[:3]) for row in vertices] + list(map(b" ".join, fans)))
