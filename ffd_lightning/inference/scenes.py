"""Meshes and lattices as trimesh's scenes, which it writes as GLB and OBJ files."""

from typing import cast

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual.material import PBRMaterial

from ffd_lightning.evaluation.figures import lattice_mesh
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.inference.pieces import MeshColors, pieces
from ffd_lightning.inference.reconstruction import Reconstruction

OBJ_TEXTURES = "mesh-texture-*.png"
"""Names of the pictures beside an OBJ file, as a pattern: trimesh calls them by their materials."""

_PALETTE = 64  # colours of one mesh
_BEFORE, _AFTER = (150, 150, 150, 255), (214, 39, 40, 255)


def mesh_scene(surface: Mesh, colors: MeshColors, linear: bool = True) -> trimesh.Scene:
    """Return a mesh as a scene of its pieces.

    `linear` gives the colours as glTF wants them, which is linear light.
    """
    result = trimesh.Scene()
    images = [_picture(texture) for texture in surface.textures]
    for k, piece in enumerate(pieces(surface, colors, _PALETTE)):
        mesh = trimesh.Trimesh(surface.vertices[piece.vertices], piece.faces, process=False)
        name = f"{piece.name}-{k}"
        image = None if piece.texture < 0 else images[piece.texture]
        see_through = piece.rgba[3] < 255 if image is None else image.mode == "RGBA"
        material = PBRMaterial(
            # Pieces that have a texture in common share its material, and so its image.
            name=name if image is None else f"mesh-texture-{piece.texture}",
            baseColorFactor=_linear(piece.rgba) if linear else piece.rgba,
            baseColorTexture=image,
            alphaMode="BLEND" if see_through else "OPAQUE",
            doubleSided=True,
            metallicFactor=0.0,
            roughnessFactor=0.9,
        )
        mesh.visual = trimesh.visual.TextureVisuals(uv=piece.uvs, material=material)
        result.add_geometry(mesh, node_name=name, geom_name=name)
    return result


def glb(scene: trimesh.Scene) -> bytes:
    """Return a scene as a GLB file's content."""
    return cast(bytes, scene.export(file_type="glb"))


def _linear(rgba: tuple[int, int, int, int]) -> NDArray[np.uint8]:
    """Return a colour, (4,), as linear light: so a glTF material has it, though no texture has."""
    light = trimesh.visual.color.srgb_to_linear(np.array(rgba[:3]) / 255)
    return np.append(np.round(255 * light), rgba[3]).astype(np.uint8)


def _picture(texture: NDArray[np.uint8]) -> Image.Image:
    """Return a texture as a picture, with alpha where it has any."""
    picture = Image.fromarray(texture)
    return picture if texture[..., 3].min() < 255 else picture.convert("RGB")


def lattice_scene(reconstruction: Reconstruction) -> trimesh.Scene:
    """Return the control cage as it is (grey, named `before`) and deformed (red, `after`)."""
    bank, index = reconstruction.bank, reconstruction.index
    before = bank.control_points[index].numpy()
    after = before + reconstruction.offsets[index]
    result = trimesh.Scene()
    for name, points, color in (("before", before, _BEFORE), ("after", after, _AFTER)):
        lattice = lattice_mesh(points.astype(float), bank.degrees)
        cage = trimesh.Trimesh(lattice.vertices, lattice.faces, process=False)
        cage.visual = trimesh.visual.TextureVisuals(
            material=PBRMaterial(name=name, baseColorFactor=_linear(color), roughnessFactor=0.9)
        )
        result.add_geometry(cage, node_name=name, geom_name=name)
    return result
