"""Digests of what `subjects` hands out, and how they are compared.

Whole numbers and words must stay as they are. Numbers that come from floating point are compared
with a tolerance: sines, matrix products and rendered edges differ in their last digits from one
processor to another, so that no checksum of theirs would be the same everywhere.
"""

import hashlib
import json
import math
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import subjects

FOLDER = Path(__file__).parent
SHAPES = 10  # of each category
COMMAND = "python tests/golden/record.py"

TOLERANCES = {
    # By the name of what is compared: relative, absolute.
    "sums": (1e-7, 1e-9),
    "squares": (1e-7, 1e-9),
    "uv_sums": (1e-5, 1e-5),  # float32
    "stored_sums": (1e-6, 1e-5),  # float32, on which the last digits of float64 fall now and then
    "stored_squares": (1e-6, 1e-5),
    "colors": (0, 0.02),  # of 255, the mean over faces
    "textures": (0, 0.02),
    "points": (0, 0.05),  # of 65534 steps along the diagonal
    "point_spread": (0, 0.05),
    "image": (0, 0.1),  # of 255: one pixel of 3072 may fall to the other side of an edge
    "image_spread": (0, 0.1),
    "steps": (1e-5, 1e-9),  # float64
    "first_step": (2e-3, 1e-9),  # float32
    "means": (2e-3, 1e-9),
    # Of some hundred steps of a descent, which amplify what processors round differently.
    **dict.fromkeys(("fitted_chamfer", "fitted_emd", "fitted_iou"), (1e-2, 1e-9)),
}

_DIRECTIONS = np.random.default_rng(0).uniform(-1, 1, (3, 8))


def shapes(folder: Path) -> dict[str, Any]:
    """Return digests of procedural shapes: the first of each category."""
    return {
        category: _category(category, [f"{category}-{index:06d}" for index in range(SHAPES)])
        for category in subjects.shapes.categories()
    }


def shapes_again(stored: dict[str, Any]) -> dict[str, Any]:
    """Return digests of the shapes that were stored, whatever other shapes may be now."""
    return {category: _category(category, entry["models"]) for category, entry in stored.items()}


def prepared(folder: Path) -> dict[str, Any]:
    """Return what a prepared set says of itself, and digests of its shapes."""
    found = subjects.prepared(folder)
    models = {name: _prepared_model(model) for name, model in found["models"].items()}
    return {"facts": found["facts"], "models": models}


def training(folder: Path) -> dict[str, Any]:
    """Return the terms of the loss in the first steps of each regime.

    In float32 of the first step alone: `subjects.training` says why.
    """
    result = {}
    for regime in subjects.REGIMES:
        found = subjects.training(regime, folder, double=True)
        first = subjects.training(regime, folder, double=False)["steps"][0]
        result[regime] = found | {"weights": len(found["weights"]), "first_step": first}
    return result


def evaluation(folder: Path) -> dict[str, Any]:
    """Return the means of an evaluation of fixed outputs."""
    return {"means": subjects.evaluation(folder)}


KINDS: dict[str, Callable[[Path], dict[str, Any]]] = {
    "shapes": shapes,
    "prepared": prepared,
    "training": training,
    "evaluation": evaluation,
}


def _category(category: str, ids: Iterable[str]) -> dict[str, Any]:
    models = {shape_id: subjects.shape(category, shape_id) for shape_id in ids}
    names = next(iter(models.values()))["part_names"]
    return {"part_names": names, "models": {i: _shape(model) for i, model in models.items()}}


def _shape(model: dict[str, Any]) -> dict[str, Any]:
    return {
        "family": model["family"],
        "counts": [len(model["vertices"]), len(model["faces"])],
        "faces": _sha(model["faces"].astype(np.int64)),
        "face_parts": _sha(model["face_parts"].astype(np.uint8)),
        **_projections(model["vertices"]),
        "colors": model["face_colors"].mean(0).tolist(),
        "texture_shapes": [list(texture.shape) for texture in model["textures"]],
        "textures": [texture.mean((0, 1)).tolist() for texture in model["textures"]],
        "face_textures": _sha(model["face_textures"].astype(np.int16)),
        "uv_sums": _mapped(model).sum((0, 1), np.float64).tolist(),
    }


