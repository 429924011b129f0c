"""From photographs to reconstructions, with nothing but a checkpoint."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from ffd_lightning.checkpoint import TrainedModel, load_model
from ffd_lightning.data.reading.orientation import Up
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.imaging.framing import Background, Box, FramedPhoto, frame_photo
from ffd_lightning.imaging.photos import Photo
from ffd_lightning.inference.own_templates import (
    AnyMesh,
    OwnTemplates,
    Places,
    of_files,
    of_meshes,
    tell,
)
from ffd_lightning.inference.reconstruction import Reconstruction
from ffd_lightning.nn.viewpoint import Viewpoint, viewpoints
from ffd_lightning.pretrained import pretrained_model
from ffd_lightning.run_folder import RunFolder


class Predictor:
    """Reconstructs what photographs show.

    >>> from ffd_lightning.inference.predictor import Predictor
    >>> predictor = Predictor.load()  # doctest: +SKIP
    >>> predictor.predict("photo.png").mesh.export("mesh.glb")  # doctest: +SKIP
    >>> predictor.predict("photo.png", category="chair").template_id  # doctest: +SKIP
    >>> own = Predictor.load().with_templates("my_meshes")  # doctest: +SKIP
    >>> own.predict("photo.png").template_id  # doctest: +SKIP

    Args:
        model: a checkpoint's content.
        device: auto (a GPU if there is one), cpu, cuda, cuda:1, ...

    Raises:
        ConfigError: there is no such device.
    """

    def __init__(self, model: TrainedModel, device: str = "auto") -> None:
        self.model = model
        self.device = choose_device(device)
        self.model.network.to(self.device).eval()

    @classmethod
    def load(cls, source: str | Path | None = None, device: str = "auto") -> Predictor:
        """Load a run folder's newest checkpoint, a checkpoint file, or the package's own model.

        Args:
            source: the run folder, or the file; None for the model that comes with the package.
            device: see `Predictor`.

        Raises:
            ConfigError: no run, no checkpoint, or one of another version; no such device.
            DataError: the checkpoint is damaged.
        """
        return cls(load_model(checkpoint_of(source)), device)

    def with_templates(
        self,
        templates: Places | Mapping[str, AnyMesh],
        *,
        up: Up = "y",
        yaw: float = 0.0,
        beside: bool = False,
        root: str | Path = "data",
        progress: bool = True,
    ) -> Predictor:
        """Return a predictor by the same network with other templates, any meshes.

        Files are prepared by worker processes, so that a script needs the usual
        `if __name__ == "__main__":`, and kept below `root`; meshes in memory are rendered here.

        Args:
            templates: folders, files or patterns, see `own_templates.of_files`; or meshes by id.
            up: the axis of the meshes that points up.
            yaw: degrees about the vertical, anticlockwise from above, until they face -z.
            beside: the network's own templates stay, but for those of the same ids.
            root: prepared files are kept in `root/prepared`.
            progress: show on stderr how far the preparation is.

        Raises:
            ConfigError: the network knows the templates of its training only; or there are none.
            DataError: none of the meshes can be used.
        """
        if isinstance(templates, Mapping):
            own = of_meshes(self.model, templates, up=up, yaw=yaw)
        else:
            own = of_files(self.model, templates, up=up, yaw=yaw, root=root, progress=progress)
        return self.told(own, progress, beside)

    def told(self, own: OwnTemplates, progress: bool = True, beside: bool = False) -> Predictor:
        """Return a predictor by the same network with templates of `own_templates`; see `tell`."""
        return Predictor(tell(self.model, own, progress, beside), str(self.device))

    def frame(
        self,
        image: Photo,
        *,
        mask: Photo | None = None,
        box: Box | None = None,
        background: Background = "auto",
    ) -> FramedPhoto:
        """Bring a photograph to where the network sees it as it saw its training images.

        Args:
            image: a file or its content, a PIL image, or (H, W, 3 or 4) uint8: RGB, and coverage as
                alpha.
            mask: bright where the object is; (H, W) or any picture, of the upright photograph's
                size.
            box: left, top, right and bottom of the object in it, pixels, for GrabCut.
            background: what tells the object where there is neither mask, box nor alpha.

        Raises:
            DataError: not an image, or nothing is seen in it.
            ConfigError: `background` needs a package that is not installed.
        """
        render = self.model.render
        return frame_photo(
            image,
            height=render.height,
            width=render.width,
            fill=self.model.object_fill,
            whole=render.camera == "framed",
            mask=mask,
            box=box,
            background=background,
        )

    def predict(
        self,
        image: Photo,
        *,
        mask: Photo | None = None,
        box: Box | None = None,
        background: Background = "auto",
        category: str | None = None,
    ) -> Reconstruction:
        """Reconstruct what one photograph shows; see `frame` and `predict_framed`."""
        photo = self.frame(image, mask=mask, box=box, background=background)
        return self.predict_framed([photo], category)[0]

    def predict_framed(
        self, photos: Sequence[FramedPhoto], category: str | None = None
    ) -> list[Reconstruction]:
        """Reconstruct what framed photographs show, in one batch.

        Args:
            photos: of `frame`.
            category: what they show, one of `model.categories`; None lets the network tell, for
                each the category whose templates have the greatest sum of weights.

        Raises:
            ConfigError: the model does not know the category.
            DataError: the network's outputs are not finite.
        """
        if category is not None:
            self.model.templates_of(category)
        if not photos:
            return []
        outputs = zip(photos, *self._outputs(photos), strict=True)
        return [self._reconstruction(*of_one, category) for of_one in outputs]

    def predict_together(
        self, photos: Sequence[FramedPhoto], category: str | None = None
    ) -> Reconstruction:
        """Reconstruct the one object that several framed photographs show, from any sides.

        Template weights are their geometric mean over the photographs, scaled to add up to 1,
        offsets the mean; colours and viewpoint are of the first.
        Arguments and errors are those of `predict_framed`, but one photograph there must be.
        """
        if not photos:
            raise ConfigError("there are no photographs")
        if category is not None:
            self.model.templates_of(category)
        weights, offsets, sides = self._outputs(photos)
        logs = np.log(np.maximum(weights, 1e-9)).mean(0)
        product = np.exp(logs - logs.max())
        together = (product / product.sum()).astype(np.float32), offsets.mean(0)
        return self._reconstruction(photos[0], *together, sides[0], category)

    @torch.no_grad()
    def _outputs(
        self, photos: Sequence[FramedPhoto]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], list[tuple[Viewpoint, ...]]]:
        """Return weights (q, T), offsets (q, T, M, 3) and viewpoints of photographs."""
        images = torch.from_numpy(np.stack([photo.image[..., :3] for photo in photos]))
        masks = torch.from_numpy(np.stack([photo.image[..., 3] for photo in photos]))
        images, masks = images.permute(0, 3, 1, 2).to(self.device), masks.to(self.device)
        prediction = self.model.network(images, mask=masks)
        weights = prediction.template_weights.float().cpu().numpy()
        offsets = prediction.offsets.float().cpu().numpy()
        if not (np.isfinite(weights).all() and np.isfinite(offsets).all()):
            raise DataError("the network's outputs are not finite: its training has diverged")
        if prediction.viewpoint is not None:
            seen = [tuple(viewpoints(row)) for row in prediction.viewpoint.float().cpu()]
            return weights, offsets, seen
        camera = self.model.only_camera
        known = () if camera is None else (Viewpoint(camera.azimuth, camera.elevation, 1.0),)
        return weights, offsets, [known] * len(photos)

    def _reconstruction(
        self,
        photo: FramedPhoto,
        weights: NDArray[np.float32],
        offsets: NDArray[np.float32],
        seen: tuple[Viewpoint, ...],
        category: str | None,
    ) -> Reconstruction:
        bank, categories = self.model.bank, self.model.template_categories
        found = Reconstruction(photo, bank, weights, offsets, categories, categories[0], 0, seen)
        return found.of_category(category or next(iter(found.category_weights)))

    @property
    def knows_side(self) -> bool:
        """Whether reconstructions have a viewpoint."""
        model = self.model
        return model.network.viewpoint is not None or model.only_camera is not None


def checkpoint_of(source: str | Path | None) -> Path:
    """Return the checkpoint that a run folder, or a checkpoint file, stands for.

    Args:
        source: the folder or the file; None for the model that comes with the package.

    Raises:
        ConfigError: there is none of them.
    """
    if source is None:
        return pretrained_model()
    path = Path(source).expanduser()
    if path.is_file():
        return path
    run = RunFolder(path)
    if not run.checkpoint.is_file():
        RunFolder.at(path)  # raises where it is none
        raise ConfigError(f"{path} has no checkpoint yet: train it first, or let it train on")
    return run.checkpoint


def choose_device(name: str) -> torch.device:
    """Return the device of a name; `auto` is a GPU if there is one.

    Raises:
        ConfigError: there is no such device.
    """
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        device = torch.device(name)
        torch.empty(0, device=device)
    except (RuntimeError, AssertionError) as error:
        reason = str(error).split("\n")[0]
        raise ConfigError(f"device={name} cannot be used ({reason}): try device=cpu") from None
    return device
