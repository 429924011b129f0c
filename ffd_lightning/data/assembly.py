"""Joining the files of single models into a prepared set, and putting it in place at once."""

from __future__ import annotations

import csv
import importlib.metadata
import json
import os
import shutil
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from ffd_lightning.data.model_file import Recipe
from ffd_lightning.data.prepared import MANIFEST, REJECTED, UNKNOWN_PART, file_digest
from ffd_lightning.errors import DataError

_PER_MODEL = ("images", "points", "face_ids", "point_parts")
_PER_FACE = ("faces", "face_parts", "face_colors")
_PARTS = ("point_parts", "face_parts")
_PACKAGES = ("ffd_lightning", "numpy", "embreex")


def assemble(recipe: Recipe, ids: Sequence[str], settings: dict[str, Any], target: Path) -> None:
    """Write the set of all finished models beside `target`, then rename it to that.

    Args:
        recipe: how the models were made, and where their files are.
        ids: the models that were tried, in the order of the set.
        settings: what decides the set; goes into the manifest.
        target: the set's folder, not there yet.

    Raises:
        DataError: there is no usable model; the first reasons are named.
        OSError: a file cannot be written.
    """
    good = [i for i in ids if recipe.file(i).exists()]
    rejected = [
        (i, recipe.rejection(i).read_text(encoding="utf-8"))
        for i in ids
        if recipe.rejection(i).exists()
    ]
    if not good:
        reasons = "; ".join(f"{i}: {why}" for i, why in rejected[:3])
        found = f"all {len(rejected)} are rejected ({reasons})" if rejected else "there are none"
        raise DataError(f"no usable model of {recipe.category}: {found}")
    folder = target.with_name(f".{target.name}.tmp")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    with (folder / REJECTED).open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([("id", "reason"), *rejected])
    families, part_names = _write_arrays(recipe, good, folder)
    manifest = {
        "settings": settings,
        "versions": {name: _version(name) for name in _PACKAGES},
        "models": len(good),
        "rejected": len(rejected),
        "ids": good,
        "families": families,
        "part_names": part_names,
        "files": {path.stem: _facts(path) for path in sorted(folder.glob("*.npy"))},
    }
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")
    for path in (*folder.iterdir(), folder):
        _sync(path)
    folder.rename(target)
    _sync(target.parent)


def _write_arrays(
    recipe: Recipe, ids: Sequence[str], folder: Path
) -> tuple[list[str], tuple[str, ...]]:
    """Write all arrays, one model after the other; return families by model and part names.

    Plain appending writes: filling a memory map on a full disk would kill the process.
    """
    offsets = np.zeros((len(ids) + 1, 2), np.int64)
    families: list[str] = []
    part_names: dict[str, None] = {}  # a set that keeps its order
    for row, model in enumerate(_models(recipe, ids)):
        offsets[row + 1] = offsets[row] + (len(model["vertices"]), len(model["faces"]))
        families.append(str(model["family"]))
        part_names.update(dict.fromkeys(model["part_names"].tolist()))
    lengths = dict.fromkeys(_PER_MODEL, len(ids))
    lengths |= {"vertices": int(offsets[-1, 0])} | dict.fromkeys(_PER_FACE, int(offsets[-1, 1]))
    with ExitStack() as stack:
        files: dict[str, IO[bytes]] = {}
        for name in lengths:
            if part_names or name not in _PARTS:
                files[name] = stack.enter_context((folder / f"{name}.npy").open("wb"))
        for row, model in enumerate(_models(recipe, ids)):
            numbers = _part_numbers(model["part_names"].tolist(), list(part_names))
            for name, file in files.items():
                array = numbers[model[name]] if name in _PARTS else model[name]
                if row == 0:
                    rest = array.shape if name in _PER_MODEL else array.shape[1:]
                    _write_header(file, array.dtype, (lengths[name], *rest))
                file.write(array.tobytes())
    np.save(folder / "mesh_offsets.npy", offsets)
    return families, tuple(part_names)


def _part_numbers(own: list[str], all_names: list[str]) -> NDArray[np.uint8]:
    """Return the table from a model's own part labels to the set's, (256,)."""
    table = np.full(256, UNKNOWN_PART, np.uint8)
    table[: len(own)] = [all_names.index(name) for name in own]
    return table


def _write_header(file: IO[bytes], dtype: np.dtype, shape: tuple[int, ...]) -> None:
    """Write the header of a .npy file whose values follow."""
    header = {
        "descr": np.lib.format.dtype_to_descr(dtype),
        "fortran_order": False,
        "shape": shape,
    }
    np.lib.format.write_array_header_1_0(file, header)


def _models(recipe: Recipe, ids: Sequence[str]) -> Iterator[Any]:
    """Yield the contents of each model's file; arrays are read when they are asked for."""
    for model_id in ids:
        with np.load(recipe.file(model_id), allow_pickle=False) as arrays:
            yield arrays


def _facts(file: Path) -> dict[str, Any]:
    """Return what opening and `verify` compare with."""
    array = np.load(file, mmap_mode="r", allow_pickle=False)
    return {
        "shape": list(array.shape),
        "dtype": str(array.dtype),
        "bytes": file.stat().st_size,
        "sha256": file_digest(file),
    }


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"


def _sync(path: Path) -> None:
    """Have a file or a folder on the disk before going on."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
