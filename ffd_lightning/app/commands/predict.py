"""Reconstruct what photographs show.

    ffd predict image=photo.png                     by the model that comes with this
    ffd predict image=photo.png category=chair      what it shows need not be guessed
    ffd predict run=runs/demo/table/r/t16/seed0 image=photos out=predictions
    ffd predict run=last.ckpt 'image=photos/*.jpg' mask=masks
    ffd predict image=[a.png,b.png] points=200000 top_k=3 obj=true colors=parts
    ffd predict run=RUN image=photo.png templates=my_meshes up=z yaw=180

Writes for each image a folder below `out`: mesh.glb (the deformed template, subdivided),
template.glb, lattice.glb (control cage before and after), cloud.ply, prediction.json and
preview.png; with top_k=3 the next candidates too. An object is told from its background by a mask,
by transparency, or by the border's colour. A network of heads=conditioned takes any meshes as
templates: a folder, files or a pattern (obj, glb, gltf, ply, off, stl). The same command again
makes only what is not there yet. The exit code is 1 if a photograph failed.
"""

from __future__ import annotations

from ffd_lightning.app.predict import PredictSettings as Settings
from ffd_lightning.app.predict import predict_files

MAIN = "image"


def main(settings: Settings) -> int:
    """Reconstruct photographs, and say how many."""
    outcomes = predict_files(settings)
    failed = sum(bool(outcome.error) for outcome in outcomes)
    known = sum(outcome.known for outcome in outcomes)
    if len(outcomes) > 1 or known:
        there = f", {known} of them there already (restart=true does them again)" if known else ""
        done = f"{len(outcomes) - failed} of {len(outcomes)}"
        print(f"{done} photographs done{there}: {settings.out}")
    return int(failed > 0)
