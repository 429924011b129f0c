"""Serves images and subsampled clouds, one item a step, so that a run can resume exactly.

What step k sees is a function of (seed, k) alone, not of a random generator's past: a run that is
killed and resumed, or split over devices, sees the same queries and the same points.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch
from lightning import LightningDataModule, Trainer
from numpy.typing import NDArray
from torch.utils.data import DataLoader, Dataset, Sampler

from ffd_lightning.components import check_ranges
from ffd_lightning.data.batches import (
    Batch,
    BatchIndices,
    Residency,
    ShapeStore,
    augmented,
    resident_bytes,
)
from ffd_lightning.data.preparation.preparation import Preparation
from ffd_lightning.data.preparation.prepared import PreparedSet, spread_rows
from ffd_lightning.data.splits import HashSplit, Split, SplitInput, SplitRule, make_split
from ffd_lightning.data.templates.bank import TemplateBank
from ffd_lightning.data.templates.choice import AutoTemplates, TemplateStrategy, choose_templates
from ffd_lightning.data.templates.distances import outlier_rows
from ffd_lightning.data.templates.pool import TemplatePool
from ffd_lightning.data.twins import twins
from ffd_lightning.errors import ConfigError
from ffd_lightning.geometry.ffd import Degrees
from ffd_lightning.imaging.augmentation import Augmentation
from ffd_lightning.imaging.framing import object_fill
from ffd_lightning.imaging.render_settings import RenderSettings
from ffd_lightning.nn import consensus
from ffd_lightning.nn.network import TemplateFfdNetwork

log = logging.getLogger(__name__)

_GPU_WORKERS = 2
_MEASURED = 1024  # images, to tell how large objects are in them


@dataclass(eq=False)
class _Indices(Dataset[BatchIndices]):
    """What batches are drawn from: rows of a prepared set, and `num_points` of each cloud.

    The bank's `templates` are rows, too. A batch has `batch_size` queries over all devices; `seed`
    decides what is random.
    """

    rows: NDArray[np.int64]
    prepared: PreparedSet
    templates: NDArray[np.int64]
    batch_size: int
    num_points: int
    seed: int = 0

    def _points(self, clouds: int, rng: np.random.Generator) -> NDArray[np.int64]:
        """Draw points of each of some clouds without replacement, (clouds, num_points)."""
        size = self.prepared.num_points, self.num_points
        return np.stack([rng.choice(*size, replace=False, shuffle=False) for _ in range(clouds)])


def check_split(batch_size: int, devices: int) -> None:
    """Raise a ConfigError if devices cannot share a batch, two images or more each."""
    if batch_size % devices or batch_size == devices > 1:
        raise ConfigError(
            f"schedule.batch_size={batch_size} cannot be split evenly over {devices} devices, two "
            "images or more each"
        )


class TrainingIndices(_Indices):
    """Item k is what training step k sees: whole passes over the shuffled shapes, end to end.

    With a pool, a step draws its templates, and queries that are other shapes than these.

    Of several devices, each takes every `world_size`-th query of the batch, from its `rank` on.

    Raises:
        ConfigError: a batch that cannot be split evenly.
    """

    def __init__(
        self, *args: Any, rank: int = 0, world_size: int = 1, pool: TemplatePool | None = None
    ) -> None:
        super().__init__(*args)
        self.pool = pool
        whose = [self.prepared.category(row) for row in range(len(self.prepared))]
        self._categories = np.unique(whose, return_inverse=True)[1]
        check_split(self.batch_size, world_size)
        self.rank, self.world_size = rank, world_size

    def __getitem__(self, step: int) -> BatchIndices:
        rng = np.random.default_rng([self.seed, 2, step])
        pictures = self.prepared.image_shape[0]
        views = rng.integers(pictures, size=self.batch_size)
        # Points are drawn for all queries, so that a share of a batch is the same wherever it is.
        points = self._points(self.batch_size, rng)
        more: dict[str, Any] = {}
        if self.pool is None:
            templates, rows = self.templates, self._in_passes(step)
        else:
            of_pool = np.random.default_rng([self.seed, 6, step])
            templates, rows = self.pool.draw(self.batch_size, of_pool)
            drawn = of_pool.integers(pictures, size=len(templates))
            more = {"template_rows": _tensor(templates), "template_views": _tensor(drawn)}
        template_points = self._points(len(templates), rng)
        mine = slice(self.rank, None, self.world_size)
        rows, views = rows[mine], views[mine]
        if len(self.prepared.categories) > 1:  # which give equally many
            same = self._categories[rows][:, None] == self._categories[templates]
            more["own_templates"] = _tensor(same.nonzero()[1].reshape(len(rows), -1))
        pairs = zip(rows.tolist(), views.tolist(), strict=True)
        seen = [self.prepared.camera(row, view) for row, view in pairs]
        own = np.random.SeedSequence([self.seed, 5, step, 0]).generate_state(1)
        return BatchIndices(
            *(_tensor(rows), _tensor(views), _tensor(points[mine]), _tensor(template_points)),
            seed=int(own[0]),
            cameras=torch.tensor([(camera.azimuth, camera.elevation) for camera in seen]),
            **more,
        )

    def _in_passes(self, step: int) -> NDArray[np.int64]:
        places, count = step * self.batch_size + np.arange(self.batch_size), len(self.rows)
        passes = range(places[0] // count, places[-1] // count + 1)
        orders = [np.random.default_rng([self.seed, 1, k]).permutation(self.rows) for k in passes]
        return np.concatenate(orders)[places - passes[0] * count]


class EvaluationIndices(_Indices):
    """Item k is the k-th chunk of the shapes to score: first view, points fixed by `seed`.

    What is drawn of a shape does not depend on the others, so any share of them, or any size of
    chunks, gives the same scores.
    """

    def __len__(self) -> int:
        return -(-len(self.rows) // self.batch_size)

    def __getitem__(self, chunk: int) -> BatchIndices:
        rows = self.rows[chunk * self.batch_size : (chunk + 1) * self.batch_size]
        points = [self._points(1, np.random.default_rng([self.seed, 3, k]))[0] for k in rows]
        of_queries = _tensor(rows), _tensor(np.zeros(len(rows))), _tensor(points)
        drawn = self._points(len(self.templates), np.random.default_rng([self.seed, 4, 0]))
        return BatchIndices(*of_queries, _tensor(drawn))


def _tensor(values: Any) -> torch.Tensor:
    return torch.from_numpy(np.asarray(values, np.int64))


class StepSampler(Sampler[int]):
    """Numbers of the batches of an epoch that are not done yet: batch k is the training's k-th.

    Its length stays that of the whole epoch, as Lightning counts from the epoch's first batch.
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
    """A `DataLoader` of whole batches whose iterators are made when the first is asked for.

    Lightning makes them earlier, before it has read from a checkpoint how many batches are done.
    Nor does it put a sampler of its own into this, where each device loads its own share already.
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
        preparations: of a category, or of several that one network is trained on together.
        num_templates: T, equally many of each category.
        template_strategy: how templates are chosen; `AutoTemplates` by default.
        hold_out: keep as many of the first templates out of all subsets, also where fewer are
            used: networks of different T then see the same shapes. Of each category equally many.
        split: assigns shapes to subsets; by the hash of their id by default.
        val_fraction: share of the training shapes to validate on, where the split names none.
        drop_outliers: leave what is like nothing else in its category, see
            `templates.distances.ShapeDistances.outliers`, out of all subsets and of the choice of
            templates.
        degrees: of the lattices, see `TemplateBank`.
        max_edge: of the templates' meshes, see `TemplateBank`.
        batch_size: queries a step, over all devices.
        num_points: points per cloud and step.
        draw: templates that a step draws from all shapes that are trained on, and from the
            templates, for conditioned heads; None where every step sees the templates.
        seed: decides what each step sees.
        augmentation: changes the images that are trained on, and no others.
        residency: where images and clouds are kept while training, see `Residency`.
        num_workers: processes that read ahead; None for none on the CPU and some beside a GPU.

    Raises:
        ConfigError: no category, or one twice; templates that categories cannot give equally many
            of; fewer held out than used.

    Attributes:
        prepared: the prepared set, after `setup`.
        bank: the templates, after `setup`.
        split: ids of each subset, after `setup`.
        variants: ids of the variants that are trained on beside the training shapes, after `setup`:
            of all shapes that the split gives to training, also of those that become templates.
        seen_twins: ids of the shapes that are not trained on, but have a near copy that is, or that
            is held out as a template, after `setup`; see `data.twins`.
    """

    prepared: PreparedSet
    bank: TemplateBank
    split: Split
    variants: tuple[str, ...]
    seen_twins: frozenset[str]

    def __init__(
        self,
        preparations: Preparation | Sequence[Preparation],
        *,
        num_templates: int = 16,
        template_strategy: TemplateStrategy | None = None,
        hold_out: int | None = None,
        split: SplitRule | None = None,
        val_fraction: float = 0.1,
        drop_outliers: bool = False,
        degrees: Degrees = (3, 3, 3),
        max_edge: float = 0.02,
        batch_size: int = 32,
        num_points: int = 1024,
        draw: int | None = None,
        seed: int = 0,
        augmentation: Augmentation | None = None,
        residency: Residency = "auto",
        num_workers: int | None = None,
    ) -> None:
        super().__init__()
        above = "(0, inf)"
        check_ranges(locals(), num_templates=above, batch_size=above, val_fraction="[0, 1)")
        if isinstance(preparations, Preparation):
            preparations = (preparations,)
        self.preparations = tuple(preparations)
        names = self.categories
        if not names or len(set(names)) < len(names):
            raise ConfigError(f"categories={list(names)} must name one or more, and none twice")
        kept = self.preparations[0].num_points
        if num_points > kept:
            raise ConfigError(
                f"schedule.num_points={num_points} is more than data.num_points={kept}, the points "
                "kept of each shape"
            )
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
        self.num_templates, self.hold_out = num_templates, hold_out
        self.template_strategy = template_strategy or AutoTemplates()
        self.split_rule, self.val_fraction = split or HashSplit(), val_fraction
        self.drop_outliers, self.degrees, self.max_edge = drop_outliers, degrees, max_edge
        self.batch_size, self.num_points, self.seed = batch_size, num_points, seed
        self.draw = draw
        self.augmentation = augmentation
        self.residency, self.num_workers = residency, num_workers
        self._stored: tuple[torch.device, ShapeStore] | None = None

    @property
    def categories(self) -> tuple[str, ...]:
        """Names of the categories."""
        return tuple(preparation.category for preparation in self.preparations)

    @property
    def root(self) -> Path:
        """Folder that prepared data is kept below."""
        return Path(self.preparations[0].root)

    @property
    def render(self) -> RenderSettings:
        """The images."""
        return self.preparations[0].render

    def prepare_data(self) -> None:
        """Build the prepared sets where they are missing (on one process)."""
        for preparation in self.preparations:
            preparation.run()

    def setup(self, stage: str | None = None) -> None:
        """Open the prepared sets, split them and choose templates; once, whatever the stage."""
        if hasattr(self, "prepared"):
            return
        found = zip(*map(self._member, self.preparations), strict=True)
        sets, templates, splits, variants, seen = found
        self.prepared = PreparedSet.open(*(each.path for each in sets))
        self.variants, self.seen_twins = self._ids(variants), frozenset(self._ids(seen))
        self.split = Split(*(self._ids(subsets) for subsets in zip(*splits, strict=True)))
        chosen = self._ids(templates)
        self.bank = TemplateBank.of(self.prepared, chosen, self.degrees, self.max_edge)

    def _member(
        self, preparation: Preparation
    ) -> tuple[PreparedSet, tuple[str, ...], Split, list[str], list[str]]:
        """Open a category's set, split it, and choose templates from what is not tested on.

        Returns also the variants to train on, and the shapes that have a near copy in training.
        """
        prepared, category = preparation.run(), preparation.category
        shapes, origins = prepared.originals, prepared.origins
        shares = len(self.preparations)
        most = (self.hold_out or self.num_templates) // shares
        published = preparation.source.split(category)
        rejected = tuple(i for i in prepared.rejected if i not in origins)
        alike = twins(shapes)
        given = SplitInput(category, shapes.ids, rejected, published, alike)
        dropped = {row["id"] for row in outlier_rows(prepared)} if self.drop_outliers else ()
        kept = [shape_id for shape_id in shapes.ids if shape_id not in dropped]
        split = make_split(kept, self.split_rule(given), self.val_fraction, alike)
        tested = {*split.test, *dropped}
        templates = choose_templates(self.template_strategy, shapes, most, tested)
        trained = set(split.train)
        variants = [i for i in prepared.ids if origins.get(i) in trained]
        split = split.without(templates)
        known = {alike.get(i) for i in (*split.train, *templates)}
        seen = [i for i in (*split.val, *split.test) if i in alike and alike[i] in known]
        return prepared, templates[: self.num_templates // shares], split, variants, seen

    def _ids(self, ids: Sequence[Sequence[str]]) -> tuple[str, ...]:
        """Return ids of each category as the joined set names them."""
        if len(ids) == 1:
            return tuple(ids[0])
        pairs = zip(self.categories, ids, strict=True)
        return tuple(f"{name}/{shape_id}" for name, own in pairs for shape_id in own)

    @property
    def sources(self) -> dict[str, Any]:
        """The fingerprint of each category's source."""
        return {p.category: p.settings["source"] for p in self.preparations}

    def record(self) -> dict[str, Any]:
        """Return what there is to say of the data afterwards: plain values, after `setup`.

        `prepared` is the name of each category's set, `templates` are ids, `shapes` how many are in
        each subset, `variants` apart.
        """
        return {
            "sources": self.sources,
            "prepared": {p.category: p.target.name for p in self.preparations},
            "templates": list(self.bank.ids),
            "shapes": {
                **{name: len(ids) for name, ids in self.split._asdict().items()},
                **({"variants": len(self.variants)} if self.variants else {}),
            },
        }

    @cached_property
    def pool(self) -> TemplatePool | None:
        """What training steps draw templates from; None where they see the bank's."""
        if self.draw is None:
            return None
        return TemplatePool(self.prepared, self.trained_on, self.draw, self.bank.ids)

    @property
    def trained_on(self) -> tuple[str, ...]:
        """The shapes and variants that training steps show, after `setup`.

        Where each step draws templates, those of the bank are shapes like others.
        """
        templates = () if self.draw is None else self.bank.ids
        return (*self.split.train, *templates, *self.variants)

    def give_templates(self, network: TemplateFfdNetwork) -> None:
        """Tell conditioned heads the bank's templates; other heads know theirs."""
        if network.heads.conditioned:
            pictures = map(self.prepared.images, self.rows(self.bank.ids).tolist())
            codes = network.codes(self.bank.points, pictures)
            network.use_templates(codes, self.bank.sample(consensus.POINTS))
            camera = self.render.only_camera
            if camera is not None and not any(p.source.own_images for p in self.preparations):
                network.projection = camera.projection

    def rows(self, ids: Sequence[str]) -> NDArray[np.int64]:
        """Return the prepared set's rows of shapes."""
        return np.asarray([self.prepared.index(i) for i in ids], np.int64)

    @cached_property
    def object_fill(self) -> float:
        """How large objects are in training images, see `object_fill` of `imaging.framing`."""
        rows, views = self.rows(self.split.train), self.prepared.image_shape[0]
        some = rows[spread_rows(len(rows), _MEASURED)].tolist()
        # Views take turns.
        return object_fill(self.prepared.image(row, k % views) for k, row in enumerate(some))

    @property
    def store(self) -> ShapeStore:
        """Where batches come from: what `residency` says, for the present trainer's device."""
        device = self.trainer.strategy.root_device if self.trainer else torch.device("cpu")
        if self._stored is None or self._stored[0] != device:
            self._stored = None  # what another device held is not needed any more
            mask = self.augmentation is not None
            size = resident_bytes(self.prepared, self.bank, mask)
            kept = self.residency == "device"
            if self.residency == "auto" and device.type == "cuda":
                # Not on the CPU: the system keeps what is read of files in memory, once for all
                # runs of a machine, and unpacking images is little beside a step there.
                kept = size <= torch.cuda.mem_get_info(device)[0] / 2
            if kept:
                log.info("reading %.1f GB of images and clouds (%s)", size / 1e9, device)
            boxes = None if self.pool is None else self.pool.boxes
            store = ShapeStore(self.prepared, self.bank, device if kept else None, mask, boxes)
            self._stored = device, store
        return self._stored[1]

    def train_dataloader(self) -> Batches:
        """Batches of training shapes and variants, from the trainer's current one on."""
        rank, world_size = self._share
        own = self.rows(self.bank.ids)
        given = (self.prepared, own, self.batch_size, self.num_points, self.seed)
        rows = self.rows(self.trained_on)
        indices = TrainingIndices(rows, *given, rank=rank, world_size=world_size, pool=self.pool)
        trainer, length = self.trainer, -(-len(rows) // self.batch_size)
        if trainer is not None and trainer.max_steps > 0 and trainer.max_epochs in (None, -1):
            length = trainer.max_steps * trainer.accumulate_grad_batches
        return self._loader(indices, StepSampler(length, trainer))

    def val_dataloader(self) -> Batches | list[Any]:
        """The validation shapes with fixed points; nothing where there are none."""
        return self._scored(self.split.val) if self.split.val else []

    def test_dataloader(self) -> Batches:
        """The test shapes with fixed points, in their order."""
        return self._scored(self.split.test)

    predict_dataloader = test_dataloader

    def on_after_batch_transfer(self, batch: BatchIndices | Batch, dataloader_idx: int) -> Batch:
        """Gather a batch where the loader has not, and change the images of a training step."""
        gathered = self.store.batch(batch) if isinstance(batch, BatchIndices) else batch
        if self.augmentation is None:
            return gathered
        return augmented(gathered, self.augmentation, *self._share)

    @property
    def _share(self) -> tuple[int, int]:
        """Which device this is, of how many."""
        return (self.trainer.global_rank, self.trainer.world_size) if self.trainer else (0, 1)

    def _scored(self, ids: Sequence[str]) -> Batches:
        """Return this device's share of some shapes, in chunks."""
        rank, world_size = self._share
        given = (self.prepared, self.rows(self.bank.ids), self.batch_size, self.num_points)
        return self._loader(EvaluationIndices(self.rows(ids)[rank::world_size], *given))

    def _loader(self, indices: _Indices, sampler: Sampler[int] | None = None) -> Batches:
        on_gpu = self.trainer is not None and self.trainer.strategy.root_device.type == "cuda"
        # Processes of the loader reach what is in files, and not what is on a GPU.
        gather: Any = self.store.batch if self.store.device.type == "cpu" else None
        # Beside a GPU other processes draw ahead; on the CPU they would take its cores.
        usual = _GPU_WORKERS if on_gpu else 0
        loader = DataLoader(
            indices,
            batch_size=None,
            sampler=sampler,
            num_workers=usual if self.num_workers is None else self.num_workers,
            collate_fn=gather,
            pin_memory=on_gpu,
        )
        return Batches(loader)
