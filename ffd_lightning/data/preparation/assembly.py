"""Joining the files of single shapes into a prepared set, and putting it in place at once."""

from __future__ import annotations

import csv
import importlib.metadata
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

import numpy as np

from ffd_lightning.data.preparation.prepared import (
    FILES,
    MANIFEST,
    REJECTED,
    WARNINGS,
    file_digest,
    manifest_digest,
)
from ffd_lightning.data.preparation.shape_file import Recipe
from ffd_lightning.errors import DataError
from ffd_lightning.files import put_on_disk

_PACKAGES = ("ffd_lightning", "numpy", "embreex")


def assemble(
    recipe: Recipe,
    ids: Sequence[str],
    reasons: Mapping[str, str],
    settings: dict[str, Any],
    target: Path,
) -> None:
    """Write the set of all finished shapes beside `target`, then rename it to that.

    Args:
        recipe: how the shapes were made, and where their files are.
        ids: the shapes that were tried, in the order of the set.
        reasons: why shapes are not in it, by id.
        settings: what decides the set; goes into the manifest.
        target: the set's folder, not there yet.

    Raises:
        DataError: there is no usable shape; the first reasons are named.
        OSError: a file cannot be written.
    """
    good = [i for i in ids if i not in reasons]
    rejected = [(i, reasons[i]) for i in ids if i in reasons]
    if not good:
        first = "; ".join(f"{i}: {why}" for i, why in rejected[:3])
        found = f"all {len(rejected)} are rejected ({first})" if rejected else "there are none"
        raise DataError(f"no usable shape of {recipe.category}: {found}")
    folder = target.with_name(f".{target.name}.tmp")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    facts = _write_shapes(recipe, good, folder)
    warnings = facts.pop("warnings")
    _write_table(folder / REJECTED, "reason", rejected)
    _write_table(folder / WARNINGS, "warning", warnings)
    manifest = {
        "settings": settings,
        "versions": {name: _version(name) for name in _PACKAGES},
        "models": len(good),
        "rejected": len(rejected),
        "warnings": len({shape_id for shape_id, _ in warnings}),
        "ids": good,
        **facts,
        "files": {
            name: {"bytes": (folder / name).stat().st_size, "sha256": file_digest(folder / name)}
            for name in sorted(FILES)
        },
    }
    manifest["sha256"] = manifest_digest(manifest)
    (folder / MANIFEST).write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")
    for path in (*folder.iterdir(), folder):
        put_on_disk(path)
    folder.rename(target)
    put_on_disk(target.parent)


def _write_shapes(recipe: Recipe, ids: Sequence[str], folder: Path) -> dict[str, Any]:
    """Write all arrays, one shape after the other; return what the manifest says of them.

    Plain appending writes: filling a memory map on a full disk would kill the process.
    """
    facts: dict[str, Any] = {"families": [], "part_names": [], "image_shape": None, "warnings": []}
    image_sizes, mesh_sizes, cameras = [], [], []
    with ExitStack() as stack:
        points, images, meshes = (
            stack.enter_context((folder / f"{name}.npy").open("wb"))
            for name in ("points", "images", "meshes")
        )
        for row, model in enumerate(_models(recipe, ids)):
            cloud, shape = model["points"], model["image_shape"].tolist()
            if row == 0:
                facts["image_shape"] = shape
                _write_header(points, np.dtype(np.int16), (len(ids), *cloud.shape))
                for file in (images, meshes):
                    _write_header(file, np.dtype(np.uint8), (0,))
            if shape != facts["image_shape"]:
                raise DataError(
                    f"{ids[row]} of {recipe.category} has images {shape}, others have "
                    f"{facts['image_shape']}: the source must give all shapes as many views"
                )
            facts["families"].append(str(model["family"]))
            facts["part_names"] += model["part_names"].tolist()
            facts["warnings"] += [(ids[row], line) for line in str(model["warning"]).splitlines()]
            for file, array in (
                (points, cloud),
                (images, model["images"]),
                (meshes, model["mesh"]),
            ):
                file.write(array.tobytes())
            image_sizes += model["image_sizes"].tolist()
            cameras.append(model["cameras"])
            mesh_sizes.append(len(model["mesh"]))
        for file, sizes in ((images, image_sizes), (meshes, mesh_sizes)):
            file.seek(0)
            _write_header(file, np.dtype(np.uint8), (sum(sizes),))
    np.save(folder / "cameras.npy", np.stack(cameras))
    for name, sizes in (("image", image_sizes), ("mesh", mesh_sizes)):
        np.save(folder / f"{name}_offsets.npy", np.cumsum([0, *sizes], dtype=np.int64))
    return facts | {"part_names": list(dict.fromkeys(facts["part_names"]))}


def _write_header(file: IO[bytes], dtype: np.dtype, shape: tuple[int, ...]) -> None:
    """Write the header of a .npy file whose values follow."""
    header = {
        "descr": np.lib.format.dtype_to_descr(dtype),
        "fortran_order": False,
        "shape": shape,
    }
    np.lib.format.write_array_header_1_0(file, header)


def _models(recipe: Recipe, ids: Sequence[str]) -> Iterator[Any]:
    """Yield the contents of each shape's file; arrays are read when they are asked for."""
    for shape_id in ids:
        with np.load(recipe.file(shape_id), allow_pickle=False) as arrays:
            yield arrays


def _write_table(file: Path, column: str, rows: Sequence[tuple[str, str]]) -> None:
    with file.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream, lineterminator="\n").writerows([("id", column), *rows])


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"
