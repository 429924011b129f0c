"""What of a mesh's materials could not be had, in words: the shape can be used all the same.

Each note is "what: which"; what stands before the colon is the kind by which notes are counted.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import PurePath

from PIL import Image

ABSENT_TEXTURES = "textures that the materials name are absent"
ABSENT_LIBRARIES = "material files are absent"
UNDECODABLE = "textures cannot be decoded"
UNDEFINED = "materials are defined nowhere"
REPEATED = "materials are defined more than once, differently"

_NAMED = 5  # of each kind; a model may lack hundreds


def material_notes(
    missing: Iterable[str],
    found: Mapping[str, bytes],
    undecodable: Iterable[str],
    used: Iterable[str] = (),
) -> tuple[str, ...]:
    """Return what a user should know of a mesh's materials, a note a kind.

    Args:
        missing: names of files that the mesh or its materials name and that are not there.
        found: the contents of those that are, by name.
        undecodable: names of textures that are not pictures, as far as they are known.
        used: names of the materials that an OBJ asks for.
    """
    names = dict.fromkeys(missing)
    libraries = [name for name in names if name.lower().endswith(".mtl")]
    broken = [name for name, data in found.items() if _is_texture(name) and not _opens(data)]
    defined: set[str] = set()
    repeated: list[str] = []
    for data in (data for name, data in found.items() if name.lower().endswith(".mtl")):
        known: dict[str, list[list[bytes]]] = {}
        for material, content in _materials(data):
            if known.setdefault(material, content) != content:  # the last one counts
                repeated.append(material)
        defined.update(known)
    kinds = {
        ABSENT_LIBRARIES: libraries,
        ABSENT_TEXTURES: [name for name in names if name not in libraries],
        UNDECODABLE: [*broken, *undecodable],
        UNDEFINED: [] if libraries else sorted(set(used) - defined),
        REPEATED: repeated,
    }
    return tuple(f"{kind}: {_some(which)}" for kind, which in kinds.items() if which)


def _some(names: Iterable[str]) -> str:
    """Return the first few different names, and how many more there are."""
    distinct = list(dict.fromkeys(names))
    more = f" and {len(distinct) - _NAMED} more" if len(distinct) > _NAMED else ""
    return ", ".join(distinct[:_NAMED]) + more


def _is_texture(name: str) -> bool:
    return PurePath(name).suffix.lower() in Image.registered_extensions()


def _opens(data: bytes) -> bool:
    """Return whether a picture's header can be read; what follows it is seen when it is used."""
    try:
        with Image.open(io.BytesIO(data)):
            return True
    except Exception:  # Pillow raises many kinds on damaged images
        return False


def used_materials(obj: bytes) -> set[str]:
    """Return the materials that an OBJ gives its faces."""
    return {_name(line) for line in re.findall(rb"(?m)^usemtl[ \t]+(\S.*)$", obj)}


def _materials(mtl: bytes) -> Iterator[tuple[str, list[list[bytes]]]]:
    """Yield the name of each material of an MTL, and its lines in words."""
    _, *blocks = re.split(rb"(?im)^[ \t]*newmtl[ \t]+", mtl)
    for block in blocks:
        first, *rest = block.splitlines() or [b""]
        content = [words for line in rest if (words := line.split()) and words[0][:1] != b"#"]
        yield _name(first), content


def _name(text: bytes) -> str:
    return b" ".join(text.split()).decode("utf-8", "replace")
