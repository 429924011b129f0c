"""The trained model that comes with the package, and where Keras' encoders are.

`model.ckpt` is a checkpoint of 13 categories, made by `ffd export run=RUN out=model.ckpt`. Its
heads are conditioned: it has templates of its own, and can be told others. `README.md` beside it
says what it was trained on and what can be expected of it. Runs that start from it say
`encoder.weights=embedded` or `network.weights=embedded`: another model needs other words.
"""

from pathlib import Path

from ffd_lightning.errors import ConfigError

MODEL = Path(__file__).with_name("model.ckpt")

KERAS_FILES: dict[float, str] = {
    0.25: "mobilenet_2_5_192_tf_no_top.h5",
    0.5: "mobilenet_5_0_192_tf_no_top.h5",
    0.75: "mobilenet_7_5_192_tf_no_top.h5",
    1.0: "mobilenet_1_0_192_tf_no_top.h5",
}
"""Keras' published ImageNet weights by width, of images of 192 x 192; the paper's is the first."""

KERAS_ADDRESS = "https://github.com/fchollet/deep-learning-models/releases/download/v0.6/"
"""Where they are; a file's name follows."""


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
