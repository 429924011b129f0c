"""What training images look like: how large objects are, their silhouettes, their cameras."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.imaging.camera import Camera
from ffd_lightning.imaging.viewpoints import Viewpoints

MOST_IMAGES = 1024
"""So many training images are enough, evenly spread over them all."""

_SIDE = 16  # fields of a silhouette along each side
_ROOM = 1.06  # a silhouette's square / the larger side of the object's box
_USUAL = 0.99  # share of the training images that the others among them make look usual
# Nine in ten real chairs, tables, sofas and lamps lie that near to generated ones of the same view,
# which may be much nearer to each other: generated cars keep within 1.6.
_CLOSE = 4.0
_FEWEST = 32  # of fewer images the nearest are far apart by chance: nothing is called unlike then


@dataclass(frozen=True)
class TrainingAppearance:
    """Some training images, reduced to what new images are held against.

    The encoder's features would not do: after a short training they hardly tell a table from a
    plane, or from noise. Silhouettes do, for networks of one category and one view: of 149 real
    chairs, tables, sofas and lamps in that view 7% looked unlike generated ones, of 180 generated
    by another seed 0.6%; of 1,347 images from above, below, the front, the back and the other side
    63%, of 1,080 images of other categories 70%. They do not tell the last two apart: of what
    looked unlike, templates seen from elsewhere were much nearer to 57% of the other views, and to
    20% of the other categories. To networks of many categories and views hardly any object looks
    unlike.

    Attributes:
        silhouettes: coverage of 16 x 16 fields of a square around the object, (k, 256) uint8.
        fill: median of the larger side of an object's box in pixels / the image's height.
        usual: distance to the nearest silhouette up to which an image is like those of training.
        viewpoints: from where the images were taken; None for checkpoints that do not say it.
    """

    silhouettes: NDArray[np.uint8]
    fill: float
    usual: float
    viewpoints: Viewpoints | None = None

    @classmethod
    def of(
        cls, images: Sequence[NDArray[np.uint8]], cameras: Sequence[Camera] = ()
    ) -> TrainingAppearance:
        """Look at training images, (H, W, 4) uint8 each: RGB over white and coverage.

        Args:
            images: one or more; `MOST_IMAGES` of them are enough.
            cameras: of those images whose camera is known.
        """
        fills = [fill for image in images if (fill := _fill(image)) is not None]
        found = np.stack([silhouette(image) for image in images])
        usual = float(np.inf)
        if len(found) >= _FEWEST:
            nearest = np.sort(_distances(found, found), axis=1)[:, 1]
            usual = max(_CLOSE, float(np.quantile(nearest, _USUAL)))
        fill = float(np.median(fills)) if fills else 1.0
        return cls(found, fill, usual, Viewpoints.of(cameras))

    def strangeness(self, image: NDArray[np.uint8]) -> float:
        """Return the distance to the most similar training image, in that still usual.

        Above 1 an image looks unlike those of training; 0 where there were too few to tell.

        Args:
            image: as the network sees it, (H, W, 4) uint8: RGB over white and coverage.
        """
        return float(_distances(silhouette(image)[None], self.silhouettes).min()) / self.usual

    def state(self) -> dict[str, Any]:
        """Return all that `from_state` needs."""
        return {
            "silhouettes": torch.from_numpy(self.silhouettes),
            "fill": self.fill,
            "usual": self.usual,
            "viewpoints": None if self.viewpoints is None else self.viewpoints.to_json(),
        }

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> TrainingAppearance:
        """Return what `state` was called on.

        Older checkpoints hold other silhouettes, which nothing is held against any more.
        """
        silhouettes, fill = state["silhouettes"].numpy(), float(state["fill"])
        if "viewpoints" not in state:
            return cls(np.zeros((1, _SIDE**2), np.uint8), fill, float(np.inf))
        content = state["viewpoints"]
        viewpoints = None if content is None else Viewpoints.from_json(content)
        return cls(silhouettes, fill, float(state["usual"]), viewpoints)


def silhouette(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the coverage of 16 x 16 fields of a square around the object, (256,).

    Where it is and how large it is do not matter; 0 where nothing is covered.

    Args:
        image: (H, W, 4) uint8; the last channel is the coverage.
    """
    box = _box(image)
    if box is None:
        return np.zeros(_SIDE**2, np.uint8)
    left, top, right, bottom = box
    side = _ROOM * max(right - left, bottom - top)
    x, y, fine = (left + right - side) / 2, (top + bottom - side) / 2, 4 * _SIDE
    place = (side / fine, 0, x, 0, side / fine, y)
    coverage = Image.fromarray(np.ascontiguousarray(image[..., 3]))
    square = coverage.transform(
        (fine, fine), Image.Transform.AFFINE, place, Image.Resampling.BILINEAR
    )
    return np.asarray(square.resize((_SIDE, _SIDE), Image.Resampling.BOX)).ravel()


def _distances(some: NDArray[np.uint8], others: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return Euclidean distances (n, k) of silhouettes (n, 256), (k, 256); 1 is all of a field."""
    a, b = some / 255, others / 255
    squares = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1) - 2 * a @ b.T
    return np.sqrt(np.maximum(squares, 0))


def _box(image: NDArray[np.uint8]) -> tuple[int, int, int, int] | None:
    """Return left, top, right, bottom of an image's object, None if it shows none."""
    covered = image[..., 3] > 127
    rows, columns = (np.flatnonzero(covered.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        return None
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _fill(image: NDArray[np.uint8]) -> float | None:
    """Return how large an image's object is, None if it shows none."""
    box = _box(image)
    return None if box is None else max(box[2] - box[0], box[3] - box[1]) / len(image)
