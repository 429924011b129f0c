"""A trained network to be handed on: as a small checkpoint, or as ONNX, with its templates."""

import copy
import importlib
import io
import json
import logging
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ffd_lightning.checkpoint import TrainedModel, load_model, read_checkpoint
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.files import write_bytes_atomic
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render
from ffd_lightning.nn.network import TemplateFfdNetwork

NUM_POINTS = 2048
"""Points of each template's cloud that a small checkpoint keeps; it keeps the meshes whole."""

OUTPUTS = ("template_weights", "template_probs", "offsets")

TOLERANCE = 1e-4
"""Largest difference from torch: of weights, and of offsets in units of a template's diagonal."""

_OPSET = 18  # ONNX's version of operators
_IMAGES = 8
_MEANING = {
    "template_weights": "the largest is the selected template's; they sum to 1",
    "offsets": "dP, displacements of the control points P, in units of the bounding box's diagonal",
    "deformation": "B (P + dP); row v of B holds the products b_i(s) b_j(t) b_k(u) of vertex v's "
    "lattice coordinates (s, t, u), k fastest; b_i(t) = binomial(n, i) t^i (1 - t)^(n - i) for "
    "an axis of degree n",
    "frame": "y up, facing -z, bounding box of diagonal 1 centred at the origin",
}


def export_onnx(
    model: TrainedModel, out: Path, notes: Mapping[str, str] | None = None
) -> dict[str, float]:
    """Write a model's network as ONNX, checked, and its templates beside it.

    Args:
        model: a checkpoint's content.
        out: the file, `.onnx`; see `templates_file` for the templates'. Folders are made, files
            there replaced, and never left half written.
        notes: what the file says of itself beside the images, the templates and the step.

    Returns:
        The largest absolute difference of each output from torch's.

    Raises:
        ConfigError: see `check_out`; or torch cannot export this network.
        DataError: the graph differs from torch by more than 1e-4.
    """
    check_out(out)
    content = build_graph(model, notes).SerializeToString()
    differences = compare(model, content)
    for name, difference in differences.items():
        if not difference <= TOLERANCE:  # nan, too, of a training that diverged
            raise DataError(
                f"the graph's {name} differ from torch's by {difference:.1e}, more than "
                f"{TOLERANCE:.0e}: nothing was written"
            )
    buffer = io.BytesIO()
    np.savez_compressed(buffer, **pack_templates(model.bank))
    write_bytes_atomic(templates_file(out), buffer.getvalue())
    write_bytes_atomic(out, content)
    return differences


def templates_file(out: Path) -> Path:
    """Return where the templates of an ONNX file are."""
    return out.with_suffix(".templates.npz")


def check_out(out: Path) -> None:
    """Refuse what cannot work before anything is computed.

    Raises:
        ConfigError: the file to write does not end in .onnx, or a package is missing.
    """
    if out.suffix != ".onnx":
        raise ConfigError(
            f"out={out} must be a file that ends in .onnx or .ckpt: out={out}/model.onnx, say"
        )
    try:
        for name in ("onnx", "onnxscript", "onnxruntime"):
            importlib.import_module(name)
    except ImportError as error:  # missing, or without a library of its own
        raise ConfigError(
            f"exporting needs {name} ({error}): pip install 'ffd_lightning[onnx]'"
        ) from None


class _Graph(nn.Module):
    """The network behind an exact standardisation, with the outputs of `OUTPUTS` in order."""

    def __init__(self, network: TemplateFfdNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, images: Tensor) -> tuple[Tensor, ...]:
        # float64 for the standardisation alone, the network goes on in float32: sums over all
        # values of a mostly white image lose three digits in float32, in each runtime others.
        prediction = self.network(images.double())
        return tuple(getattr(prediction, name) for name in OUTPUTS)


def build_graph(model: TrainedModel, notes: Mapping[str, str] | None = None) -> Any:
    """Return the network as an `onnx.ModelProto` that says what it is; see `export_onnx`."""
    import onnx

    height, width = model.network.image_size
    logging.getLogger("torch.onnx").setLevel(logging.ERROR)  # it warns of packages not needed
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            program = torch.onnx.export(
                _Graph(model.network).eval(),
                (torch.zeros(2, 3, height, width, dtype=torch.uint8),),
                input_names=["images"],
                output_names=OUTPUTS,
                dynamic_shapes={"images": {0: torch.export.Dim("batch")}},
                opset_version=_OPSET,
                dynamo=True,
                verbose=False,
            )
    except RuntimeError as error:  # whatever the exporter meets comes out as its own kind of it
        reason = f"{type(error).__name__}: {error}".split("\n")[0]
        raise ConfigError(f"torch cannot export this network as ONNX ({reason})") from error
    assert program is not None
    graph = program.model_proto
    if not graph.graph.input[0].type.tensor_type.shape.dim[0].dim_param:
        raise ConfigError(
            "torch exports this network for batches of one size alone. Its encoder or heads make a "
            "plain number of the batch's size, as len(hidden) does: use hidden.shape[0]"
        )
    # Torch's notes on the lines of code that things come from hold paths.
    for part in (graph.graph, *graph.graph.node, *graph.graph.value_info):
        part.ClearField("metadata_props")
    metadata = {
        "images": f"(batch, 3, {height}, {width}) uint8, RGB over white; the object in the "
        f"middle, its larger side fill x {height} pixels",
        "image_size": json.dumps([height, width]),
        "fill": json.dumps(round(model.object_fill, 4)),
        "template_ids": json.dumps(model.bank.ids),
        "degrees": json.dumps(model.bank.degrees),
        "step": json.dumps(model.step),
    }
    onnx.helper.set_model_props(graph, {**metadata, **_MEANING, **(notes or {})})
    return graph


