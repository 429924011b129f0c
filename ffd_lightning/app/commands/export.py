"""Write a trained network to be handed on: as a small checkpoint, or as ONNX.

    ffd export run=runs/demo/table/r/t16/seed0 out=model.ckpt

writes a checkpoint of a fraction of the size: weights in float16, templates, and nothing that only
further training needs. run=model.ckpt takes it wherever a run or a checkpoint is taken, but for
resuming.

    ffd export run=runs/demo/table/r/t16/seed0 out=model.onnx

writes the network as ONNX, and its templates beside it: usable without torch. The graph takes
batches of any size, standardises images itself, and calls its ends

    images            (batch, 3, H, W) uint8: RGB over white, the object in the middle, its larger
                      side `fill` times the height
    template_weights  (batch, T): the largest is the selected template's
    template_probs    (batch, T): the same before the floor of the training's weights
    offsets           (batch, T, M, 3): dP, displacements of every template's M control points

H, W, `fill` and what the numbers mean are in the file's metadata. `model.templates.npz` holds what
deforms: `ids` (T,), `degrees` (3,), `control_points` (T, M, 3), `part_names`, and of template k's
subdivided mesh `stu_k` (V, 3), its vertices' lattice coordinates in [0, 1], `faces_k` (F, 3),
`colors_k` (F, 4) and, where known, `parts_k` (F,), which count in `part_names` (255: unknown).

From a framed image to a deformed mesh, with numpy and onnxruntime alone:

    from math import comb

    import numpy as np
    import onnxruntime

    image = np.load("framed.npy")  # (H, W, 3) uint8
    network = onnxruntime.InferenceSession("model.onnx", providers=["CPUExecutionProvider"])
    weights, _, offsets = network.run(None, {"images": image.transpose(2, 0, 1)[None]})

    templates = np.load("model.templates.npz")
    k = weights[0].argmax()

    def bernstein(t, n):
        return np.stack([comb(n, i) * t**i * (1 - t) ** (n - i) for i in range(n + 1)], axis=1)

    s, t, u = map(bernstein, templates[f"stu_{k}"].T, templates["degrees"])
    matrix = np.einsum("vi,vj,vk->vijk", s, t, u).reshape(len(s), -1)  # B
    vertices = matrix @ (templates["control_points"][k] + offsets[0, k])  # B (P + dP)
    faces = templates[f"faces_{k}"]

Before it is written, the graph is compared with torch in float64 on eight pictures of the
templates. More than 1e-4 between weights or offsets is an error.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.checkpoint import load_model
from ffd_lightning.errors import ConfigError
from ffd_lightning.inference.export import check_out, export_onnx, templates_file
from ffd_lightning.inference.packed import NUM_POINTS, write_packed
from ffd_lightning.inference.predictor import checkpoint_of

MAIN = "run"


@dataclass
class Settings:
    """Settings of `ffd export`.

    Attributes:
        run: a run folder, or a checkpoint file; null for the model that comes with the package.
        out: the file to write, .onnx or .ckpt; its folder is made where it is missing.
        checkpoint: another checkpoint than the run's newest.
    """

    run: str | None = None
    out: str = "model.onnx"
    checkpoint: str | None = None


def main(settings: Settings) -> int:
    """Export the run that is named, and print what was written.

    Raises:
        ConfigError: no run, no checkpoint, a missing package, or a setting that cannot work.
        DataError: a damaged checkpoint, a graph that differs, or a file that cannot be written.
    """
    out = Path(settings.out).expanduser()
    if out.suffix == ".ckpt":
        return _write_checkpoint(settings, out)
    check_out(out)  # before the checkpoint is read
    model = load_model(_checkpoint(settings))
    notes = {"category": ", ".join(model.categories), "run": str(model.record.get("run", ""))}
    differences = export_onnx(model, out, notes)
    height, width = model.network.image_size
    print(f"{out}: images (batch, 3, {height}, {width}) uint8, {len(model.bank)} templates")
    print(f"{templates_file(out)}: what deforms them")
    found = ", ".join(f"{name} {value:.1e}" for name, value in differences.items())
    print(f"largest difference from torch in float64, on pictures of templates: {found}")
    return 0


def _checkpoint(settings: Settings) -> Path:
    if settings.run is not None and not Path(settings.run).expanduser().exists():
        raise ConfigError(f"there is no run {settings.run}")
    return checkpoint_of(settings.checkpoint or settings.run)


def _write_checkpoint(settings: Settings, out: Path) -> int:
    """Write a small checkpoint, and print what is in it."""
    packed = write_packed(_checkpoint(settings), out)
    model, sizes = packed.model, {k: f"{v / 1e6:.1f} MB" for k, v in packed.parts.items()}
    height, width = model.network.image_size
    print(
        f"{out}: {packed.size / 1e6:.1f} MB, images of {height} x {width}, {len(model.bank)} "
        f"templates of {', '.join(model.categories)}, step {model.step:,}"
    )
    print(
        f"network {sizes['network']} in float16, meshes {sizes['meshes']}, {NUM_POINTS:,} points "
        f"of each template {sizes['clouds']}"
    )
    return 0
