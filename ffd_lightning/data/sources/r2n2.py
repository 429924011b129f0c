"""3D-R2N2's published renderings of ShapeNetCore v1: 24 views of 137 x 137 a shape.

Each shape's `rendering_metadata.txt` has a line for each view: azimuth, elevation, in-plane
rotation (always 0), distance as a share of 1.75, and 25 for the field of view. That of the images
is 49 degrees: 35 mm on a sensor of 32 mm. Their azimuth is measured from v1's +x axis towards +z.
v1's shapes face +x, so it is the project's azimuth once they are turned to face -z (and 90 degrees
less than what the project's would be for shapes left as they are).
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.reading.files import digest_of_files, files_below
from ffd_lightning.errors import DataError, RejectedShapeError, is_of_machine
from ffd_lightning.geometry.mesh import Mesh
from ffd_lightning.imaging.camera import Camera, blender_field_of_view
from ffd_lightning.imaging.rendering import render

VIEWS = 24
_METADATA = "rendering_metadata.txt"
_FARTHEST = 1.75  # of their cameras
_AGREES = 0.5  # intersection over union; a real shape's is 0.93, another turn's mostly below
_FOLDER = "ShapeNetRendering"


@dataclass(frozen=True)
class R2n2Images:
    """`<root>/<synset>/<shape>/rendering/{00..23}.png`.

    Attributes:
        root: the folder `ShapeNetRendering`, or one that holds it.
    """

    root: Path

    def ids(self, category: str) -> set[str]:
        """Return the ids of all shapes that have a folder; a DataError without any."""
        with os.scandir(self._folder(category)) as entries:
            return {entry.name for entry in entries if entry.is_dir()}

    def synsets(self) -> set[str]:
        """Return the categories of which there are renderings: 3D-R2N2 has 13 of ShapeNet's 57."""
        for top in (self.root / _FOLDER, self.root):
            if folders := {f.name for f in top.glob("*") if any(f.glob("*/rendering"))}:
                return folders
        return set()

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return a hash over sizes of images and camera files."""
        facts, top = [], self._folder(category)
        for shape_id in sorted(self.ids(category)):
            found = files_below(top / shape_id / "rendering").items()
            facts.append((shape_id, [(path.as_posix(), stat.st_size) for path, stat in found]))
        return {"source": "r2n2", "sha256": digest_of_files(facts)}

    def read(self, category: str, shape_id: str) -> list[NDArray[np.uint8]]:
        """Return a shape's 24 images, (137, 137, 4) each; a RejectedShapeError names a bad one."""
        folder, images = self._folder(category) / shape_id / "rendering", []
        for view in range(VIEWS):
            file = folder / f"{view:02d}.png"
            try:
                with Image.open(file, formats=["PNG"]) as picture:
                    images.append(np.asarray(picture.convert("RGBA")))
            except FileNotFoundError:
                raise RejectedShapeError(f"it has no rendering/{file.name}") from None
            except Exception as error:  # Pillow meets anything in a damaged file
                if is_of_machine(error):
                    raise
                reason = f"rendering/{file.name} cannot be read ({error})"
                raise RejectedShapeError(reason) from error
        return images

    def cameras(self, category: str, shape_id: str) -> tuple[tuple[Camera, ...] | None, str]:
        """Return the camera of each view, for shapes that face -z, and what is wrong or "".

        What cannot be used gives no cameras and the reason, never an error: the images are good
        without them.
        """
        file = self._folder(category) / shape_id / "rendering" / _METADATA
        if not file.is_file():
            return None, f"its cameras are not known: it has no {_METADATA}"
        try:
            rows = np.loadtxt(file, encoding="utf-8-sig", comments=None, ndmin=2)
            if rows.shape != (VIEWS, 5) or not (np.isfinite(rows).all() and (rows[:, 3] > 0).all()):
                raise ValueError(f"not {VIEWS} lines of five numbers")
            if rows[:, 2].any():
                raise ValueError("turned cameras")
        except ValueError as error:
            return None, f"its cameras are not known: {_METADATA} cannot be read ({error})"
        lens = blender_field_of_view(1, 1)
        return tuple(
            Camera(azimuth % 360, elevation, _FARTHEST * ratio, lens)
            for azimuth, elevation, _, ratio, _ in rows.tolist()
        ), ""

    def _folder(self, category: str) -> Path:
        synset = SYNSETS.get(category, category)
        for top in (self.root / _FOLDER, self.root):
            if any((top / synset).glob("*/rendering")):
                return top / synset
        archive = self.root / f"{_FOLDER}.tgz"
        hint = f"; unpack {archive}" if archive.exists() else ""
        raise DataError(
            f"there are no renderings of {category} in {self.root / _FOLDER / synset}: set "
            f"data.images_root to the folder {_FOLDER} of 3D-R2N2{hint}"
        )


def mismatch(image: NDArray[np.uint8], camera: Camera, mesh: Mesh) -> str:
    """Return what is wrong where a shape, facing -z, covers other pixels than its image, or ""."""
    seen = render(mesh, camera, height=image.shape[0], width=image.shape[1], samples=1)
    covered, shown = seen[..., 3] > 127, image[..., 3] > 127
    agreement = (covered & shown).sum() / max((covered | shown).sum(), 1)
    if agreement >= _AGREES:
        return ""
    return f"its mesh and its first image are not alike: silhouettes agree to {agreement:.2f}"
