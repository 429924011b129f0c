"""The header of glTF files: checked and mended before trimesh reads what it promises."""

from __future__ import annotations

import json
import math
import struct
from typing import Any, Protocol

from ffd_lightning.data.reading.mesh_text import as_utf8
from ffd_lightning.errors import RejectedShapeError

TEXTURED = "textured"
"""The name that materials are given which name a texture: trimesh forgets absent ones."""

_GLOSS = "KHR_materials_pbrSpecularGlossiness"
_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}  # of a component, by type
_COMPONENTS = {
    "SCALAR": 1,
    "VEC2": 2,
    "VEC3": 3,
    "VEC4": 4,
    "MAT2": 4,
    "MAT3": 9,
    "MAT4": 16,
}
_SPARE_BYTES = 1 << 20  # that a file of any size may claim
_MAX_CLAIM = 16  # times the bytes that are there: parts of a file may share its data
_MAX_BYTES = 1 << 31  # of vertices and faces in memory


class Files(Protocol):
    """Where the buffers are that a header names."""

    def get(self, key: str) -> bytes:
        """Return the content of the file meant by `key`."""
        ...


def mend_gltf(name: str, data: bytes, binary: bool, files: Files) -> bytes:
    """Return a glTF whose header claims no more than there is.

    A header of a few bytes can ask for terabytes of zeros, so what it claims is added up first.
    Textured materials of the specular-glossiness kind keep their diffuse texture only: trimesh
    would take gigabytes to convert one of 4096 x 4096, and the renderer shows no highlights.

    Args:
        name: of the file, for messages.
        data: its content.
        binary: whether it is GLB, a container, rather than the header alone.
        files: where the buffers are that are kept apart.

    Raises:
        RejectedShapeError: it claims more than there is, or is stored sparsely.
        ValueError, LookupError, ArithmeticError, struct.error: the header is damaged.
        OSError: a buffer is missing or cannot be read.
    """
    end = 20 + struct.unpack("<I", data[12:16])[0] if binary else len(data)
    tree = json.loads(as_utf8(data[20:end] if binary else data))
    try:
        uris = [buffer["uri"] for buffer in tree.get("buffers", []) if "uri" in buffer]
        there = len(data) + sum(len(files.get(uri)) for uri in uris if "base64," not in uri)
        _check_claims(name, tree, there)
        for material in tree.get("materials", []):
            _keep_diffuse(material)
            textured = "baseColorTexture" in material.get("pbrMetallicRoughness", {})
            material["name"] = TEXTURED if textured else ""
    except (AttributeError, TypeError) as error:  # a list where an object is due, and the like
        raise ValueError(f"its header is not as glTF's must be: {error}") from error
    header = json.dumps(tree).encode()
    if not binary:
        return header
    header += b" " * (-len(header) % 4)
    length = 20 + len(header) + len(data) - end
    start = data[:8] + struct.pack("<II", length, len(header)) + data[16:20]
    return b"".join((start, header, memoryview(data)[end:]))


def _check_claims(name: str, tree: dict[str, Any], there: int) -> None:
    """Reject a header that claims much more than the bytes that are `there`."""
    accessors = tree.get("accessors", [])
    claim = sum(abs(view["byteLength"]) for view in tree.get("bufferViews", []))
    for accessor in accessors:
        item = _COMPONENTS[accessor["type"]] * _BYTES[accessor["componentType"]]
        claim += abs(accessor["count"]) * item
    memory = 0
    for primitive in (p for mesh in tree.get("meshes", []) for p in mesh["primitives"]):
        first = primitive["attributes"].get("POSITION")
        if first is None:
            continue
        position, corners = accessors[first], accessors[primitive.get("indices", first)]
        if "sparse" in position or "sparse" in corners:
            raise RejectedShapeError(
                f"{name} stores geometry in sparse accessors, which are not supported"
            )
        # 64-bit numbers: three of a vertex, one of a corner
        memory += 24 * abs(position["count"]) + 8 * abs(corners["count"])
    if not math.isfinite(claim) or claim > _SPARE_BYTES + _MAX_CLAIM * there:
        raise RejectedShapeError(f"{name} claims {claim:,} bytes of data and holds {there:,}")
    if memory > _MAX_BYTES:
        raise RejectedShapeError(f"{name} would take {memory / 1e9:.1f} GB of memory")


def _keep_diffuse(material: dict[str, Any]) -> None:
    """Turn a textured specular-glossiness material into its diffuse part."""
    gloss = material.get("extensions", {}).get(_GLOSS)
    if gloss is None:
        return
    gloss.pop("specularGlossinessTexture", None)
    if "diffuseTexture" in gloss:
        material["pbrMetallicRoughness"] = {
            "baseColorTexture": gloss["diffuseTexture"],
            "baseColorFactor": gloss.get("diffuseFactor", [1, 1, 1, 1]),
        }
        del material["extensions"][_GLOSS]
