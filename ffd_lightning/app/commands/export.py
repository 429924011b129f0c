"""Write a trained network to be handed on: as a small checkpoint, or as ONNX.

    ffd export run=runs/demo/table/r/t16/seed0 out=model.ckpt
    ffd export run=runs/demo/table/r/t16/seed0 out=model.onnx
    ffd export run=RUN out=catalogue.ckpt templates=my_meshes yaw=180

The first has weights in float16, templates, and nothing that only further training needs;
run=model.ckpt takes it wherever a run or a checkpoint is taken, but for resuming. The second is
usable without torch, with its templates in model.templates.npz: docs/inference.md says what is in
both, and deforms a template with them. Before it is written, the graph is compared with torch in
float64 on eight pictures of the templates. More than 1e-4 between weights or offsets is an error.
With templates= either file holds these in place of the network's own, or, with beside=true, beside
them, and needs no mesh files.
"""

from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.app.config import TemplateSettings
from ffd_lightning.checkpoint import load_model
from ffd_lightning.inference.export import check_out, export_onnx, templates_file, write_packed
from ffd_lightning.inference.own_templates import tell
from ffd_lightning.inference.predictor import checkpoint_of
from ffd_lightning.terminal import counted

MAIN = "run"


@dataclass
class Settings(TemplateSettings):
    """Settings of `ffd export`.

    Attributes:
        run: a run folder, or a checkpoint file; null for the model that comes with the package.
        out: the file to write, .onnx or .ckpt; its folder is made where it is missing.
        data_root: the meshes of templates= are prepared once, and kept there.
    """

    run: str | None = None
    out: str = "model.onnx"
    data_root: str = "data"


def main(settings: Settings) -> int:
    """Export the run that is named, and print what was written."""
    out = Path(settings.out)
    if out.suffix != ".ckpt":
        check_out(out)  # before the checkpoint is read
    checkpoint = checkpoint_of(settings.run)
    model = load_model(checkpoint)
    if (own := settings.named_templates(model, settings.data_root)) is not None:
        model = tell(model, own, beside=settings.beside)
    height, width = model.network.image_size
    if out.suffix == ".ckpt":
        write_packed(checkpoint, out, model)
        print(
            f"{out}: {out.stat().st_size / 1e6:.1f} MB, images of {height} x {width}, "
            f"{counted(len(model.bank), 'template')}, trained on {', '.join(model.categories)}, "
            f"step {model.step:,}"
        )
        return 0
    notes = {"category": ", ".join(model.categories), "run": str(model.record.get("run", ""))}
    differences = export_onnx(model, out, notes)
    templates = counted(len(model.bank), "template")
    print(f"{out}: images (batch, 3, {height}, {width}) uint8, {templates}")
    print(f"{templates_file(out)}: what deforms them")
    found = ", ".join(f"{name} {value:.1e}" for name, value in differences.items())
    print(f"largest difference from torch in float64, on pictures of templates: {found}")
    return 0
