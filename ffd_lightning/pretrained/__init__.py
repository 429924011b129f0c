"""The trained models that come with the package.

`model.ckpt` is a checkpoint of several categories with its own templates, `any_meshes.ckpt` one of
conditioned heads, to be told templates; both made by `ffd export run=RUN out=FILE`. `README.md`
beside them says what they were trained on and what can be expected of them. Runs that start from
them say `encoder.weights=embedded` or `network.weights=embedded`: other models need other words.
"""

from __future__ import annotations

from pathlib import Path

from ffd_lightning.errors import ConfigError

MODEL = Path(__file__).with_name("model.ckpt")
ANY_MESHES = Path(__file__).with_name("any_meshes.ckpt")


def pretrained_model(conditioned: bool = False) -> Path:
    """Return a checkpoint that comes with the package.

    Args:
        conditioned: the one that is told its templates.

    Raises:
        ConfigError: none came with this one.
    """
    file = ANY_MESHES if conditioned else MODEL
    if not file.is_file():
        raise ConfigError(
            "this installation has no trained model: give yours with run=RUN, a run folder or a "
            "checkpoint file"
        )
    return file
