"""A trained network as an ONNX file, checked, and its templates beside it: usable without torch.

    python -m ffd_lightning.inference.export run=RUN_DIR [out=model.onnx] [checkpoint=FILE]
        [dtype=uint8|float32] [opset=18] [templates=true|false]

`run` is a run folder or a checkpoint file, `checkpoint` another one than the run's newest. The
graph takes batches of any size, standardises images itself, and calls its ends

    images            (batch, 3, H, W): RGB over white, the object in the middle, its larger side
                      `fill` times the height; uint8, or with dtype=float32 of any scale
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

Before anything is written, the graph is held against torch in float64: on noise, white, grey and
pictures of the templates, in batches of 1, 3 and 8. More than 1e-4 between weights or offsets is an
error.
"""

from __future__ import annotations

import copy
import difflib
import importlib
import io
import json
import logging
import sys
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from ffd_lightning.app.cli import run_app
from ffd_lightning.checkpoint import TrainedModel, load_model
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.files import write_file
from ffd_lightning.inference.predictor import checkpoint_of
from ffd_lightning.nn.network import FfdPrediction, TemplateFfdNetwork

OUTPUTS = ("template_weights", "template_probs", "offsets")
DTYPES = {"uint8": torch.uint8, "float32": torch.float32}
TOLERANCE = 1e-4
"""Largest difference from torch: of weights, and of offsets in units of a template's diagonal."""

_SETTINGS = ("run", "out", "checkpoint", "dtype", "opset", "templates")
_OPSETS = range(18, 26)  # what torch's exporter speaks or is translated to with certainty
_BATCHES = (1, 3, 8)
_MEANING = {
    "template_weights": "the largest is the selected template's; they sum to 1",
    "offsets": "dP, displacements of the control points P, in units of the bounding box's diagonal",
    "deformation": "B (P + dP); row v of B holds the products b_i(s) b_j(t) b_k(u) of vertex v's "
    "lattice coordinates (s, t, u), k fastest; b_i(t) = binomial(n, i) t^i (1 - t)^(n - i) for "
    "an axis of degree n",
    "frame": "y up, facing -z, bounding box of diagonal 1 centred at the origin",
}


class _Graph(nn.Module):
    """What is exported: the network behind an exact standardisation, its outputs in order."""

    def __init__(self, network: TemplateFfdNetwork) -> None:
        super().__init__()
        self.network = network

    def forward(self, images: Tensor) -> tuple[Tensor, ...]:
        # float64 for the standardisation alone, the network goes on in float32: sums over all
        # values of a mostly white image lose three digits in float32, in each runtime others.
        return _outputs(self.network(images.double()))


def _outputs(prediction: FfdPrediction) -> tuple[Tensor, ...]:
    return tuple(getattr(prediction, name) for name in OUTPUTS)


def export(
    model: TrainedModel,
    out: Path,
    dtype: str = "uint8",
    opset: int = 18,
    templates: bool = True,
) -> dict[str, float]:
    """Write a model's network as ONNX, checked, and its templates beside it.

    Args:
        model: a checkpoint's content.
        out: the file, `.onnx`; the templates' is called `.templates.npz` instead. Folders are
            made, files there replaced, and never left half written.
        dtype: of the images that the graph takes: uint8 or float32.
        opset: ONNX's version of operators.
        templates: whether to write them.

    Returns:
        What `compare` found.

    Raises:
        ConfigError: a package is missing, or a setting cannot work.
        DataError: the graph differs from torch by more than 1e-4, or a file cannot be written.
    """
    _check_settings(out, dtype, opset)
    content = build_graph(model, dtype, opset).SerializeToString()
    differences = compare(model, content, dtype)
    for name, difference in differences.items():
        if difference > TOLERANCE:
            raise DataError(
                f"the graph's {name} differ from torch's by {difference:.1e}, more than "
                f"{TOLERANCE:.0e}: nothing was written. Try another opset="
            )
    if templates:
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **pack_templates(model.bank))
        write_file(templates_file(out), buffer.getvalue())
    write_file(out, content)
    return differences


def templates_file(out: Path) -> Path:
    """Return where the templates of an ONNX file are."""
    return out.with_suffix(".templates.npz")


