"""Small pictures of templates, for lists of them."""

from __future__ import annotations

import base64
import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.rendering import render

_HEIGHT, _WIDTH = 72, 96  # pixels: twice what is shown, for fine screens


def data_uri(image: NDArray[np.uint8]) -> str:
    """Return an image, (H, W, 3 or 4) uint8, as an address that holds it as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG")
    return f"data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}"


class Thumbnails:
    """Pictures of a network's templates, each drawn when it is first asked for.

    Args:
        bank: the templates.
        camera: that sees them.
    """

    def __init__(self, bank: TemplateBank, camera: Camera) -> None:
        self._bank, self._camera = bank, camera
        self._drawn: dict[int, str] = {}

    def __getitem__(self, template: int) -> str:
        """Return a template's picture as a data URI, see-through around it."""
        if template not in self._drawn:
            mesh = self._bank.meshes[template]
            picture = render(mesh, self._camera, height=_HEIGHT, width=_WIDTH, samples=2)
            self._drawn[template] = data_uri(picture)
        return self._drawn[template]
