"""Serves images and subsampled clouds, one item a step, so that a run can resume exactly.

What step k sees is a function of (seed, k) alone, not of a random generator's past: a run that is
killed and resumed, or split over devices, sees the same queries and the same points.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from lightning import LightningDataModule, Trainer
from numpy.typing import NDArray
from torch.utils.data import DataLoader, Dataset, Sampler

from ffd_lightning.data.batches import (
    Batch,
    BatchIndices,
    Residency,
    ShapeStore,
    augmented,
    fits,
    resident_bytes,
)
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.source import Source
from ffd_lightning.data.splits import HashSplit, Split, SplitInput, SplitRule, make_split
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.strategies import TemplateStrategy, auto_choice, choose_templates
from ffd_lightning.data.templates.summary import outlier_rows
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.lattice import Degrees
from ffd_lightning.imaging.augmentation import Augmentation
from ffd_lightning.imaging.framing import object_fill
from ffd_lightning.imaging.render_settings import RenderSettings

log = logging.getLogger(__name__)

_GPU_WORKERS = 2
_MEASURED = 1024  # images, to tell how large objects are in them
_ORDERS = 8  # passes over the shapes that are kept


class Sizes(NamedTuple):
    """What there is to draw from: views per shape, points per cloud, templates."""

    views: int
    cloud_points: int
    templates: int


def draw_points(
    clouds: int, cloud_points: int, num_points: int, rng: np.random.Generator
) -> NDArray[np.int64]:
    """Draw points of each of some clouds without replacement, (clouds, num_points)."""
    drawn = [
        rng.choice(cloud_points, num_points, replace=False, shuffle=False) for _ in range(clouds)
    ]
    return np.stack(drawn)


def _indices(*arrays: Any) -> BatchIndices:
    rows, views, points, templates = (torch.as_tensor(np.asarray(a, np.int64)) for a in arrays)
    return BatchIndices(rows, views, points, templates)


class TrainingIndices(Dataset[BatchIndices]):
    """Item k is what training step k sees: whole passes over the shuffled shapes, end to end.

    Args:
        rows: the shapes to train on.
        sizes: what there is to draw from.
        batch_size: queries a step, over all devices.
        num_points: points per cloud.
        seed: decides order, views and points.
        rank: of this device, which takes every `world_size`-th query of the batch.
        world_size: number of devices.

    Raises:
        ConfigError: a batch that cannot be split evenly.
    """

    def __init__(
        self,
        rows: NDArray[np.int64],
        sizes: Sizes,
        batch_size: int,
        num_points: int,
        seed: int,
        rank: int = 0,
        world_size: int = 1,
    ) -> None:
        if batch_size % world_size or batch_size == world_size > 1:
            raise ConfigError(
                f"schedule.batch_size={batch_size} cannot be split evenly over {world_size} "
                "devices, two images or more each"
            )
        self.rows, self.sizes = rows, sizes
        self.batch_size, self.num_points, self.seed = batch_size, num_points, seed
        self.rank, self.world_size = rank, world_size
        self._orders: dict[int, NDArray[np.int64]] = {}

    def _order(self, number: int) -> NDArray[np.int64]:
        if number not in self._orders:
            while len(self._orders) >= _ORDERS:
                del self._orders[min(self._orders)]
            order = np.random.default_rng([self.seed, 1, number]).permutation(self.rows)
            self._orders[number] = order
        return self._orders[number]

    def __getitem__(self, step: int) -> BatchIndices:
        places = step * self.batch_size + np.arange(self.batch_size)
        count = len(self.rows)
        rows = [int(self._order(int(p) // count)[int(p) % count]) for p in places]
        rng = np.random.default_rng([self.seed, 2, step])
        views = rng.integers(self.sizes.views, size=self.batch_size)
        # Points are drawn for all queries, so that a share of a batch is the same wherever it is.
        points, template_points = (
            draw_points(clouds, self.sizes.cloud_points, self.num_points, rng)
            for clouds in (self.batch_size, self.sizes.templates)
        )
        mine = slice(self.rank, None, self.world_size)
        own = np.random.SeedSequence([self.seed, 5, step, 0]).generate_state(1)
        indices = _indices(rows[mine], views[mine], points[mine], template_points)
        return indices._replace(seed=int(own[0]))


class EvaluationIndices(Dataset[BatchIndices]):
    """Item k is the k-th chunk of the shapes to score: first view, points fixed by `seed`.

    What is drawn of a shape does not depend on the others, so any share of them, or any size of
    chunks, gives the same scores.
    """

    def __init__(
        self,
        rows: NDArray[np.int64],
        sizes: Sizes,
        batch_size: int,
        num_points: int,
        seed: int = 0,
    ) -> None:
        self.rows, self.sizes = rows, sizes
        self.batch_size, self.num_points, self.seed = batch_size, num_points, seed

    def __len__(self) -> int:
        return -(-len(self.rows) // self.batch_size)

    def __getitem__(self, chunk: int) -> BatchIndices:
        if not 0 <= chunk < len(self):
            raise IndexError(chunk)
        rows = self.rows[chunk * self.batch_size : (chunk + 1) * self.batch_size]
        points = [self._points(1, 3, int(row))[0] for row in rows]
        return _indices(rows, np.zeros(len(rows)), points, self._template_points)

    @cached_property
    def _template_points(self) -> NDArray[np.int64]:
        return self._points(self.sizes.templates, 4, 0)

    def _points(self, clouds: int, *key: int) -> NDArray[np.int64]:
        rng = np.random.default_rng([self.seed, *key])
        return draw_points(clouds, self.sizes.cloud_points, self.num_points, rng)


class GatheredBatches(Dataset[Batch]):
    """Indices made into batches as they are read, for data that the loader's processes reach."""

    def __init__(self, indices: Dataset[BatchIndices], store: ShapeStore) -> None:
        self.indices, self.store = indices, store

    def __len__(self) -> int:
        return len(self.indices)  # type: ignore[arg-type]

    def __getitem__(self, index: int) -> Batch:
        return self.store.batch(self.indices[index])


