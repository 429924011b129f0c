"""What is written of a reconstruction: meshes, cloud, lattice, a picture and a record."""

from pathlib import Path
from typing import Any, cast

import numpy as np
import trimesh
from trimesh.exchange.obj import export_obj

from ffd_lightning.evaluation.figures import View, cloud_mesh, reconstruction_row
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.grid import grid, png
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.inference.pieces import MeshColors, face_colors
from ffd_lightning.inference.reconstruction import Reconstruction
from ffd_lightning.inference.scenes import glb, lattice_scene, mesh_scene
from ffd_lightning.palette import part_colors

_PREVIEW_POINTS = 4096
_PREVIEW_HEIGHT = 192  # of its cells, pixels: images of less are shown two or more times as large


def write_meshes(
    reconstruction: Reconstruction, folder: Path, colors: MeshColors, obj: bool = False
) -> None:
    """Write `mesh.glb`, `template.glb`, `lattice.glb`, and where asked `mesh.obj`.

    Meshes are in pieces named after their parts. Textures are within the GLB files, and beside the
    OBJ file (`scenes.OBJ_TEXTURES`).
    """
    surface = reconstruction.colored(colors)
    scenes = {
        "template": mesh_scene(reconstruction.bank.meshes[reconstruction.index], colors),
        "mesh": mesh_scene(surface, colors),
        "lattice": lattice_scene(reconstruction),
    }
    for name, scene in scenes.items():
        write_bytes_atomic(folder / f"{name}.glb", glb(scene))
    if obj:
        scene = mesh_scene(surface, colors, linear=False)
        text, materials = export_obj(scene, return_texture=True, mtl_name="mesh.mtl", digits=6)
        for name, content in {**materials, "mesh.obj": text.encode()}.items():
            write_bytes_atomic(folder / name, content)


def write_cloud(
    reconstruction: Reconstruction, path: Path, count: int, seed: int, colors: MeshColors
) -> None:
    """Write points of the deformed surface as PLY: colour and, where known, the part `label`.

    What the labels mean stands in comments of the header: `label 0 leg`; 255 is unknown.
    """
    surface = reconstruction.colored(colors)
    points, faces = reconstruction.sample(count, seed)
    parts = surface.face_parts
    labels: dict[str, Any] = {} if parts is None else {"label": parts[faces]}
    cloud = trimesh.Trimesh(
        points,
        np.zeros((0, 3), np.int64),
        vertex_colors=face_colors(surface, colors)[faces],
        vertex_attributes=labels,
        process=False,
    )
    content = cast(bytes, cloud.export(file_type="ply"))
    names = enumerate(reconstruction.part_names if labels else ())
    notes = "".join(f"comment label {k} {name}\n" for k, name in names).encode()
    write_bytes_atomic(path, content.replace(b"element vertex", notes + b"element vertex", 1))


def write_preview(
    reconstruction: Reconstruction, path: Path, view: RenderSettings, colors: MeshColors
) -> None:
    """Draw what the network saw, its template, the deformed cloud and mesh, and the parts.

    All from the photograph's side; from three quarters, if the network does not know it. `view` has
    the size of the network's own images; small ones are enlarged.
    """
    surface = reconstruction.colored(colors)
    points, faces = reconstruction.sample(_PREVIEW_POINTS)
    template = f"template ({reconstruction.weight:.2f})\n{reconstruction.template_id}"
    meshes = {
        template: reconstruction.bank.meshes[reconstruction.index],
        "deformed cloud": cloud_mesh(points, colors=surface.face_colors[faces]),
        "deformed mesh": surface,
    }
    if surface.face_parts is not None:
        meshes["parts"] = Mesh(surface.vertices, surface.faces, part_colors(surface.face_parts))
    times = max(1, _PREVIEW_HEIGHT // view.height)
    camera = reconstruction.camera or view.picture_camera
    seen = View(camera, times * view.height, times * view.width)
    cells = reconstruction_row(reconstruction.photo.image, list(meshes.values()), seen)
    write_bytes_atomic(path, png(grid(cells, len(cells), ["what the network saw", *meshes])))


def record(reconstruction: Reconstruction) -> dict[str, Any]:
    """Return what `prediction.json` says of the prediction itself."""
    bank, index, weights = reconstruction.bank, reconstruction.index, reconstruction.weights
    lattice, seen = bank.lattices[index], reconstruction.viewpoint
    return {
        "template": {
            "id": reconstruction.template_id,
            "family": bank.families[index],
            "weight": reconstruction.weight,
        },
        "category": {
            "name": reconstruction.category,
            "weights": reconstruction.category_weights,
        },
        "viewpoint": None if seen is None else seen._asdict(),
        "weights": {bank.ids[t]: float(weights[t]) for t in np.argsort(-weights, kind="stable")},
        "lattice": {
            "origin": lattice.origin.tolist(),
            "axes": np.diag(lattice.size).tolist(),
            "degrees": list(lattice.degrees),
        },
        "offsets": reconstruction.offsets[index].tolist(),
        "parts": list(reconstruction.part_names),
        "image": {
            "steps": list(reconstruction.photo.steps),
            "warnings": list(reconstruction.warnings),
        },
        "frame": "y up, facing -z; the template's bounding box has diagonal 1",
    }
