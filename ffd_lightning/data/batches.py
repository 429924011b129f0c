"""What one step sees: drawn as indices, then gathered wherever the data is kept."""

import math
from typing import Any, Literal, NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from torch import Tensor

from ffd_lightning.data.preparation.packing import POINT_STEP
from ffd_lightning.data.preparation.prepared import PreparedSet, read_in_threads
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.errors import ConfigError, DataError
from ffd_lightning.geometry.ffd import Lattice, TemplateSample, deformation_matrix
from ffd_lightning.imaging.augmentation import Augmentation
from ffd_lightning.nn.network import DrawnTemplates

Residency = Literal["auto", "disk", "device"]
"""Where images and clouds are kept while training: in files, or on the device that trains; `auto`
keeps on a GPU what half of its free memory holds."""


class BatchIndices(NamedTuple):
    """A batch as indices: quick to draw ahead, and small enough to be sent anywhere.

    Attributes:
        rows: row of each query in the prepared set, (q,).
        views: view of each query, (q,).
        points: which points of each query's cloud, (q, N).
        template_points: which points of each template's cloud, (T, N).
        seed: what is random about a training batch's images follows from it; None where nothing is.
        template_rows: row of each template, (T,), where a step draws its own; None for the bank's.
        template_views: which picture of each of these, (T,).
        cameras: azimuth and elevation of each training image in degrees, (q, 2).
        own_templates: of a training step the templates of each query's category, (q, K), where
            there are several categories.
    """

    rows: Int[Tensor, " queries"]
    views: Int[Tensor, " queries"]
    points: Int[Tensor, "queries num_points"]
    template_points: Int[Tensor, "templates num_points"]
    seed: int | None = None
    template_rows: Int[Tensor, " templates"] | None = None
    template_views: Int[Tensor, " templates"] | None = None
    cameras: Float[Tensor, "queries 2"] | None = None
    own_templates: Int[Tensor, "queries own"] | None = None


class Batch(NamedTuple):
    """What one step sees.

    Attributes:
        rows: row of each query in the prepared set, (q,).
        images: RGB over white, (q, 3, H, W) uint8.
        target_points: ground truth clouds, (q, N, 3).
        templates: decomposed points of all templates.
        own_templates: see `BatchIndices`.
        mask: of the object in the images, (q, H, W) uint8; None where it is not kept.
        seed: see `BatchIndices`.
        drawn: what conditioned heads are told of the templates that a step draws.
        cameras: see `BatchIndices`.
    """

    rows: Int[Tensor, " queries"]
    images: UInt8[Tensor, "queries 3 height width"]
    target_points: Float[Tensor, "queries num_points 3"]
    templates: TemplateSample
    own_templates: Int[Tensor, "queries own"] | None = None
    mask: UInt8[Tensor, "queries height width"] | None = None
    seed: int | None = None
    drawn: DrawnTemplates | None = None
    cameras: Float[Tensor, "queries 2"] | None = None


