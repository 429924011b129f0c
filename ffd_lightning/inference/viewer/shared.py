"""What all visitors of the viewer share: the network and the test shapes."""

import threading
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import get_args

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from ffd_lightning.errors import DataError
from ffd_lightning.evaluation.samples import Subset
from ffd_lightning.imaging.framing import Box, FramedPhoto
from ffd_lightning.imaging.photos import over_white, read_photo
from ffd_lightning.imaging.rendering import render
from ffd_lightning.inference.pieces import MeshColors
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.inference.viewer.state import NUM_POINTS, State, Truth
from ffd_lightning.palette import regime_title
from ffd_lightning.terminal import counted

_HEIGHT, _WIDTH = 144, 192  # pixels of a template's picture
_SMALL, _RED = (320, 320), (213, 94, 0)  # a photograph in the panel, in pixels; its box
_EDGE = 0.05  # longest edge that is drawn; cubic bends over it differ by less than a pixel


@dataclass(frozen=True)
class Photo:
    """A photograph as it was opened.

    Attributes:
        name: of its file.
        content: the file's bytes.
        mask: those of its mask, if any.
        box: of the object in it, if any: left, top, right and bottom in % of its sides.
    """

    name: str
    content: bytes
    mask: bytes | None = None
    box: tuple[float, float, float, float] | None = None

    def boxed(self) -> NDArray[np.uint8]:
        """Return a small picture of it, RGB, with the box drawn in it."""
        small = _small(self.content, self.name).copy()
        if self.box is not None:
            ImageDraw.Draw(small).rectangle(_pixels(self.box, small.size), outline=_RED, width=2)
        return np.asarray(small)


class Shared:
    """The network and the test shapes.

    Args:
        predictor: the network.
        shapes: None for photographs alone.
        photo: that visitors see first, None for the first test shape.
        note: what visitors should know, written at the top.
    """

    def __init__(
        self,
        predictor: Predictor,
        shapes: Subset | None = None,
        photo: Photo | None = None,
        note: str = "",
    ) -> None:
        model = predictor.model
        regime = regime_title(str(model.record.get("regime", "unknown regime")))
        self.heading = (
            f"{', '.join(model.categories)}: {regime}, {counted(len(model.bank), 'template')}, "
            f"{counted(model.step, 'step')}"
        )
        self.note, self.photo, self.camera = note, photo, model.render.picture_camera
        absent = set() if predictor.knows_side else {"photo"}
        absent |= set() if model.bank.part_names else {"parts"}
        self.colors: list[str] = [c for c in get_args(MeshColors) if c not in absent]
        self.shape_ids = (
            () if shapes is None else tuple(shapes.prepared.ids[k] for k in shapes.rows)
        )
        self.views = 1 if shapes is None else shapes.prepared.image_shape[0]
        self._predictor, self._shapes = predictor, shapes
        self._display = model.bank.lighter(NUM_POINTS, max(_EDGE, model.bank.max_edge))
        self._pictures: dict[int, NDArray[np.uint8]] = {}
        self._busy = threading.Lock()  # visitors are served by threads of their own

    def picture(self, template: int) -> NDArray[np.uint8]:
        """Return a picture of a template, RGB."""
        if template not in self._pictures:
            mesh = self._predictor.model.bank.meshes[template]
            image = render(mesh, self.camera, height=_HEIGHT, width=_WIDTH, samples=2)
            self._pictures[template] = image[..., :3]
        return self._pictures[template]

    def open_shape(self, shape_id: str, view: int = 0) -> State:
        """Reconstruct a test shape from one of its images."""
        assert self._shapes is not None
        prepared = self._shapes.prepared
        row = prepared.index(shape_id)
        step = f"test shape {shape_id}" + (f", view {view + 1}" if self.views > 1 else "")
        framed = FramedPhoto(prepared.image(row, view), (step,), ())
        return self._state(framed, shape_id, Truth(prepared.mesh(row), prepared.cloud(row)))

    def open_photo(self, photo: Photo) -> State:
        """Reconstruct what a photograph shows."""
        if photo.mask == photo.content:
            raise DataError(f"the mask is the photograph itself, {photo.name}")
        picture = read_photo(photo.content, photo.name)
        box = None if photo.box is None else _pixels(photo.box, picture.size)
        framed = self._predictor.frame(picture, mask=photo.mask, box=box)
        return self._state(framed, Path(photo.name).stem, None)

    def _state(self, framed: FramedPhoto, name: str, truth: Truth | None) -> State:
        with self._busy:
            (found,) = self._predictor.predict_framed([framed])
        return State(found, self._display, name, truth)


@lru_cache(maxsize=2)
def _small(content: bytes, name: str) -> Image.Image:
    small = over_white(read_photo(content, name))
    small.thumbnail(_SMALL)
    return small


def _pixels(box: tuple[float, float, float, float], size: tuple[int, int]) -> Box:
    left, top, right, bottom = (round(share / 100 * size[k % 2]) for k, share in enumerate(box))
    return left, top, right, bottom
