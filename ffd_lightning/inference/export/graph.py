"""The graph that is exported: the network behind an exact standardisation, and what it says."""

from __future__ import annotations

import json
import logging
import warnings
from collections.abc import Mapping
from typing import Any

import torch
from torch import Tensor, nn

from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.errors import ConfigError
from ffd_lightning.nn.network import FfdPrediction, TemplateFfdNetwork

OUTPUTS = ("template_weights", "template_probs", "offsets")
DTYPES = {"uint8": torch.uint8, "float32": torch.float32}

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
        return in_order(self.network(images.double()))


def in_order(prediction: FfdPrediction) -> tuple[Tensor, ...]:
    """Return what a graph gives of a prediction, in the order of `OUTPUTS`."""
    return tuple(getattr(prediction, name) for name in OUTPUTS)


def build_graph(
    model: TrainedModel,
    dtype: str = "uint8",
    opset: int = 18,
    notes: Mapping[str, str] | None = None,
) -> Any:
    """Return the network as an `onnx.ModelProto` that says what it is.

    Args:
        model: a checkpoint's content.
        dtype: of the images that the graph takes, one of `DTYPES`.
        opset: ONNX's version of operators.
        notes: what it says of itself beside `metadata`.

    Raises:
        ConfigError: torch cannot export this network.
    """
    import onnx

    graph = _translated(model.network, DTYPES[dtype], opset)
    # Torch's notes on the lines of code that things come from hold paths.
    for part in (graph.graph, *graph.graph.node, *graph.graph.value_info):
        part.ClearField("metadata_props")
    onnx.helper.set_model_props(graph, {**metadata(model, dtype), **(notes or {})})
    return graph


def _translated(network: TemplateFfdNetwork, dtype: torch.dtype, opset: int) -> Any:
    """Return what torch's exporter makes of a network, checked by ONNX's own rules."""
    import onnx

    logger = logging.getLogger("torch.onnx")
    level = logger.level
    logger.setLevel(logging.ERROR)  # it warns of packages that are not needed
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            program = torch.onnx.export(
                _Graph(network).eval(),
                (torch.zeros(2, 3, *network.image_size, dtype=dtype),),
                input_names=["images"],
                output_names=OUTPUTS,
                dynamic_shapes={"images": {0: torch.export.Dim("batch")}},
                opset_version=opset,
                dynamo=True,
                verbose=False,
            )
        assert program is not None
        onnx.checker.check_model(program.model_proto, full_check=True)
    # Whatever the exporter meets comes out as its own kind of RuntimeError.
    except (
        RuntimeError,
        onnx.checker.ValidationError,
        onnx.shape_inference.InferenceError,
    ) as error:
        reason = f"{type(error).__name__}: {error}".split("\n")[0]
        raise ConfigError(f"torch cannot export this network as ONNX ({reason})") from error
    finally:
        logger.setLevel(level)
    return program.model_proto


def metadata(model: TrainedModel, dtype: str = "uint8") -> dict[str, str]:
    """Return what an ONNX file says of itself, `metadata_props`: lists and numbers as JSON.

    Args:
        model: a checkpoint's content.
        dtype: of the images that the graph takes.
    """
    height, width = model.network.image_size
    return {
        "images": f"(batch, 3, {height}, {width}) {dtype}, RGB over white, of any scale; the "
        f"object in the middle, its larger side fill x {height} pixels",
        "image_size": json.dumps([height, width]),
        "fill": json.dumps(round(model.object_fill, 4)),
        "template_ids": json.dumps(model.bank.ids),
        "degrees": json.dumps(model.bank.degrees),
        "step": json.dumps(model.step),
        **_MEANING,
    }
