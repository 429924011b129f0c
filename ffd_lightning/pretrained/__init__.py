"""The trained model that comes with the package.

`model.ckpt` is a checkpoint of several categories, made by `ffd export run=RUN out=model.ckpt`;
`README.md` beside it says what it was trained on and what can be expected of it.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from pathlib import Path

from ffd_lightning.errors import ConfigError

MODEL = Path(__file__).with_name("model.ckpt")


def pretrained_model() -> Path:
    """Return the checkpoint that comes with the package.

    Raises:
        ConfigError: none came with this one.
    """
    if not MODEL.is_file():
        raise ConfigError(
            "this installation has no trained model: give yours with run=RUN, a run folder or a "
            "checkpoint file"
        )
    return MODEL


def pretrained_digest() -> str:
    """Return eight hexadecimal digits that change with the model.

    Raises:
        ConfigError: see `pretrained_model`.
    """
    model = pretrained_model()
    return _digest(model, model.stat().st_mtime_ns, model.stat().st_size)


@lru_cache(maxsize=1)
def _digest(model: Path, changed: int, size: int) -> str:
    return hashlib.sha256(model.read_bytes()).hexdigest()[:8]
