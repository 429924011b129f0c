"""The trained model that comes with the package.

`model.ckpt` is a checkpoint of 13 categories, made by `ffd export run=RUN out=model.ckpt`. Its
heads are conditioned: it has templates of its own, and can be told others. `README.md` beside it
says what it was trained on and what can be expected of it. Runs that start from it say
`encoder.weights=embedded` or `network.weights=embedded`: another model needs other words.
"""

from __future__ import annotations

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