class ShapeStore:
    """Images, clouds and decomposed templates in one place, from which indices become batches.

    Args:
        prepared: the shapes.
        bank: the templates.
        device: where to copy everything to; None leaves the shapes in their files, and the
            templates where they are.
        mask: keeps the images' object masks too.
        boxes: of the lattices of the shapes that steps draw as templates, (n, 2, 3): the least and
            the greatest coordinates; None where none are drawn.

    Raises:
        DataError: the device has too little memory.
    """

    def __init__(
        self,
        prepared: PreparedSet,
        bank: TemplateBank,
        device: torch.device | None = None,
        mask: bool = False,
        boxes: Float[Tensor, "shapes 2 3"] | None = None,
    ) -> None:
        self._prepared, self._bank, self._mask = prepared, bank, mask
        self._channels = 4 if mask else 3
        self.images: Tensor | None = None
        self.clouds: Tensor | None = None
        place = device or torch.device("cpu")
        try:
            if device is not None:
                self.images, self.clouds = self._resident(device)
            self.control_points = bank.control_points.to(place)
            self.matrix = bank.deformation_matrix.to(place)
            self._boxes = None if boxes is None else boxes.to(place)
        except torch.OutOfMemoryError:
            size = resident_bytes(prepared, bank, mask)
            raise DataError(
                f"the images and clouds of {prepared.path} take {size / 1e9:.1f} GB, more than "
                f"{device} has left: use trainer.residency=disk"
            ) from None

    def __reduce__(self) -> tuple[Any, ...]:
        # Another process reads the files itself: tensors would travel as a copy of them all.
        return ShapeStore, (self._prepared, self._bank, None, self._mask, self._boxes)

    @property
    def device(self) -> torch.device:
        """Where batches come out."""
        return self.matrix.device

    def batch(self, indices: BatchIndices) -> Batch:
        """Gather what the indices name, on the device where the data is."""
        there: Any = (
            index.to(self.device, non_blocking=True) if isinstance(index, Tensor) else index
            for index in indices
        )
        rows, views, points, template_points, seed, drawn_rows, drawn_views, cameras, own = there
        images, clouds = self._gather(rows, views, points)
        if drawn_rows is not None:
            templates, drawn = self._drawn(drawn_rows, drawn_views, template_points)
        else:
            numbers = torch.arange(len(template_points), device=rows.device)[:, None]
            matrix = _select(self.matrix, numbers, template_points)
            templates = TemplateSample(matrix, self.control_points, self._bank.degrees)
            drawn = None
        return Batch(
            rows=rows,
            images=images[..., :3].permute(0, 3, 1, 2),
            target_points=clouds.float() * POINT_STEP,
            templates=templates,
            own_templates=own,
            mask=images[..., 3] if self._mask else None,
            seed=seed,
            drawn=drawn,
            cameras=cameras,
        )

    def _drawn(
        self, rows: Tensor, views: Tensor, points: Tensor
    ) -> tuple[TemplateSample, DrawnTemplates]:
        """Decompose points of shapes that are templates of this step alone."""
        assert self._boxes is not None
        images, clouds = self._gather(rows, views, points)
        cloud = clouds.float() * POINT_STEP
        low, high = self._boxes[rows].unbind(1)
        lattice = Lattice(low, high - low, self._bank.degrees)
        matrix = deformation_matrix(cloud.double(), lattice).float()
        templates = TemplateSample(matrix, lattice.control_points().float(), lattice.degrees)
        return templates, DrawnTemplates(cloud, images[..., :3].permute(0, 3, 1, 2))

    def _gather(self, rows: Tensor, views: Tensor, points: Tensor) -> tuple[Tensor, Tensor]:
        """Return images (q, H, W, channels) and points (q, N, 3) of shapes."""
        if self.images is not None and self.clouds is not None:
            seen = _select(self.images, rows[:, None], views[:, None])[:, 0]
            return seen, _select(self.clouds, rows[:, None], points)
        size, places = self._prepared.image_shape[1:3], points.numpy()
        images = np.empty((len(rows), *size, self._channels), np.uint8)
        clouds = np.empty((*points.shape, 3), np.int16)

        def read(query: int) -> None:
            row, view = int(rows[query]), int(views[query])
            images[query] = self._prepared.image(row, view)[..., : self._channels]
            clouds[query] = self._prepared.packed_cloud(row)[places[query]]

        read_in_threads(read, range(len(rows)))
        return torch.from_numpy(images), torch.from_numpy(clouds)

    def _resident(self, device: torch.device) -> tuple[Tensor, Tensor]:
        """Copy all images, (n, views, H, W, channels), and clouds, (n, N, 3), to a device."""
        prepared, count = self._prepared, len(self._prepared)
        shape = (count, *prepared.image_shape[:3], self._channels)
        images = torch.empty(shape, dtype=torch.uint8, device=device)
        clouds = torch.empty((count, prepared.num_points, 3), dtype=torch.int16, device=device)

        def copy(row: int) -> None:
            clouds[row] = torch.tensor(prepared.packed_cloud(row))
            images[row] = torch.from_numpy(prepared.images(row)[..., : self._channels])

        read_in_threads(copy, range(count))
        return images, clouds


def augmented(
    batch: Batch, augmentation: Augmentation, rank: int = 0, world_size: int = 1
) -> Batch:
    """Return a training batch with other images of its objects; any other batch as it is.

    It has masks, and every `world_size`-th query of the whole batch, from the `rank`-th on. What is
    drawn for a query is what one device would draw for it that had the whole batch.
    """
    if batch.seed is None or batch.mask is None:
        return batch
    images = torch.cat([batch.images, batch.mask[:, None]], dim=1)
    # As many as the whole batch has, this device's where they are in it: what is drawn fits.
    images = images.repeat_interleave(world_size, dim=0)
    with torch.random.fork_rng([images.device] if images.is_cuda else []):
        torch.manual_seed(batch.seed)
        made: Any = augmentation(images)
    kind = (made.shape, made.dtype) if isinstance(made, Tensor) else type(made).__name__
    if kind != (images.shape, images.dtype):
        raise ConfigError(
            f"the augmentation must turn images of {(*images.shape,)} uint8 into as many, and "
            f"gives {kind}"
        )
    made = made[rank::world_size]
    return batch._replace(images=made[:, :3], mask=made[:, 3])


def resident_bytes(prepared: PreparedSet, bank: TemplateBank, mask: bool = False) -> int:
    """Return what `ShapeStore` copies to a device, in bytes."""
    images = len(prepared) * math.prod(prepared.image_shape[:3]) * (4 if mask else 3)
    clouds = len(prepared) * prepared.num_points * 3 * 2
    return images + clouds + bank.deformation_matrix.nbytes


def _select(table: Tensor, first: Tensor, second: Tensor) -> Tensor:
    """Return table[first, second]: as one flat selection, several times faster on the CPU."""
    flat = first * table.shape[1] + second
    return table.flatten(0, 1).index_select(0, flat.flatten()).unflatten(0, flat.shape)
