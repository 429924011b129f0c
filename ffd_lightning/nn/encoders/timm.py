"""Any timm model that has a feature map, as an image encoder (an optional extra)."""

from typing import Any

import torch
from jaxtyping import Float
from torch import Tensor, nn

from ffd_lightning.components import component
from ffd_lightning.errors import ConfigError, did_you_mean
from ffd_lightning.nn.encoders.base import ImageEncoder


@component("encoder", "timm")
class TimmEncoder(ImageEncoder):
    """Any timm backbone: pip install 'ffd_lightning[timm]'.

    Convolutional networks give their last feature map as it is, models that keep channels last
    (Swin) turned round, vision transformers as the grid of their patch tokens, without class and
    register tokens.

    Models are built for one image size. Pretrained ones saw images normalised with ImageNet's mean
    and deviation; here images are standardised one by one, and the network adapts in training.

    Args:
        model: its name there, resnet18 say, with or without a tag of weights.
        image_size: (height, width) of the images in pixels.

    Raises:
        ConfigError: timm is missing or broken, does not know the model, or the model has no feature
            map for images of this size.
    """

    def __init__(self, model: str, image_size: tuple[int, int]) -> None:
        super().__init__()
        self.name = name = model
        self.in_size = image_size
        self.model = _create_model(name, False, image_size)
        example = self._example_output()
        self.channels_at_end = getattr(self.model, "output_fmt", "NCHW") == "NHWC"
        self.num_prefix_tokens = int(getattr(self.model, "num_prefix_tokens", 0))
        self.grid_size: tuple[int, int] | None = None
        if example.dim() == 3:
            self.grid_size = self._token_grid(example.shape[1])
        elif example.dim() != 4:
            raise ConfigError(
                f"encoder.model={name!r} gives an output of shape {tuple(example.shape)}, "
                "no feature map: choose another timm model"
            )
        features = self._to_map(example)
        self.out_channels = features.shape[1]
        self._output_size = (features.shape[2], features.shape[3])

    def _example_output(self) -> Tensor:
        """Run the model on an empty image: only its output says what shape it has."""
        self.model.eval()
        try:
            with torch.no_grad():
                output = self.model(torch.zeros(1, 3, *self.in_size))
        except (RuntimeError, AssertionError, ValueError, IndexError) as error:
            height, width = self.in_size
            raise ConfigError(
                f"encoder.model={self.name!r} cannot take images of {height}x{width}: {error}"
            ) from error
        finally:
            self.model.train()
        return output

    def _token_grid(self, num_tokens: int) -> tuple[int, int]:
        grid = getattr(getattr(self.model, "patch_embed", None), "grid_size", None)
        if grid is None or grid[0] * grid[1] + self.num_prefix_tokens != num_tokens:
            raise ConfigError(
                f"encoder.model={self.name!r} gives {num_tokens} tokens that are no grid of "
                "patches: choose a timm model with a feature map"
            )
        return grid[0], grid[1]

    def _to_map(self, output: Tensor) -> Tensor:
        if self.grid_size is not None:
            return output[:, self.num_prefix_tokens :].mT.unflatten(2, self.grid_size)
        return output.permute(0, 3, 1, 2) if self.channels_at_end else output

    def output_size(self, image_size: tuple[int, int]) -> tuple[int, int]:
        """Return (h, w) of the feature map for images of the size that this encoder was built for.

        Raises:
            ConfigError: another size.
        """
        if tuple(image_size) != self.in_size:
            raise ConfigError(f"the encoder was built for images of {self.in_size}: {image_size}")
        return self._output_size

    def load_weights(self, source: str) -> None:
        """Take timm's own weights, which it downloads.

        Raises:
            ConfigError: `source` is not "pretrained", or timm has no weights for the model.
        """
        if source != "pretrained":
            raise ConfigError(f"encoder.weights={source}: encoder=timm takes none or pretrained")
        self.model.load_state_dict(_create_model(self.name, True, self.in_size).state_dict())

    def forward(self, images: Float[Tensor, "q 3 height width"]) -> Float[Tensor, "q c h w"]:
        """Return the last feature map of standardised images."""
        return self._to_map(self.model(images))


def _create_model(name: str, pretrained: bool, in_size: tuple[int, int]) -> nn.Module:
    try:
        import timm
    except (ImportError, RuntimeError) as error:  # a torchvision of another build: RuntimeError
        raise ConfigError(
            f"encoder=timm cannot import timm ({error}): pip install 'ffd_lightning[timm]'"
        ) from error
    if ":" not in name and not timm.is_model(name):
        hint = did_you_mean(name, timm.list_models()) or " See timm.list_models()"
        raise ConfigError(f"encoder.model={name!r} is no timm model.{hint}")
    options: dict[str, Any] = {"pretrained": pretrained, "num_classes": 0, "global_pool": ""}
    try:
        try:
            return timm.create_model(name, img_size=tuple(in_size), **options)
        except TypeError:  # models without a fixed image size do not know the argument
            return timm.create_model(name, **options)
    except Exception as error:  # downloads fail in as many ways as there are network libraries
        raise ConfigError(f"encoder.model={name!r}: timm cannot build it: {error}") from error
