"""3D-R2N2's published renderings of ShapeNetCore v1: 24 views of 137 x 137 a shape."""

from __future__ import annotations

import hashlib
import io
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.errors import DataError, RejectedShapeError, is_bug
from ffd_lightning.imaging.pictures import fit_picture

VIEWS = 24
_FOLDER = "ShapeNetRendering"
_MAX_PIXELS = 4096 * 4096  # they have 137 x 137; fitting one takes 16 bytes for each


@dataclass(frozen=True)
class R2n2Images:
    """`<root>/<synset>/<model>/rendering/{00..23}.png`, brought to the network's size.

    Attributes:
        root: the folder `ShapeNetRendering`, or one that holds it.
        height, width: of the images, in pixels.
    """

    root: Path
    height: int
    width: int

    def ids(self, category: str) -> set[str]:
        """Return the ids of all shapes that have a folder.

        Raises:
            DataError: there is no folder for the category.
        """
        with os.scandir(self._folder(category)) as entries:
            return {entry.name for entry in entries if entry.is_dir()}

    def synsets(self) -> set[str]:
        """Return the categories of which there are renderings: 3D-R2N2 has 13 of ShapeNet's 57."""
        for top in (self.root / _FOLDER, self.root):
            folders = top.iterdir() if top.is_dir() else ()
            found = {f.name for f in folders if next(f.glob("*/rendering"), None) is not None}
            if found:
                return found
        return set()

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return which shapes have renderings, as a hash, and the size they are brought to.

        Raises:
            DataError: there is no folder for the category.
        """
        ids = "\n".join(sorted(self.ids(category)))
        digest = hashlib.sha256(ids.encode()).hexdigest()
        return {"source": "r2n2", "sha256": digest, "height": self.height, "width": self.width}

    def read(self, category: str, shape_id: str) -> NDArray[np.uint8]:
        """Return a shape's images, (24, height, width, 4) uint8: RGB over white and coverage.

        Raises:
            RejectedShapeError: one is missing or damaged; the message names it.
        """
        folder = self._folder(category) / shape_id / "rendering"
        images = []
        for view in range(VIEWS):
            name = f"rendering/{view:02d}.png"
            try:
                data = (folder / f"{view:02d}.png").read_bytes()
                with Image.open(io.BytesIO(data), formats=["PNG"]) as picture:
                    if picture.width * picture.height > _MAX_PIXELS:
                        raise ValueError(f"it has {picture.width} x {picture.height} pixels")
                    images.append(fit_picture(picture, self.height, self.width))
            except FileNotFoundError:
                raise RejectedShapeError(f"it has no {name}") from None
            except Exception as error:  # Pillow meets anything in a damaged file
                if is_bug(error):
                    raise
                reason = f"{type(error).__name__}: {error}"
                raise RejectedShapeError(f"{name} cannot be read ({reason})") from error
        return np.stack(images)

    def _folder(self, category: str) -> Path:
        synset = SYNSETS.get(category, category)
        for top in (self.root / _FOLDER, self.root):
            if next((top / synset).glob("*/rendering"), None) is not None:
                return top / synset
        archive = self.root / f"{_FOLDER}.tgz"
        hint = f"; unpack {archive}" if archive.exists() else ""
        raise DataError(
            f"there are no renderings of {category} in {self.root / _FOLDER / synset}: set "
            f"data.images_root to the folder {_FOLDER} of 3D-R2N2{hint}"
        )
