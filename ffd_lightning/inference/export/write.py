"""Writing a trained network as ONNX, checked first, and its templates beside it."""

from __future__ import annotations

import importlib
import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ffd_lightning.checkpoint import TrainedModel
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.inference.export.comparison import compare
from ffd_lightning.inference.export.graph import DTYPES, build_graph
from ffd_lightning.inference.export.templates import pack_templates
from ffd_lightning.inference.files import write_file

TOLERANCE = 1e-4
"""Largest difference from torch: of weights, and of offsets in units of a template's diagonal."""

_OPSETS = range(18, 26)  # what torch's exporter speaks or is translated to with certainty


def export(
    model: TrainedModel,
    out: Path,
    dtype: str = "uint8",
    opset: int = 18,
    templates: bool = True,
    notes: Mapping[str, str] | None = None,
) -> dict[str, float]:
    """Write a model's network as ONNX, checked, and its templates beside it.

    Args:
        model: a checkpoint's content.
        out: the file, `.onnx`; the templates' is called `.templates.npz` instead. Folders are
            made, files there replaced, and never left half written.
        dtype: of the images that the graph takes: uint8 or float32.
        opset: ONNX's version of operators.
        templates: whether to write them.
        notes: what the file says of itself beside `graph.metadata`.

    Returns:
        What `compare` found.

    Raises:
        ConfigError: a package is missing, or a setting cannot work.
        DataError: the graph differs from torch by more than 1e-4, or a file cannot be written.
    """
    check_settings(out, dtype, opset)
    content = build_graph(model, dtype, opset, notes).SerializeToString()
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


def check_settings(out: Path, dtype: str, opset: int) -> None:
    """Refuse what cannot work before anything is computed, and make the folder.

    Args:
        out: see `export`.
        dtype: see `export`.
        opset: see `export`.

    Raises:
        ConfigError: a setting that cannot work, or a package that is missing.
        DataError: the folder cannot be made.
    """
    if out.suffix != ".onnx" or out.is_dir():
        raise ConfigError(
            f"out={out} must be a file that ends in .onnx or .ckpt: out={out}/model.onnx, say"
        )
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
