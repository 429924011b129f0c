"""Miniature ShapeNetCore trees, good shapes and bad ones, in every published layout."""

import zipfile

import numpy as np
from trees import png, write_folder

from ffd_lightning.data.sources.procedural import ProceduralSource

__all__ = ["BAD", "CHAIR", "bad_models", "good_models", "model_text", "write_folder", "write_zips"]

CHAIR = "03001627"
LAYOUTS = {"v1": "{synset}/{model}/model", "v2": "{synset}/{model}/models/model_normalized"}


def model_text(index=0, texture=None):
    """OBJ and MTL of a procedural chair: a material per colour, or one texture for all."""
    mesh = ProceduralSource(4).load("chair", f"chair-{index:06d}").mesh
    colors, material = np.unique(mesh.face_colors, axis=0, return_inverse=True)
    obj = ["mtllib {stem}.mtl", *(f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in mesh.vertices)]
    obj += ["vt 0 0", "vt 1 0", "vt 0 1"]
    for k in range(len(colors)):
        obj.append(f"usemtl m{k}")
        obj += [f"f {a}/1 {b}/2 {c}/3" for a, b, c in mesh.faces[material == k] + 1]
    mtl = []
    for k, color in enumerate(colors):
        mtl += [f"newmtl m{k}", "Kd {:.3f} {:.3f} {:.3f}".format(*color[:3] / 255)]
        mtl += [f"map_Kd {texture}"] if texture else []
    return "\n".join(obj) + "\n", "\n".join(mtl) + "\n"


GOOD = {
    "nomtl": (None, {}),
    "plain": (None, {}),
    "textured": ("../images/texture0.png", {"images/texture0.png": png()}),
    "windows": (r"C:\\Users\\me\\maps\\Wood.PNG", {"images/wood.png": png((30, 200, 30))}),
}


def good_models(layout, synset=CHAIR):
    """Return {path: content} of four shapes that must come through."""
    files = {}
    for k, (name, (texture, side)) in enumerate(GOOD.items()):
        stem = LAYOUTS[layout].format(synset=synset, model=name)
        obj, mtl = model_text(k, texture)
        files[f"{stem}.obj"] = obj.replace("{stem}", stem.rsplit("/", 1)[1]).encode()
        if name != "nomtl":
            files[f"{stem}.mtl"] = mtl.encode()
        files |= {f"{synset}/{name}/{path}": content for path, content in side.items()}
    return files


BAD = {
    "absent": (None, r"it has no (model\.obj|models/model_normalized\.obj)"),
    "empty": (b"", "is empty"),
    "nan": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "no face with a finite area"),
    "noise": (bytes(range(256)) * 9, "model"),
    "points": (b"v 0 0 0\nv 1 0 0\n", "no faces"),
}


def bad_models(layout, synset=CHAIR):
    """Return {path: content} of shapes that must be rejected for the reasons in `BAD`."""
    files = {}
    for name, (content, _) in BAD.items():
        stem = LAYOUTS[layout].format(synset=synset, model=name)
        files[f"{synset}/{name}/images/x.png"] = png()
        if content is not None:
            files[f"{stem}.obj"] = content
    return files


def write_zips(root, files, prefix=True):
    """Write one archive per synset, with the synset's folder in it or without."""
    root.mkdir(parents=True, exist_ok=True)
    for synset in sorted({path.split("/")[0] for path in files}):
        with zipfile.ZipFile(root / f"{synset}.zip", "w", zipfile.ZIP_DEFLATED) as archive:
            for path, content in files.items():
                if path.startswith(synset):
                    archive.writestr(path if prefix else path.split("/", 1)[1], content)
    return root
