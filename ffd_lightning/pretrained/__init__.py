"""The trained models that come with the package.

`model.ckpt` is a checkpoint of several categories, made by `ffd export run=RUN out=model.ckpt`;
`conditioned.ckpt` one that takes any meshes as templates. `README.md` beside them says what they
were trained on and what can be expected of them. Runs that start from them say
`encoder.weights=embedded` and `network.weights=embedded`: another model needs another word.
"""

from __future__ import annotations

from pathlib import Path

from ffd_lightning.errors import ConfigError

MODEL = Path(__file__).with_name("model.ckpt")
CONDITIONED = MODEL.with_name("conditioned.ckpt")


def pretrained_model() -> Path:
    """Return the checkpoint that comes with the package.

    Raises:
        ConfigError: none came with this one.
    """
    return _there(MODEL)


def conditioned_model() -> Path:
    """Return the checkpoint for any templates; see `pretrained_model`."""
    return _there(CONDITIONED)


def _there(file: Path) -> Path:
    if not file.is_file():
        raise ConfigError(
            "this installation has no trained model: give yours with run=RUN, a run folder or a "
            "checkpoint file"
        )
    return file