class StepSampler(Sampler[int]):
    """Numbers of the batches of an epoch that are not done yet: batch k is the training's k-th.

    Its length stays that of the whole epoch, as Lightning counts from the epoch's first batch.

    Args:
        length: batches of an epoch.
        trainer: knows how many are done; None for none.
    """

    def __init__(self, length: int, trainer: Trainer | None = None) -> None:
        self.length, self._trainer = length, trainer

    def __len__(self) -> int:
        return self.length

    def __iter__(self) -> Iterator[int]:
        done, of_epoch = (0, 0) if self._trainer is None else _batches_done(self._trainer)
        return iter(range(done, done + self.length - of_epoch))


def _batches_done(trainer: Trainer) -> tuple[int, int]:
    """Return how many batches of the training, and of its epoch, are done.

    Raises:
        ConfigError: a checkpoint from which the training would not go on as it went: gradients of
            batches whose step is to come are not in it.
    """
    loop = trainer.fit_loop.epoch_loop
    done, every = loop.batch_progress.current.ready, trainer.accumulate_grad_batches
    steps = loop.automatic_optimization.optim_progress.optimizer.step.current.completed
    expected = min(steps * every, trainer.num_training_batches)  # an epoch's last step comes early
    if trainer.lightning_module.automatic_optimization and done != expected:
        raise ConfigError(
            f"the checkpoint was not written at the end of a step: after {done} batches of the "
            f"epoch, of which {every} make a step (accumulate_grad_batches). Take another one; "
            "ModelCheckpoint(every_n_train_steps=...) writes them at the end of steps"
        )
    return loop.batch_progress.total.completed, done


