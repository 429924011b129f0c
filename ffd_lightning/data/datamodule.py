"""Serves images and subsampled clouds, one item a step, so that a run can resume exactly.

What step k sees is a function of (seed, k) alone, not of a random generator's past: a run that is
killed and continued, or split over devices, sees the same queries and the same points.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from lightning import LightningDataModule
from numpy.typing import NDArray
from torch.utils.data import DataLoader, Dataset, Sampler

from ffd_lightning.app.config import Residency, SplitKind, TemplateStrategy
from ffd_lightning.data.batches import Batch, Draw, ModelStore, choose_residency, resident_bytes
from ffd_lightning.data.preparation.joined import JoinedSet
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.splits import Split, hash_parts, listed_parts, make_split, r2n2_parts
from ffd_lightning.data.templates.bank import TemplateBank, choose_templates
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.lattice import Degrees

log = logging.getLogger(__name__)

_GPU_WORKERS = 2
_ORDERS = 8  # passes over the models that are kept


class Sizes(NamedTuple):
    """What there is to draw from: views per model, points per cloud, templates."""

    views: int
    cloud_points: int
    templates: int


def make_draw(
    rows: Sequence[int],
    views: Sequence[int],
    sizes: Sizes,
    num_points: int,
    rng: np.random.Generator,
    mine: slice = slice(None),
) -> Draw:
    """Draw fresh points for queries and templates, each its own, without replacement.

    Args:
        rows: rows of the prepared set.
        views: as many indices of views.
        sizes: what there is to draw from.
        num_points: points per cloud.
        rng: draws the points.
        mine: which q of the rows to return. Points are drawn for all of them, so that a share of
            a batch is the same wherever it is made.
    """
    points, template_points = (
        np.stack(
            [
                rng.choice(sizes.cloud_points, num_points, replace=False, shuffle=False)
                for _ in range(clouds)
            ]
        )
        for clouds in (len(rows), sizes.templates)
    )
    return Draw(
        *(
            torch.as_tensor(np.asarray(index, np.int64))
            for index in (rows[mine], views[mine], points[mine], template_points)
        )
    )


class TrainingDraws(Dataset[Draw]):
    """Item k is the draw of training step k: whole passes over the shuffled models, end to end.

    Args:
        rows: the models to train on.
        sizes: what there is to draw from.
        batch_size: queries a step, over all devices.
        num_points: points per cloud.
        seed: decides order, views and points.
        rank, world_size: this device takes every `world_size`-th query of the batch.

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
        if batch_size % world_size:
            raise ConfigError(
                f"schedule.batch_size={batch_size} cannot be split evenly over {world_size} devices"
            )
        self.rows, self.sizes = rows, sizes
        self.batch_size, self.num_points, self.seed = batch_size, num_points, seed
        self.rank, self.world_size = rank, world_size
        self._orders: dict[int, NDArray[np.int64]] = {}

    def _order(self, epoch: int) -> NDArray[np.int64]:
        if epoch not in self._orders:
            while len(self._orders) >= _ORDERS:
                del self._orders[min(self._orders)]
            order = np.random.default_rng([self.seed, 1, epoch]).permutation(self.rows)
            self._orders[epoch] = order
        return self._orders[epoch]

    def __getitem__(self, step: int) -> Draw:
        places = step * self.batch_size + np.arange(self.batch_size)
        count = len(self.rows)
        rows = [int(self._order(int(p) // count)[int(p) % count]) for p in places]
        rng = np.random.default_rng([self.seed, 2, step])
        views = rng.integers(self.sizes.views, size=self.batch_size)
        mine = slice(self.rank, None, self.world_size)
        return make_draw(rows, views.tolist(), self.sizes, self.num_points, rng, mine)


class EvaluationDraws(Dataset[Draw]):
    """Item k is the k-th chunk of the models to evaluate: first view, points fixed by `seed`."""

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

    def __getitem__(self, chunk: int) -> Draw:
        if not 0 <= chunk < len(self):
            raise IndexError(chunk)
        rows = self.rows[chunk * self.batch_size : (chunk + 1) * self.batch_size].tolist()
        rng = np.random.default_rng([self.seed, 3, chunk])
        return make_draw(rows, [0] * len(rows), self.sizes, self.num_points, rng)


class Gathered(Dataset[Batch]):
    """Draws made into batches as they are read, for data that the loader's processes can reach."""

    def __init__(self, draws: Dataset[Draw], store: ModelStore) -> None:
        self.draws, self.store = draws, store

    def __len__(self) -> int:
        return len(self.draws)  # type: ignore[arg-type]

    def __getitem__(self, index: int) -> Batch:
        return self.store.batch(self.draws[index])


class StepSampler(Sampler[int]):
    """Steps `start` to `total`; its length stays `total`, as Lightning counts from step 0."""

    def __init__(self, start: int, total: int) -> None:
        self.start, self.total = start, total

    def __len__(self) -> int:
        return self.total

    def __iter__(self) -> Iterator[int]:
        return iter(range(self.start, self.total))


class FfdDataModule(LightningDataModule):
    """Prepares a category, chooses templates, splits the rest, and serves steps.

    Args:
        preparations: what the models are and where prepared data is kept, of one category, or of
            several that are trained together; these give equally many templates each, and
            `{category}` in `template_file` stands for their names.
        split, split_file, train_fraction: which of those that are no templates are trained on: by
            hash of the id, by 3D-R2N2's rule, by the source's own split, or by a file.
        num_templates, template_strategy, template_file, template_seed: see `choose_templates`.
        hold_out: keep as many of the first templates out of training and testing, also where fewer
            are used: what networks of different counts are trained and tested on is then the same.
        degrees, max_edge: see `TemplateBank`.
        batch_size, num_points, steps: queries a step, points per cloud and step, steps in all.
        seed: decides what each step sees.
        residency: where images and clouds are kept while training.
        num_workers: processes that read ahead; None for none on the CPU and some beside a GPU.

    Attributes:
        prepared: the prepared set, after `setup`.
        bank: the templates, after `setup`.
        split: ids to train and test on, after `setup`.
    """

    prepared: PreparedSet
    bank: TemplateBank
    split: Split

    def __init__(
        self,
        *,
        preparations: Sequence[Preparation],
        split: SplitKind = SplitKind.hash,
        split_file: str | None = None,
        train_fraction: float = 0.8,
        num_templates: int,
        template_strategy: TemplateStrategy,
        template_file: str | None = None,
        template_seed: int = 0,
        hold_out: int | None = None,
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
        batch_size: int = 32,
        num_points: int = 1024,
        steps: int = 100_000,
        seed: int = 0,
        residency: Residency = Residency.auto,
        num_workers: int | None = None,
    ) -> None:
        super().__init__()
        self.preparations, self.train_fraction = tuple(preparations), train_fraction
        self.split_kind, self.split_file = split, split_file
        self.num_templates, self.template_strategy = num_templates, template_strategy
        self.template_file, self.template_seed = template_file, template_seed
        self.hold_out, self.degrees, self.max_edge = hold_out, degrees, max_edge
        self.batch_size, self.num_points, self.steps = batch_size, num_points, steps
        self.seed, self.residency, self.num_workers = seed, residency, num_workers

    def prepare_data(self) -> None:
        """Build the prepared sets where they are missing (on one process)."""
        for preparation in self.preparations:
            preparation.run()

    def setup(self, stage: str | None = None) -> None:
        """Open the prepared sets, choose templates and split the rest; once, whatever the stage."""
        if hasattr(self, "prepared"):
            return
        members = [self._member(preparation) for preparation in self.preparations]
        if len(members) == 1:
            self.prepared, templates, self.split = members[0]
        else:
            self.prepared = JoinedSet.join([prepared for prepared, _, _ in members])
            names = [preparation.category for preparation in self.preparations]
            templates = _prefixed(names, [ids for _, ids, _ in members])
            self.split = Split(
                _prefixed(names, [split.train for _, _, split in members]),
                _prefixed(names, [split.test for _, _, split in members]),
            )
        self.bank = TemplateBank.of(self.prepared, templates, self.degrees, self.max_edge)

    def _member(self, preparation: Preparation) -> tuple[PreparedSet, tuple[str, ...], Split]:
        """Open a category's set, choose its templates and split the rest."""
        prepared, category = preparation.run(), preparation.category
        shares = len(self.preparations)
        count = self.num_templates // shares
        file = self.template_file
        ids = choose_templates(
            prepared,
            max(count, (self.hold_out or 0) // shares),
            self.template_strategy,
            file and str(file).replace("{category}", category),
            self.template_seed,
        )
        parts, hint = self._parts(preparation, prepared)
        return prepared, ids[:count], make_split(prepared.ids, parts, ids, hint)

    def _parts(self, preparation: Preparation, prepared: PreparedSet) -> tuple[dict[str, str], str]:
        """Return the part of each model, and the setting that decides it."""
        category, kind = preparation.category, self.split_kind
        if kind is SplitKind.listed:
            file = Path(str(self.split_file)).expanduser()
            return listed_parts(file, category), f"data.split_file={file}"
        if kind is SplitKind.r2n2:
            return r2n2_parts([*prepared.ids, *prepared.rejected]), "data.split=r2n2"
        if kind is SplitKind.source:
            parts = preparation.source.split(category)
            if not parts:
                raise ConfigError("this source has no split of its own: use data.split=hash")
            return parts, "data.split=source"
        parts = hash_parts(prepared.ids, self.train_fraction)
        return parts, f"data.train_fraction={self.train_fraction}"

    def rows(self, ids: Sequence[str]) -> NDArray[np.int64]:
        """Return the prepared set's rows of model ids."""
        return np.asarray([self.prepared.index(i) for i in ids], np.int64)

    @cached_property
    def store(self) -> ModelStore:
        """Where batches come from: what `residency` says, on the trainer's device if it has one."""
        device = self.trainer.strategy.root_device if self.trainer else torch.device("cpu")
        size = resident_bytes(self.prepared, self.bank)
        residency = self.residency
        if residency is Residency.auto:
            residency = choose_residency(size, device)
        if residency is Residency.disk:
            return ModelStore(self.prepared, self.bank)
        place = device if residency is Residency.device else torch.device("cpu")
        log.info("reading %.1f GB of images and clouds into memory (%s)", size / 1e9, place)
        return ModelStore(self.prepared, self.bank, place)

    def train_dataloader(self) -> DataLoader[Any]:
        """Steps from the trainer's current one to the last."""
        trainer = self.trainer
        draws = TrainingDraws(
            self.rows(self.split.train),
            self._sizes,
            self.batch_size,
            self.num_points,
            self.seed,
            trainer.global_rank if trainer else 0,
            trainer.world_size if trainer else 1,
        )
        start = trainer.global_step if trainer else 0
        return self._loader(draws, StepSampler(start, self.steps))

    def val_dataloader(self) -> DataLoader[Any]:
        """The test models: nothing is chosen by them, they only show how training goes."""
        return self.test_dataloader()

    def test_dataloader(self) -> DataLoader[Any]:
        """The test models with fixed points."""
        return self._loader(self._evaluation_draws(), None)

    def on_after_batch_transfer(self, batch: Draw | Batch, dataloader_idx: int) -> Batch:
        """Gather a draw on the device that holds the data; the loader has gathered others."""
        return self.store.batch(batch) if isinstance(batch, Draw) else batch

    def evaluation_batches(self) -> Iterator[Batch]:
        """Yield the test models in chunks, the same at every call."""
        draws = self._evaluation_draws()
        return (self.store.batch(draws[k]) for k in range(len(draws)))

    def _evaluation_draws(self) -> EvaluationDraws:
        rows = self.rows(self.split.test)
        return EvaluationDraws(rows, self._sizes, self.batch_size, self.num_points)

    @property
    def _sizes(self) -> Sizes:
        return Sizes(self.prepared.image_shape[0], self.prepared.num_points, len(self.bank))

    def _loader(self, draws: Dataset[Draw], sampler: Sampler[int] | None) -> DataLoader[Any]:
        on_gpu = self.trainer is not None and self.trainer.strategy.root_device.type == "cuda"
        workers = self.num_workers
        if workers is None:
            # Beside a GPU other processes draw ahead; on the CPU they would take its cores.
            workers = _GPU_WORKERS if on_gpu else 0
        return DataLoader(
            Gathered(draws, self.store) if self.store.device.type == "cpu" else draws,
            batch_size=None,
            sampler=sampler,
            num_workers=workers,
            pin_memory=on_gpu,
        )


def _prefixed(names: Sequence[str], ids: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Return ids as a joined set names them."""
    return tuple(f"{name}/{i}" for name, own in zip(names, ids, strict=True) for i in own)
