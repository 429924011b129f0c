"""The same test images, and what each run makes of them: with meshes that can be turned."""

import base64
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ffd_lightning.analysis.figures.examples import Example, in_order, picked, reconstruct
from ffd_lightning.analysis.naming import GROUP, differing, name_of, own_names
from ffd_lightning.analysis.report.meshes import PackedMesh, light_template, lighten, pack
from ffd_lightning.analysis.results import Results
from ffd_lightning.analysis.table import number
from ffd_lightning.errors import DataError, UserError
from ffd_lightning.evaluation.figures import painted
from ffd_lightning.evaluation.opened import OpenRun, RunOpener
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.grid import Color, png
from ffd_lightning.imaging.rendering import render
from ffd_lightning.palette import REGIME_COLORS

DEFORMED: Color = (92, 158, 237)
TRUTH: Color = (199, 196, 189)  # the page's script draws in the same two

_MESH_BYTES = 640_000  # of all meshes before base64, so that a page has 1 to 2 MB
_LEAST_BYTES = 12_000  # of a mesh: with fewer, table tops have holes
_IMAGES = 4  # of a category
_ROWS = 12  # of all categories
_STILL = 180, 240  # height and width: twice what a wide screen shows
_COLORS = 48  # of a flat-shaded picture's palette

Meshes = dict[str, Mapping[str, str | float]]
"""Packed meshes by their names in the page."""


class View(NamedTuple):
    """A mesh that can be turned, by its name, and the still beneath it."""

    mesh: str
    still: str
    described: str
    true: bool = False


class Opened(NamedTuple):
    """Runs that could be opened, by name, and why others could not."""

    runs: dict[str, OpenRun]
    errors: dict[str, str]


def open_runs(results: Results, open_run: RunOpener, limit: int) -> Opened:
    """Open the first seed of each setting; of more than `limit` settings a spread."""
    opened = Opened({}, {})
    for name in picked(results.scored.drop_duplicates(GROUP)["run"].tolist(), "spread", limit):
        try:
            opened.runs[name] = open_run(results.run_folder(name))
        except (UserError, OSError) as error:
            opened.errors[name] = str(error)
    return opened


def gallery(results: Results, opened: Opened, limit: int) -> tuple[dict[str, Any], Meshes]:
    """Return what `gallery.html` shows, images of each category and runs, and the meshes in it."""
    known = results.samples[results.samples["run"].isin(opened.runs)]
    pairs = known[["run", "category"]].drop_duplicates()
    categories = list(dict.fromkeys(pairs["category"]))
    count = max(1, min(_IMAGES, _ROWS // max(1, len(categories))))
    size = max(_LEAST_BYTES, _MESH_BYTES // max(1, count * (len(pairs) + len(categories))))
    meshes: Meshes = {}
    grids = []
    for category in categories:
        rows, why = [], ""
        samples = known[known["category"] == category]
        try:
            for rank, examples in _chosen(results, opened, category, samples, count):
                rows.append(_row(results, rank, examples, size, meshes))
        except (UserError, OSError) as error:
            why = str(error)
        grids.append({"category": category, "rows": rows, "error": why})
    shown = {
        "measure": results.protocol.main_metric,
        "grids": grids,
        "errors": list(opened.errors.items()),
        "runs": len(opened.runs),
        "available": len(results.scored),
        "limit": limit,
    }
    return shown, meshes


def _chosen(
    results: Results, opened: Opened, category: str, samples: pd.DataFrame, count: int
) -> list[tuple[str, dict[str, Example]]]:
    """Return images of a category from the best to the worst, as each run reconstructs them."""
    bare = samples.assign(id=own_names(samples["id"], category))
    order = in_order(bare, results.protocol.main_metric).index.tolist()
    if not order:
        raise DataError("the runs share no test images")
    chosen = picked(order, "spread", count)
    found: dict[str, list[Example]] = {}
    for run, own in samples.groupby("run", sort=False):
        ids = dict(zip(bare.loc[own.index, "id"], own["id"], strict=True))
        queries = [(ids[shape_id], view) for shape_id, view in chosen]
        found[str(run)] = reconstruct(opened.runs[str(run)], queries, own, results.protocol)
    ranks = [f"{order.index(query) + 1} of {len(order)}" for query in chosen]
    return [(rank, {run: e[k] for run, e in found.items()}) for k, rank in enumerate(ranks)]


def _row(
    results: Results, rank: str, examples: Mapping[str, Example], size: int, meshes: Meshes
) -> dict[str, Any]:
    """Return a row of the page, and add its meshes to the others."""
    measure, first = results.protocol.main_metric, next(iter(examples.values()))
    seen = first.view(1).camera  # meshes turn about their middle, at the page's own distance
    camera = Camera(seen.azimuth, seen.elevation)
    truth = pack(*lighten(*first.truth.mesh(), size))
    deformed = {run: pack(*light_template(e.deformed(), size)) for run, e in examples.items()}
    reach = max(np.linalg.norm(m.places(), axis=1).max() for m in (truth, *deformed.values()))
    fit = min(1.0, 0.5 / reach)  # shrunk, all are seen whole as they turn

    def view(mesh: PackedMesh, color: Color, described: str) -> View:
        name = f"mesh-{len(meshes)}"
        meshes[name] = mesh.as_json()
        # As the page's script draws it first.
        solid = painted((fit * mesh.places(), mesh.faces.astype(np.int64)), color)
        picture = data_uri(rendered(solid, camera, _STILL), "image/png")
        return View(name, picture, f"{described}, {rank}", color == TRUTH)

    scores = [float(e.scores[measure.name]) for e in examples.values()]
    best = (max if measure.higher_is_better else min)(scores)
    runs, by = results.runs.set_index("run"), differing(results.scored)
    columns = []
    for (run, example), score in zip(examples.items(), scores, strict=True):
        title = name_of(runs.loc[run].to_dict(), by) or "the network"
        columns.append(
            {
                "title": title,
                "color": REGIME_COLORS.get(str(runs.loc[run, "regime"]), ""),
                "view": view(deformed[run], DEFORMED, title),
                "score": f"{measure.title} {number(measure.factor * score)}",
                "best": score == best and len(set(scores)) > 1,
                "template": str(example.scores["template"]),
                "weight": f"{example.weights.max():.0%}",
            }
        )
    family = first.scores.get("family")
    return {
        "rank": rank,
        "name": f"{first.scores['id']}{f', {family}' if isinstance(family, str) else ''}",
        "image": data_uri(png(first.image[..., :3], 128), "image/png"),
        "columns": columns,
        "truth": view(truth, TRUTH, "ground truth"),
        "azimuth": f"{camera.azimuth:g}",
        "elevation": f"{camera.elevation:g}",
        "fit": f"{fit:.4g}",
    }


def data_uri(content: bytes, kind: str) -> str:
    """Return bytes as an address that holds them."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def rendered(mesh: Mesh, camera: Camera, size: tuple[int, int]) -> bytes:
    """Return a picture of a mesh, without the white that it is rendered over, as PNG."""
    image = render(mesh, camera, height=size[0], width=size[1], samples=2)
    alpha = image[..., 3:].astype(np.float64) / 255
    colors = (image[..., :3] - 255 * (1 - alpha)) / np.maximum(alpha, 1 / 255)
    clear = np.concatenate([colors.clip(0, 255).round().astype(np.uint8), image[..., 3:]], axis=2)
    return png(clear, _COLORS)