@torch.no_grad()
def compare(model: TrainedModel, content: bytes) -> dict[str, float]:
    """Hold an ONNX graph's bytes, as onnxruntime runs it on the CPU, against torch in float64.

    Returns:
        Largest absolute difference of each output, over pictures of the templates from all sides;
        nan where outputs are not finite.
    """
    import onnxruntime

    height, width = model.network.image_size
    meshes = model.bank.meshes
    pictures = [
        render(meshes[k % len(meshes)], Camera(45 * k), height=height, width=width, samples=1)
        for k in range(_IMAGES)
    ]
    images = np.ascontiguousarray(np.stack(pictures)[..., :3].transpose(0, 3, 1, 2))
    exact = _Graph(copy.deepcopy(model.network).double())(torch.from_numpy(images))
    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    outputs = session.run(list(OUTPUTS), {"images": images})
    return {
        name: float(np.abs(output - expected.numpy()).max())
        for name, output, expected in zip(OUTPUTS, outputs, exact, strict=True)
    }


def pack_templates(bank: TemplateBank) -> dict[str, Any]:
    """Return the arrays that deform a bank's subdivided meshes, without torch.

    Lattice coordinates stand for the vertices, B P, and for B itself, M / 3 times as large.

    Returns:
        `ids` (T,), `degrees` (3,), `control_points` (T, M, 3), `part_names`, and of template k's
        subdivided mesh `stu_k` (V, 3), `faces_k` (F, 3), `colors_k` (F, 4) and, where known,
        `parts_k` (F,), index into `part_names`, 255 unknown.
    """
    arrays: dict[str, Any] = {"ids": bank.ids, "degrees": bank.degrees}
    arrays["control_points"] = bank.control_points.numpy()
    arrays["part_names"] = np.array(bank.part_names, np.str_)
    for k, lattice in enumerate(bank.lattices):
        mesh, _ = bank.subdivided(k)
        arrays[f"stu_{k}"] = lattice.to_stu(torch.from_numpy(mesh.vertices)).float().numpy()
        arrays[f"faces_{k}"] = mesh.faces.astype(np.int32)
        arrays[f"colors_{k}"] = mesh.face_colors
        if mesh.face_parts is not None:
            arrays[f"parts_{k}"] = mesh.face_parts
    return arrays


def write_packed(checkpoint: Path, out: Path, model: TrainedModel | None = None) -> None:
    """Write a checkpoint without the optimizer's state and with weights of half the size.

    Matrices and kernels are rounded to float16; vectors stay as they are: they are few, and the
    variances of batch norm may be larger than float16 holds. `load_model` reads the file as it
    reads any other, and computes in float32. A file that is there is replaced, and never left half
    written.

    Args:
        checkpoint: the file.
        out: the file to write.
        model: what `load_model` gives of the checkpoint, told other templates if that is wanted.

    Raises:
        ConfigError: `out` is the checkpoint itself, or the checkpoint cannot be used.
        DataError: it is damaged, or its weights are too large.
    """
    if out.exists() and out.samefile(checkpoint):
        raise ConfigError(f"out={out} is the checkpoint itself: name another file")
    model, content = model or load_model(checkpoint), read_checkpoint(checkpoint)
    weights = {n: v for n, v in content["state_dict"].items() if n.startswith("network.")}
    network = {name: value.half() if value.ndim > 1 else value for name, value in weights.items()}
    for name, value in network.items():
        if not value.isfinite().all():
            raise DataError(f"{name} has values that float16 cannot hold: its training diverged")
    templates = model.bank.lighter(NUM_POINTS).state()
    entry = {**content["model"], "templates": templates}
    if model.network.heads.conditioned:
        entry["template_codes"] = model.network.template_codes.cpu()
        entry["strangers"] = model.network.strangers
    buffer = io.BytesIO()
    torch.save({"global_step": model.step, "state_dict": network, "model": entry}, buffer)
    write_bytes_atomic(out, buffer.getvalue())