def _check_settings(out: Path, dtype: str, opset: int) -> None:
    """Refuse what cannot work before anything is computed, and make the folder."""
    if out.suffix != ".onnx" or out.is_dir():
        raise ConfigError(f"out={out} must be a file that ends in .onnx: out={out}/model.onnx, say")
    if dtype not in DTYPES:
        raise ConfigError(f"dtype={dtype} must be {' or '.join(DTYPES)}")
    if opset not in _OPSETS:
        raise ConfigError(f"opset={opset} must be one of {_OPSETS[0]} to {_OPSETS[-1]}")
    for name in ("onnx", "onnxscript", "onnxruntime"):
        try:
            importlib.import_module(name)
        except ImportError as error:  # missing, or without a library of its own
            raise ConfigError(
                f"exporting needs {name} ({error}): pip install 'ffd_lightning[onnx]'"
            ) from None
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"cannot make the folder {out.parent}: {error.strerror}") from None


def build_graph(model: TrainedModel, dtype: str = "uint8", opset: int = 18) -> Any:
    """Return the network as an `onnx.ModelProto` that says what it is.

    Raises:
        ConfigError: torch cannot export this network.
    """
    import onnx

    logger = logging.getLogger("torch.onnx")
    level = logger.level
    logger.setLevel(logging.ERROR)  # it warns of packages that are not needed
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            program = torch.onnx.export(
                _Graph(model.network).eval(),
                (torch.zeros(2, 3, *model.network.image_size, dtype=DTYPES[dtype]),),
                input_names=["images"],
                output_names=OUTPUTS,
                dynamic_shapes={"images": {0: torch.export.Dim("batch")}},
                opset_version=opset,
                dynamo=True,
                verbose=False,
            )
        assert program is not None
        graph = program.model_proto
        onnx.checker.check_model(graph, full_check=True)
    except Exception as error:  # it traces, translates and optimises: anything can come of that
        reason = f"{type(error).__name__}: {error}".split("\n")[0]
        raise ConfigError(f"torch cannot export this network as ONNX ({reason})") from error
    finally:
        logger.setLevel(level)
    # Torch's notes on the lines of code that things come from hold paths.
    for part in (graph.graph, *graph.graph.node, *graph.graph.value_info):
        part.ClearField("metadata_props")
    onnx.helper.set_model_props(graph, metadata(model, dtype))
    return graph


def metadata(model: TrainedModel, dtype: str = "uint8") -> dict[str, str]:
    """Return what an ONNX file says of itself, `metadata_props`: lists and numbers as JSON."""
    height, width = model.network.image_size
    return {
        "images": f"(batch, 3, {height}, {width}) {dtype}, RGB over white, of any scale; the "
        f"object in the middle, its larger side fill x {height} pixels",
        "image_size": json.dumps([height, width]),
        "fill": json.dumps(round(model.appearance.fill, 4)),
        "category": ", ".join(model.categories),
        "template_ids": json.dumps(model.bank.ids),
        "degrees": json.dumps(model.bank.degrees),
        "regime": str(model.record.get("regime", "")),
        "step": json.dumps(model.step),
        **_MEANING,
    }


def pack_templates(bank: TemplateBank) -> dict[str, Any]:
    """Return the arrays that deform a bank's subdivided meshes; the module's docstring lists them.

    Lattice coordinates stand for the vertices, B P, and for B itself, M / 3 times as large.
    """
    arrays: dict[str, Any] = {
        "ids": np.array(bank.ids),
        "degrees": np.array(bank.degrees),
        "control_points": bank.control_points.numpy(),
        "part_names": np.array(bank.part_names, np.str_),
    }
    for k, lattice in enumerate(bank.lattices):
        mesh, _ = bank.subdivided(k)
        arrays[f"stu_{k}"] = lattice.to_stu(torch.from_numpy(mesh.vertices)).float().numpy()
        arrays[f"faces_{k}"] = mesh.faces.astype(np.int32)
        arrays[f"colors_{k}"] = mesh.face_colors
        if mesh.face_parts is not None:
            arrays[f"parts_{k}"] = mesh.face_parts
    return arrays


