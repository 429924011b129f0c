"""Serves images and subsampled clouds, one item a step, so that a run can resume exactly.

What step k sees is a function of (seed, k) alone, not of a random generator's past: a run that is
killed and continued, or split over devices, sees the same queries and the same points.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Int, UInt8
from lightning import LightningDataModule
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.data import DataLoader, Dataset, Sampler

from ffd_lightning.config import RenderConfig, TemplateStrategy
from ffd_lightning.data.preparation import prepare
from ffd_lightning.data.prepared import PreparedSet
from ffd_lightning.data.sources.base import Source
from ffd_lightning.data.splits import Split, split_ids
from ffd_lightning.data.templates import TemplateBank, choose_templates
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.deformation import TemplateSample
from ffd_lightning.geometry.lattice import Degrees


class Batch(NamedTuple):
    """What one step sees.

    Attributes:
        rows: row of each query in the prepared set, (q,).
        images: RGB over white, (q, 3, H, W) uint8.
        target_points: ground truth clouds, (q, N, 3).
        templates: decomposed points of all templates.
    """

    rows: Int[Tensor, " queries"]
    images: UInt8[Tensor, "queries 3 height width"]
    target_points: Float[Tensor, "queries num_points 3"]
    templates: TemplateSample


def make_batch(
    prepared: PreparedSet,
    bank: TemplateBank,
    rows: Sequence[int],
    views: Sequence[int],
    num_points: int,
    rng: np.random.Generator,
    mine: slice = slice(None),
) -> Batch:
    """Read images and draw fresh points for queries and templates.

    Args:
        prepared: where queries come from.
        bank: the templates.
        rows: rows of the prepared set.
        views: as many indices of views.
        num_points: points per cloud, drawn without replacement.
        rng: draws the points.
        mine: which q of the rows to return. Points are drawn for all of them, so that a share of
            a batch is the same wherever it is made.
    """
    total = prepared.points.shape[1]
    draws = [rng.choice(total, num_points, replace=False, shuffle=False) for _ in rows]
    rows, views = rows[mine], views[mine]
    images = np.stack([prepared.images[r, v, ..., :3] for r, v in zip(rows, views, strict=True)])
    clouds = np.stack([prepared.points[r][d] for r, d in zip(rows, draws[mine], strict=True)])
    return Batch(
        rows=torch.as_tensor(rows, dtype=torch.int64),
        images=torch.from_numpy(images).permute(0, 3, 1, 2),
        target_points=torch.from_numpy(clouds),
        templates=bank.sample(num_points, rng),
    )


class TrainingSteps(Dataset[Batch]):
    """Item k is the batch of training step k: whole passes over the shuffled models, end to end.

    Args:
        prepared, bank, rows: the models to train on.
        batch_size: queries a step, over all devices.
        num_points: points per cloud.
        seed: decides order, views and points.
        rank, world_size: this device takes every `world_size`-th query of the batch.

    Raises:
        ConfigError: a batch that cannot be split evenly.
    """

    def __init__(
        self,
        prepared: PreparedSet,
        bank: TemplateBank,
        rows: NDArray[np.int64],
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
        self.prepared, self.bank, self.rows = prepared, bank, rows
        self.batch_size, self.num_points, self.seed = batch_size, num_points, seed
        self.rank, self.world_size = rank, world_size

    @lru_cache(maxsize=8)  # noqa: B019 - a run has one of these
    def _order(self, epoch: int) -> NDArray[np.int64]:
        return np.random.default_rng([self.seed, 1, epoch]).permutation(self.rows)

    def __getitem__(self, step: int) -> Batch:
        places = step * self.batch_size + np.arange(self.batch_size)
        count = len(self.rows)
        rows = [int(self._order(int(p) // count)[int(p) % count]) for p in places]
        rng = np.random.default_rng([self.seed, 2, step])
        views = rng.integers(self.prepared.images.shape[1], size=self.batch_size)
        mine = slice(self.rank, None, self.world_size)
        return make_batch(
            self.prepared, self.bank, rows, views.tolist(), self.num_points, rng, mine
        )


class EvaluationChunks(Dataset[Batch]):
    """Item k is the k-th chunk of the models to evaluate: first view, points fixed by `seed`."""

    def __init__(
        self,
        prepared: PreparedSet,
        bank: TemplateBank,
        rows: NDArray[np.int64],
        batch_size: int,
        num_points: int,
        seed: int = 0,
    ) -> None:
        self.prepared, self.bank, self.rows = prepared, bank, rows
        self.batch_size, self.num_points, self.seed = batch_size, num_points, seed

    def __len__(self) -> int:
        return -(-len(self.rows) // self.batch_size)

    def __getitem__(self, chunk: int) -> Batch:
        if not 0 <= chunk < len(self):
            raise IndexError(chunk)
        rows = self.rows[chunk * self.batch_size : (chunk + 1) * self.batch_size].tolist()
        rng = np.random.default_rng([self.seed, 3, chunk])
        return make_batch(self.prepared, self.bank, rows, [0] * len(rows), self.num_points, rng)


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
        source: where models come from.
        category: its name.
        data_root: where prepared data is kept.
        render: the images.
        num_cloud_points: points sampled per model, once.
        train_fraction: share of the models that are not templates.
        num_templates, template_strategy, template_file, template_seed: see `choose_templates`.
        degrees, max_edge: see `TemplateBank`.
        batch_size, num_points, steps: queries a step, points per cloud and step, steps in all.
        seed: decides what each step sees.
        num_workers: processes that read ahead.
        preparation_workers: processes that prepare data, 0 for one per core.

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
        source: Source,
        category: str,
        data_root: Path,
        render: RenderConfig,
        num_cloud_points: int,
        train_fraction: float,
        num_templates: int,
        template_strategy: TemplateStrategy,
        template_file: str | None = None,
        template_seed: int = 0,
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
        batch_size: int = 32,
        num_points: int = 1024,
        steps: int = 100_000,
        seed: int = 0,
        num_workers: int = 0,
        preparation_workers: int = 0,
    ) -> None:
        super().__init__()
        self.source, self.category, self.data_root, self.render = (
            source,
            category,
            data_root,
            render,
        )
        self.num_cloud_points, self.train_fraction = num_cloud_points, train_fraction
        self.num_templates, self.template_strategy = num_templates, template_strategy
        self.template_file, self.template_seed = template_file, template_seed
        self.degrees, self.max_edge = degrees, max_edge
        self.batch_size, self.num_points, self.steps = batch_size, num_points, steps
        self.seed, self.num_workers = seed, num_workers
        self.preparation_workers = preparation_workers

    def _prepare(self) -> PreparedSet:
        return prepare(
            self.source,
            self.category,
            num_points=self.num_cloud_points,
            render=self.render,
            root=self.data_root,
            workers=self.preparation_workers,
        )

    def prepare_data(self) -> None:
        """Build the prepared set where it is missing (on one process)."""
        self._prepare()

    def setup(self, stage: str | None = None) -> None:
        """Open the prepared set, choose templates and split the rest; once, whatever the stage."""
        if hasattr(self, "prepared"):
            return
        self.prepared = self._prepare()
        ids = choose_templates(
            self.prepared,
            self.num_templates,
            self.template_strategy,
            self.template_file,
            self.template_seed,
        )
        self.bank = TemplateBank(self.prepared, ids, self.degrees, self.max_edge)
        self.split = split_ids(self.prepared.ids, self.train_fraction, exclude=ids)

    def rows(self, ids: Sequence[str]) -> NDArray[np.int64]:
        """Return the prepared set's rows of model ids."""
        return np.asarray([self.prepared.index(i) for i in ids], np.int64)

    def train_dataloader(self) -> DataLoader[Batch]:
        """Steps from the trainer's current one to the last."""
        trainer = self.trainer
        dataset = TrainingSteps(
            self.prepared,
            self.bank,
            self.rows(self.split.train),
            self.batch_size,
            self.num_points,
            self.seed,
            trainer.global_rank if trainer else 0,
            trainer.world_size if trainer else 1,
        )
        start = trainer.global_step if trainer else 0
        return self._loader(dataset, StepSampler(start, self.steps))

    def val_dataloader(self) -> DataLoader[Batch]:
        """The test models: nothing is chosen by them, they only show how training goes."""
        return self.test_dataloader()

    def test_dataloader(self) -> DataLoader[Batch]:
        """The test models with fixed points."""
        return self._loader(self.evaluation_chunks(), None)

    def evaluation_chunks(self) -> EvaluationChunks:
        """Return the test models in chunks, the same at every call."""
        rows = self.rows(self.split.test)
        return EvaluationChunks(self.prepared, self.bank, rows, self.batch_size, self.num_points)

    def _loader(self, dataset: Dataset[Batch], sampler: Sampler[int] | None) -> DataLoader[Batch]:
        cuda = torch.cuda.is_available()
        return DataLoader(
            dataset,
            batch_size=None,
            sampler=sampler,
            num_workers=self.num_workers,
            pin_memory=cuda,
            persistent_workers=False,
        )
