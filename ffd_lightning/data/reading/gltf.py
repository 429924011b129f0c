"""What trimesh would show wrongly of a glTF file: it is mended, warned of or refused."""

import json
import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

from ffd_lightning.errors import RejectedShapeError

_UNSUPPORTED = re.compile(
    rb'KHR_draco_mesh_compression|EXT_meshopt_compression|EXT_mesh_gpu_instancing|"sparse"\s*:'
)
_GLOSS = "KHR_materials_pbrSpecularGlossiness"
_FAN = 6
_HEAD = 20  # bytes of a GLB before its JSON, the last eight its size and kind


def mended(data: bytes, name: str) -> tuple[bytes, list[str]]:
    """Return the content of a .gltf or .glb file, mended, and why textures will be misplaced.

    Raises:
        RejectedShapeError: it has what cannot be read.
    """
    if found := _UNSUPPORTED.search(data):
        raise RejectedShapeError(f"{name} has {found[0].decode()}, which is not supported")
    end = _HEAD + int.from_bytes(data[12:16], "little") if data[:4] == b"glTF" else 0
    with suppress(ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
        tree, before = (json.loads(data[_HEAD:end] if end else data) for _ in range(2))
        _show_diffuse(tree)
        _name_undecoded(tree)
        attributes = [item for p in _primitives(tree) for item in p["attributes"].items()]
        scaled = {kind for kind, k in attributes if tree["accessors"][k].get("normalized")}
        fans = ["triangle fans"] * any(p.get("mode") == _FAN for p in _primitives(tree))
        # Positions that are taken for what they count would tear a scene apart.
        if lost := fans + ["normalized positions"] * ("POSITION" in scaled):
            raise RejectedShapeError(f"{name} has {lost[0]}, which are not supported")
        moved = ["KHR_texture_transform"] * (b"KHR_texture_transform" in data)
        misplaced = moved + ["normalized UVs"] * ("TEXCOORD_0" in scaled)
        return data if tree == before else _written(tree, data, end), misplaced
    return data, []  # it is damaged, and trimesh says how


def _show_diffuse(tree: dict[str, Any]) -> None:
    """Give materials their diffuse colours, and the coordinates that lay their textures.

    trimesh adds the colour of highlights, and takes a mesh's first coordinates.
    """
    materials = tree.get("materials", [])
    for material in materials:
        if (gloss := material.get("extensions", {}).pop(_GLOSS, None)) is not None:
            names = {"diffuseFactor": "baseColorFactor", "diffuseTexture": "baseColorTexture"}
            shown = {new: gloss[old] for old, new in names.items() if old in gloss}
            material["pbrMetallicRoughness"] = shown
    for primitive in _primitives(tree):
        if "material" not in primitive and "COLOR_0" in primitive["attributes"]:
            # trimesh misreads colours of two bytes where there is no material.
            materials = tree.setdefault("materials", materials)
            primitive["material"] = len(materials)
            materials.append({})
        material = materials[primitive["material"]] if "material" in primitive else {}
        texture = material.get("pbrMetallicRoughness", {}).get("baseColorTexture", {})
        own = primitive["attributes"].get(f"TEXCOORD_{texture.get('texCoord', 0)}")
        if own is not None:
            primitive["attributes"]["TEXCOORD_0"] = own


def _name_undecoded(tree: dict[str, Any]) -> None:
    """Have textures of other codecs be absent, by a name that says which: not without a word."""
    for texture in tree.get("textures", ()):
        others = [x for x in texture.get("extensions", ()) if x != "EXT_texture_webp"]
        if "source" not in texture and others:
            tree["images"].append({"uri": f"{others[0]}.png"})
            texture["source"] = len(tree["images"]) - 1


def _primitives(tree: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for mesh in tree.get("meshes", ()):
        yield from mesh["primitives"]


def _written(tree: dict[str, Any], data: bytes, end: int) -> bytes:
    """Return a file with another JSON; in a GLB that ends at `end`, and 0 means that it is all."""
    text = json.dumps(tree).encode()
    if not end:
        return text
    text += b" " * (-len(text) % 4)
    size, own = (n.to_bytes(4, "little") for n in (_HEAD + len(text) + len(data) - end, len(text)))
    return data[:8] + size + own + b"JSON" + text + data[end:]
