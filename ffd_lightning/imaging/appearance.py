"""What training images look like: how large their objects are, and which silhouettes occur."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

MOST_IMAGES = 256
"""So many training images are enough, evenly spread over them all."""

_GRID = (12, 16)
_INK = 0.1  # of the way from white to black counts in full: pale objects are objects too
_USUAL = 0.99  # share of the training images that the others among them make look usual


@dataclass(frozen=True)
class TrainingAppearance:
    """Some training images, reduced to what new images are held against.

    The encoder's features would not do: after a short training they hardly tell a table from a
    plane, or from noise. Silhouettes do: of the demo's 94 test tables 2 were found strange, of
    30 procedural chairs 21, of 30 cars 29, of 30 planes all, and of the tables before grey all.

    Attributes:
        silhouettes: mean ink of 12 x 16 fields, (k, 192) uint8.
        fill: median of the larger side of an object's box in pixels / the image's height.
        usual: distance to the nearest other silhouette that 99% of them keep within.
    """

    silhouettes: NDArray[np.uint8]
    fill: float
    usual: float

    @classmethod
    def of(cls, images: Sequence[NDArray[np.uint8]]) -> TrainingAppearance:
        """Look at training images, (H, W, 4) uint8 each: RGB over white and coverage.

        Args:
            images: one or more; `MOST_IMAGES` of them are enough.
        """
        fills = [fill for image in images if (fill := _fill(image)) is not None]
        found = np.stack([silhouette(image) for image in images])
        distances = [np.sort(_distances(one, found))[1] for one in found] if len(found) > 1 else [0]
        # Of few images the nearest are far apart by chance: nothing is then called strange.
        usual = float(np.quantile(distances, _USUAL)) if len(found) >= MOST_IMAGES // 8 else np.inf
        return cls(found, float(np.median(fills)) if fills else 1.0, usual)

    def strangeness(self, image: NDArray[np.uint8]) -> float:
        """Return the distance to the most similar training image, in those usual among them.

        Above 1 an image looks unlike those of training; 0 where there were too few to tell.

        Args:
            image: as the network sees it, (H, W, 3 or more) uint8.
        """
        return float(_distances(silhouette(image), self.silhouettes).min()) / max(self.usual, 1e-9)

    def state(self) -> dict[str, Any]:
        """Return all that `from_state` needs."""
        silhouettes = torch.from_numpy(self.silhouettes)
        return {"silhouettes": silhouettes, "fill": self.fill, "usual": self.usual}

    @classmethod
    def from_state(cls, state: Mapping[str, Any]) -> TrainingAppearance:
        """Return what `state` was called on."""
        return cls(state["silhouettes"].numpy(), float(state["fill"]), float(state["usual"]))


def silhouette(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return how far 12 x 16 fields of an image, (H, W, 3 or more), are from white: (192,)."""
    ink = (255 - image[..., :3].min(axis=-1)).astype(np.float32) / (255 * _INK)
    fields = torch.nn.functional.adaptive_avg_pool2d(torch.from_numpy(ink.clip(0, 1))[None], _GRID)
    return (255 * fields).round().to(torch.uint8).flatten().numpy()


def _distances(one: NDArray[np.uint8], others: NDArray[np.uint8]) -> NDArray[np.float64]:
    return np.linalg.norm(others.astype(float) - one.astype(float), axis=1)


def _fill(image: NDArray[np.uint8]) -> float | None:
    """Return how large an image's object is, None if it shows none."""
    covered = image[..., 3] > 127
    rows, columns = (np.flatnonzero(covered.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        return None
    return float(max(np.ptp(rows), np.ptp(columns)) + 1) / len(covered)