class Batches:
    """A `DataLoader` whose iterators are made when the first batch is asked for.

    Lightning makes them earlier, before it has read from a checkpoint how many batches are done.
    Nor does it put a sampler of its own into this, where each device loads its own share already.

    Args:
        loader: of whole batches.
    """

    def __init__(self, loader: DataLoader[Any]) -> None:
        self.loader = loader

    def __len__(self) -> int:
        return len(self.loader)

    def __iter__(self) -> Iterator[BatchIndices | Batch]:
        yield from self.loader

    def state_dict(self) -> dict[str, Any]:
        """Return nothing, as Lightning keeps all counts; without it, it warns of resuming."""
        return {}

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Do nothing."""


class FfdDataModule(LightningDataModule):
    """Prepares categories, splits their shapes, chooses templates, and serves batches.

    With `Trainer(max_steps=...)` the whole training is one epoch; with `max_epochs`, an epoch is as
    many batches as it takes to see every shape once.

    Args:
        categories: one, or several that one network is trained on together.
        source: where shapes come from.
        num_templates: T, equally many of each category.
        template_strategy: how templates are chosen.
        hold_out: keep as many of the first templates out of all subsets, also where fewer are
            used: networks of different T then see the same shapes. Of each category equally many.
        split: assigns shapes to subsets, by the hash of their id unless told otherwise.
        val_fraction: share of the training shapes to validate on, where the split names none.
        drop_outliers: leave what is like nothing else in its category, see
            `templates.coverage.outlying`, out of all subsets and of the choice of templates.
        degrees: of the lattices, see `TemplateBank`.
        max_edge: of the templates' meshes, see `TemplateBank`.
        batch_size: queries a step, over all devices.
        num_points: points per cloud and step.
        seed: decides what each step sees.
        render: the images.
        cloud_points: surface samples kept of each shape, of which steps draw theirs.
        root: prepared data is kept below it.
        limit: see `Preparation`.
        augmentation: changes the images that are trained on, and no others.
        residency: where images and clouds are kept while training, see `Residency`.
        num_workers: processes that read ahead; None for none on the CPU and some beside a GPU.
        prepare_workers: see `Preparation`.
        prepare_timeout: see `Preparation`.
        progress: see `Preparation`.

    Raises:
        ConfigError: no category, or one twice; templates that categories cannot give equally many
            of; fewer held out than used.

    Attributes:
        prepared: the prepared set, after `setup`.
        bank: the templates, after `setup`.
        split: ids of each subset, after `setup`.
    """

    prepared: PreparedSet
    bank: TemplateBank
    split: Split

    def __init__(
        self,
        categories: str | Sequence[str],
        source: Source,
        *,
        num_templates: int = 16,
        template_strategy: TemplateStrategy = auto_choice,
        hold_out: int | None = None,
        split: SplitRule | None = None,
        val_fraction: float = 0.1,
        drop_outliers: bool = False,
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
        batch_size: int = 32,
        num_points: int = 1024,
        seed: int = 0,
        render: RenderSettings | None = None,
        cloud_points: int = 16384,
        root: str | Path = "data",
        limit: int | None = None,
        augmentation: Augmentation | None = None,
        residency: Residency = "auto",
        num_workers: int | None = None,
        prepare_workers: int = 0,
        prepare_timeout: float = 600.0,
        progress: bool = True,
    ) -> None:
        super().__init__()
        names = (categories,) if isinstance(categories, str) else tuple(categories)
        if not names or len(set(names)) < len(names):
            raise ConfigError(f"categories={list(names)} must name one or more, and none twice")
        for setting, count in (("count", num_templates), ("hold_out", hold_out or 0)):
            if count % len(names):
                raise ConfigError(
                    f"templates.{setting}={count} must be a multiple of {len(names)}, the number "
                    "of categories, each of which gives equally many"
                )
        if hold_out is not None and hold_out < num_templates:
            raise ConfigError(
                f"templates.hold_out={hold_out} is less than templates.count={num_templates}"
            )
        self.render = render or RenderSettings()
        self.preparations = tuple(
            Preparation(
                source=source,
                category=name,
                num_points=cloud_points,
                render=self.render,
                root=Path(root),
                limit=limit,
                workers=prepare_workers,
                timeout=prepare_timeout,
                progress=progress,
            )
            for name in names
        )
        self.num_templates, self.template_strategy = num_templates, template_strategy
        self.hold_out, self.degrees, self.max_edge = hold_out, degrees, max_edge
        self.split_rule, self.val_fraction = split or HashSplit(), val_fraction
        self.drop_outliers = drop_outliers
        self.batch_size, self.num_points, self.seed = batch_size, num_points, seed
        self.residency, self.num_workers = residency, num_workers
        self.augmentation = augmentation
        self._stored: tuple[torch.device, ShapeStore] | None = None

    @property
    def categories(self) -> tuple[str, ...]:
        """Names of the categories."""
        return tuple(preparation.category for preparation in self.preparations)

    @property
    def root(self) -> Path:
        """Folder that prepared data is kept below."""
        return self.preparations[0].root

    def prepare_data(self) -> None:
        """Build the prepared sets where they are missing (on one process)."""
        for preparation in self.preparations:
            preparation.run()

    def setup(self, stage: str | None = None) -> None:
        """Open the prepared sets, split them and choose templates; once, whatever the stage."""
        if hasattr(self, "prepared"):
            return
        members = [self._member(preparation) for preparation in self.preparations]
        if len(members) == 1:
            self.prepared, templates, self.split = members[0]
        else:
            self.prepared = PreparedSet.join([prepared for prepared, _, _ in members])
            templates = _prefixed(self.categories, [ids for _, ids, _ in members])
            subsets = zip(*(split for _, _, split in members), strict=True)
            self.split = Split(*(_prefixed(self.categories, subset) for subset in subsets))
        self.bank = TemplateBank.of(self.prepared, templates, self.degrees, self.max_edge)

    def _member(self, preparation: Preparation) -> tuple[PreparedSet, tuple[str, ...], Split]:
        """Open a category's set, split it, and choose templates from what is not tested on."""
        prepared, category = preparation.run(), preparation.category
        shares = len(self.preparations)
        count = self.num_templates // shares
        most = max(count, (self.hold_out or 0) // shares)
        published = preparation.source.split(category)
        given = SplitInput(category, prepared.ids, tuple(prepared.rejected), published)
        dropped = {row["id"] for row in outlier_rows(prepared)} if self.drop_outliers else ()
        kept = [shape_id for shape_id in prepared.ids if shape_id not in dropped]
        split = make_split(kept, self.split_rule(given), self.val_fraction)
        templates = choose_templates(
            self.template_strategy, prepared, most, {*split.test, *dropped}
        )
        return prepared, templates[:count], split.without(templates)

    def record(self) -> dict[str, Any]:
        """Return what there is to say of the data afterwards: plain values, after `setup`.

        `sources` is the fingerprint of each category's source, `prepared` the name of its set,
        `templates` are ids, `shapes` how many are in each subset.
        """
        return {
            "sources": {p.category: p.settings["source"] for p in self.preparations},
            "prepared": {p.category: p.target.name for p in self.preparations},
            "templates": list(self.bank.ids),
            "shapes": {name: len(ids) for name, ids in self.split._asdict().items()},
        }

    def rows(self, ids: Sequence[str]) -> NDArray[np.int64]:
        """Return the prepared set's rows of shapes."""
        return np.asarray([self.prepared.index(i) for i in ids], np.int64)

    @cached_property
    def object_fill(self) -> float:
        """How large objects are in training images, see `object_fill` of `imaging.framing`."""
        views = self.prepared.spread_views(self.rows(self.split.train), _MEASURED)
        return object_fill(self.prepared.image(*view) for view in views)

    @property
    def store(self) -> ShapeStore:
        """Where batches come from: what `residency` says, for the present trainer's device."""
        device = self.trainer.strategy.root_device if self.trainer else torch.device("cpu")
        if self._stored is None or self._stored[0] != device:
            self._stored = None  # what another device held is not needed any more
            self._stored = device, self._store(device)
        return self._stored[1]

    def _store(self, device: torch.device) -> ShapeStore:
        coverage = self.augmentation is not None
        size = resident_bytes(self.prepared, self.bank, coverage)
        kept = fits(size, device) if self.residency == "auto" else self.residency == "device"
        if kept:
            log.info("reading %.1f GB of images and clouds into memory (%s)", size / 1e9, device)
        return ShapeStore(self.prepared, self.bank, device if kept else None, coverage)

    def train_dataloader(self) -> Batches:
        """Batches of the training shapes, from the trainer's current one on."""
        indices = TrainingIndices(
            self.rows(self.split.train),
            self._sizes,
            self.batch_size,
            self.num_points,
            self.seed,
            *self._share,
        )
        return self._loader(indices, StepSampler(self._batches_per_epoch, self.trainer))

    def val_dataloader(self) -> Batches | list[Any]:
        """The validation shapes with fixed points; nothing where there are none."""
        return self._loader(self._evaluation_indices(self.split.val)) if self.split.val else []

    def test_dataloader(self) -> Batches:
        """The test shapes with fixed points."""
        return self._loader(self._evaluation_indices(self.split.test))

    def predict_dataloader(self) -> Batches:
        """The test shapes, in their order."""
        return self.test_dataloader()

    def on_after_batch_transfer(self, batch: BatchIndices | Batch, dataloader_idx: int) -> Batch:
        """Gather a batch where the loader has not, and change the images of a training step."""
        gathered = self.store.batch(batch) if isinstance(batch, BatchIndices) else batch
        if self.augmentation is None:
            return gathered
        return augmented(gathered, self.augmentation, *self._share)

    def _evaluation_indices(self, ids: Sequence[str]) -> EvaluationIndices:
        """Return this device's share of some shapes, in chunks."""
        rank, world_size = self._share
        rows = self.rows(ids)[rank::world_size]
        return EvaluationIndices(rows, self._sizes, self.batch_size, self.num_points)

    @property
    def _share(self) -> tuple[int, int]:
        """Which device this is, of how many."""
        return (self.trainer.global_rank, self.trainer.world_size) if self.trainer else (0, 1)

    @property
    def _sizes(self) -> Sizes:
        return Sizes(self.prepared.image_shape[0], self.prepared.num_points, len(self.bank))

    @property
    def _batches_per_epoch(self) -> int:
        trainer = self.trainer
        if trainer is not None and trainer.max_steps > 0 and trainer.max_epochs in (None, -1):
            return trainer.max_steps * trainer.accumulate_grad_batches
        return -(-len(self.split.train) // self.batch_size)

    def _loader(
        self, indices: Dataset[BatchIndices], sampler: Sampler[int] | None = None
    ) -> Batches:
        on_gpu = self.trainer is not None and self.trainer.strategy.root_device.type == "cuda"
        workers = self.num_workers
        if workers is None:
            # Beside a GPU other processes draw ahead; on the CPU they would take its cores.
            workers = _GPU_WORKERS if on_gpu else 0
        here = self.store.device.type == "cpu"
        loader: DataLoader[Any] = DataLoader(
            GatheredBatches(indices, self.store) if here else indices,
            batch_size=None,
            sampler=sampler,
            num_workers=workers,
            pin_memory=on_gpu,
        )
        return Batches(loader)


def _prefixed(names: Sequence[str], ids: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return ids as a joined set names them."""
    return tuple(f"{name}/{i}" for name, own in zip(names, ids, strict=True) for i in own)