def check_images(model: TrainedModel) -> dict[str, Tensor]:
    """Return images to compare on, eight of each kind, (8, 3, H, W) uint8.

    Noise, white, one grey, and the templates seen from all sides.
    """
    height, width = model.network.image_size
    shape = (max(_BATCHES), 3, height, width)
    noise = torch.randint(0, 256, shape, generator=torch.Generator().manual_seed(0))
    meshes = model.bank.meshes
    pictures = [
        render(meshes[k % len(meshes)], height=height, width=width, azimuth=45 * k, samples=1)
        for k in range(max(_BATCHES))
    ]
    return {
        "noise": noise.to(torch.uint8),
        "white": torch.full(shape, 255, dtype=torch.uint8),
        "grey": torch.full(shape, 101, dtype=torch.uint8),
        "templates": torch.from_numpy(np.stack(pictures)[..., :3]).permute(0, 3, 1, 2),
    }


@torch.no_grad()
def compare(
    model: TrainedModel,
    content: bytes,
    dtype: str = "uint8",
    images: Mapping[str, Tensor] | None = None,
) -> dict[str, float]:
    """Hold an ONNX graph, as onnxruntime runs it on the CPU, against torch in float64.

    Args:
        model: what the graph was made of.
        content: the graph's bytes.
        dtype: of its images.
        images: (8, 3, H, W) by kind; by default `check_images`.

    Returns:
        Largest absolute difference of each output, over all images in batches of 1, 3 and 8.

    Raises:
        DataError: outputs that are not finite.
    """
    import onnxruntime

    session = onnxruntime.InferenceSession(content, providers=["CPUExecutionProvider"])
    exact = copy.deepcopy(model.network).double()
    largest = dict.fromkeys(OUTPUTS, 0.0)
    for kind in (check_images(model) if images is None else images).values():
        truth = [output.numpy() for output in _outputs(exact(kind.double()))]
        for size in _BATCHES:
            batch = kind[:size].to(DTYPES[dtype]).contiguous().numpy()
            outputs = session.run(list(OUTPUTS), {"images": batch})
            for name, output, expected in zip(OUTPUTS, outputs, truth, strict=True):
                difference = float(np.abs(output - expected[:size]).max())
                if not np.isfinite(difference):
                    raise DataError(f"the network's {name} are not finite: its training diverged")
                largest[name] = max(largest[name], difference)
    return largest


def _settings(arguments: list[str]) -> dict[str, str]:
    """Read `key=value` arguments.

    Raises:
        ConfigError: one that there is not, that cannot be, or no `run`.
    """
    given = {"out": "model.onnx", "dtype": "uint8", "opset": "18", "templates": "true"}
    for argument in arguments:
        key, _, value = argument.partition("=")
        if key not in _SETTINGS:
            close = difflib.get_close_matches(key, _SETTINGS, 1)
            hint = f" Did you mean {close[0]}=?" if close else ""
            raise ConfigError(f"there is no {argument!r}.{hint} Settings: {'=, '.join(_SETTINGS)}=")
        if not value:
            raise ConfigError(f"{key}= must be given a value")
        given[key] = value
    if "run" not in given:
        raise ConfigError("run=... must be given: a run folder or a checkpoint file")
    if not given["opset"].isdecimal():
        raise ConfigError(f"opset={given['opset']} must be a number")
    if given["templates"] not in ("true", "false"):
        raise ConfigError(f"templates={given['templates']} must be true or false")
    return given


def main(arguments: list[str]) -> int:
    """Export the run that is named, and print what was written.

    Raises:
        ConfigError: no run, no checkpoint, a missing package, or an argument that there is not.
        DataError: a damaged checkpoint, a graph that differs, or a file that cannot be written.
    """
    if not arguments or {"-h", "--help"} & set(arguments):
        print(__doc__)
        return 0 if arguments else 2
    given = _settings(arguments)
    out, dtype, opset = Path(given["out"]).expanduser(), given["dtype"], int(given["opset"])
    _check_settings(out, dtype, opset)  # before the checkpoint is read
    if not Path(given["run"]).expanduser().exists():
        raise ConfigError(f"there is no run {given['run']}")
    model = load_model(checkpoint_of(given.get("checkpoint", given["run"])))
    differences = export(model, out, dtype, opset, given["templates"] == "true")
    height, width = model.network.image_size
    print(f"{out}: images (batch, 3, {height}, {width}) {dtype}, {len(model.bank)} templates")
    if given["templates"] == "true":
        print(f"{templates_file(out)}: what deforms them")
    found = ", ".join(f"{name} {value:.1e}" for name, value in differences.items())
    print(f"largest difference from torch in float64, 32 images: {found}")
    return 0


if __name__ == "__main__":
    run_app(lambda: sys.exit(main(sys.argv[1:])))