def _mapped(model: dict[str, Any]) -> np.ndarray:
    """Return the uvs of faces that lie clearly along one axis: of others, rounding decides it."""
    corners = model["vertices"][model["faces"]]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, second, first = np.sort(np.abs(across)).T
    return model["face_uvs"][(second < (1 - 1e-6) * first)[: len(model["face_uvs"])]]


def _prepared_model(model: dict[str, Any]) -> dict[str, Any]:
    points, image = model["points"].astype(np.float64), model["image"].astype(np.float64)
    projections = _projections(model["vertices"])
    return {
        "counts": [len(model["points"]), len(model["vertices"]), len(model["faces"])],
        "faces": _sha(model["faces"].astype(np.int64)),
        "face_parts": _sha(model["face_parts"].astype(np.uint8)),
        "point_parts": _sha(model["point_parts"].astype(np.uint8)),
        "points": points.mean(0).tolist(),
        "point_spread": points.std(0).tolist(),
        "image": image.mean((0, 1)).tolist(),
        "image_spread": image.std((0, 1)).tolist(),
        **{f"stored_{name}": values for name, values in projections.items()},
        "colors": model["face_colors"].mean(0).tolist(),
    }


def _projections(vertices: np.ndarray) -> dict[str, list[float]]:
    """Return sums that change with any vertex, along directions that no symmetry singles out."""
    along = vertices.astype(np.float64) @ _DIRECTIONS
    return {"sums": along.sum(0).tolist(), "squares": (along**2).sum(0).tolist()}


def _sha(array: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest()[:16]


def exactly(value: Any) -> Any:
    """Return a subject with arrays as checksums and numbers in hexadecimal: for one machine."""
    if isinstance(value, dict):
        return {key: exactly(part) for key, part in value.items()}
    if isinstance(value, list):
        return [exactly(part) for part in value]
    if isinstance(value, np.ndarray):
        return f"{value.dtype} {value.shape} {_sha(value)}"
    return value.hex() if isinstance(value, float) else value


def differences(
    stored: Any, found: Any, path: tuple[str, ...] = (), exact: bool = False
) -> Iterator[str]:
    """Yield where two digests differ, as `table/models/table-000003/faces: a -> b`.

    Numbers may differ by their tolerances, unless the digests are `exact`.
    """
    if isinstance(stored, dict) and isinstance(found, dict):
        for key in dict.fromkeys([*stored, *found]):
            if key in stored and key in found:
                yield from differences(stored[key], found[key], (*path, str(key)), exact)
            else:
                yield f"{'/'.join((*path, str(key)))}: {'gone' if key in stored else 'new'}"
    elif isinstance(stored, list) and isinstance(found, list) and len(stored) == len(found):
        for place, pair in enumerate(zip(stored, found, strict=True)):
            yield from differences(*pair, (*path, str(place)), exact)
    elif stored != found if exact else not _same(stored, found, path):
        yield f"{'/'.join(path)}: {stored} -> {found}"


def _same(stored: Any, found: Any, path: tuple[str, ...]) -> bool:
    names = [name for name in path if name in TOLERANCES]
    numbers = all(isinstance(x, int | float) for x in (stored, found))
    if not names or not numbers:
        return bool(stored == found)
    relative, absolute = TOLERANCES[names[-1]]
    return math.isclose(stored, found, rel_tol=relative, abs_tol=absolute)


def read(kind: str) -> dict[str, Any]:
    """Return the golden file of a kind: `versions` and `digests`."""
    return json.loads((FOLDER / f"{kind}.json").read_text(encoding="utf-8"))


def write(kind: str, digests: dict[str, Any]) -> Path:
    """Write the golden file of a kind, a list of numbers a line."""
    content = {"versions": subjects.versions(), "digests": _rounded(digests)}
    text = json.dumps(content, indent=1)
    text = re.sub(r"\[[^][{}]*\]", lambda m: re.sub(r"\s+", " ", m[0]), text)
    path = FOLDER / f"{kind}.json"
    path.write_text(text + "\n", encoding="utf-8")
    return path


def _rounded(value: Any) -> Any:
    """Leave out digits far below any tolerance: they differ wherever the file is written."""
    if isinstance(value, dict):
        return {key: _rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [_rounded(part) for part in value]
    return float(f"{value:.10g}") if isinstance(value, float) else value
