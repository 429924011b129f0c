"""Teach a trained network of heads=conditioned to select among all of its templates at once.

    python docs/tools/fit_selection.py CHECKPOINT OUT PREPARED_SET...

A training step sees a few templates of a few categories, so the network is slow to learn to tell
all of them apart. Here it stays as it is but for the two layers that select, `query` and `key`:
they learn from images' features and templates' codes that are computed once. Each image has the
posterior of what 30 templates of its category, deformed, cost (the Chamfer distance, as in the
regime `posterior`), and none of the other categories' templates. Half of the templates are the
network's own, half any training shapes, so that it does not learn to select among its own alone.
What serves the validation shapes best is kept. OUT is a checkpoint.
"""

import copy
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import log_softmax

from ffd_lightning.checkpoint import TrainedModel, load_model, read_checkpoint
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.splits import HashSplit, SplitInput, make_split
from ffd_lightning.data.twins import twins
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform, mirrored_offsets
from ffd_lightning.imaging.augmentation import PhotoAugmentation
from ffd_lightning.inference.own_templates import of_prepared
from ffd_lightning.progress import CountProgress

VIEWS, CANDIDATES, POINTS = 4, 30, 512
_TEMPERATURE, _VAL_FRACTION = 0.5, 0.1  # as in training
_TOGETHER = 8  # images whose templates are deformed at once
_EPOCHS, _BATCH, _RATE = 12, 256, 1e-3


class Images(NamedTuple):
    """Images of one category, and what templates of it cost.

    Attributes:
        hidden: features, (q, hidden).
        candidates: which templates, of the category's, (q, CANDIDATES).
        costs: of these, (q, CANDIDATES); infinite for the image's own shape.
    """

    hidden: Tensor
    candidates: Tensor
    costs: Tensor


def main(checkpoint: Path, out: Path, folders: list[Path]) -> None:
    """See the top of this file."""
    torch.manual_seed(0)
    model = load_model(checkpoint)
    found = [gather(model, PreparedSet.open(folder).originals) for folder in folders]
    heads = fit(model, *map(list, zip(*found, strict=True)))
    content = read_checkpoint(checkpoint)
    for name, value in heads.items():
        content["state_dict"][f"network.heads.{name}"] = value
    torch.save(content, out)


@torch.no_grad()
def gather(model: TrainedModel, prepared: PreparedSet) -> tuple[Tensor, Images, Images, int]:
    """Return a category's codes, its training and validation images, and its own templates."""
    category, rng = prepared.category(0), np.random.default_rng(0)
    names = [i.removeprefix(f"{category}/") for i in model.bank.ids]
    own = [i for i, whole in zip(names, model.bank.ids, strict=True) if i != whole]
    alike = twins(prepared)
    rule = HashSplit()(SplitInput(category, prepared.ids, (), {}, alike))
    split = make_split(prepared.ids, rule, _VAL_FRACTION, alike).without(own)
    ids = [*own, *split.train]
    told = of_prepared(model, prepared, ids)
    codes = model.network.codes(told.bank.points, told.pictures)
    bank = told.bank.lighter(POINTS)
    augmentation = PhotoAugmentation()

    def images(shapes: tuple[str, ...], views: int, others: int, varied: bool) -> Images:
        found: list[Images] = []
        queries = [(i, v) for i in shapes for v in rng.permutation(prepared.image_shape[0])[:views]]
        with CountProgress(category, len(queries), 0, True) as progress:
            for start in range(0, len(queries), _TOGETHER):
                part = queries[start : start + _TOGETHER]
                rows = [prepared.index(i) for i, _ in part]
                seen = np.stack(
                    [prepared.image(r, v) for r, (_, v) in zip(rows, part, strict=True)]
                )
                pixels = torch.from_numpy(seen).permute(0, 3, 1, 2)
                pixels = (augmentation(pixels) if varied else pixels)[:, :3]
                hidden = model.network.heads.hidden(model.network.features(pixels))
                first = rng.permutation(len(own))[: CANDIDATES - others]
                drawn = np.append(first, rng.integers(len(own), len(ids), others))
                _, offsets = model.network.heads(hidden, codes[drawn])
                if (degrees := model.network.mirror_degrees) is not None:
                    offsets = (offsets + mirrored_offsets(offsets, degrees)) / 2
                clouds = deform(bank.deformation_matrix[drawn], bank.control_points[drawn], offsets)
                targets = torch.from_numpy(np.stack([prepared.cloud(r, POINTS) for r in rows]))
                costs = 1000 * chamfer_distance(clouds, targets[:, None], "mean")
                same = torch.tensor([[ids[k] == i for k in drawn] for i, _ in part])
                costs = costs.masked_fill(same, torch.inf)
                candidates = torch.from_numpy(drawn).expand(len(part), -1)
                found.append(Images(hidden, candidates, costs))
                for _ in part:
                    progress.advance()
        return Images(*map(torch.cat, zip(*found, strict=True)))

    train = images((*own, *split.train), VIEWS, CANDIDATES // 2, varied=True)
    return codes, train, images(split.val, 2, 0, varied=False), len(own)


def fit(
    model: TrainedModel,
    codes: list[Tensor],
    train: list[Images],
    val: list[Images],
    own: list[int],
) -> dict[str, Tensor]:
    """Return the weights of `query` and `key` that serve the validation images best."""
    query, key = (copy.deepcopy(getattr(model.network.heads, n)) for n in ("query", "key"))
    layers = torch.nn.ModuleDict({"query": query, "key": key})
    of = torch.repeat_interleave(torch.arange(len(codes)), torch.tensor([len(c) for c in codes]))
    starts = torch.tensor([0, *(len(c) for c in codes)]).cumsum(0)[:-1]
    told = torch.cat(codes)
    banked = torch.cat([torch.arange(len(c)) < n for c, n in zip(codes, own, strict=True)])

    def joined(parts: list[Images]) -> tuple[Tensor, ...]:
        whose = torch.cat([torch.full((len(p.hidden),), k) for k, p in enumerate(parts)])
        hidden, candidates, costs = map(torch.cat, zip(*parts, strict=True))
        return whose, hidden, candidates + starts[whose, None], costs

    def logits(whose: Tensor, hidden: Tensor, candidates: Tensor) -> Tensor:
        """Return those of what can be selected: candidates, and all of other categories."""
        found = query(hidden) @ key(told).T / key.out_features**0.5
        barred = (of == whose[:, None]).scatter(1, candidates, torch.zeros_like(candidates) > 0)
        return found.masked_fill(barred, -torch.inf)

    def loss(whose: Tensor, hidden: Tensor, candidates: Tensor, costs: Tensor) -> Tensor:
        posterior = (-costs / _TEMPERATURE).softmax(1)
        chosen = log_softmax(logits(whose, hidden, candidates), 1).gather(1, candidates)
        return -(posterior * chosen).sum(1).mean()

    def quality() -> tuple[float, str]:
        whose, hidden, candidates, costs = joined(val)
        with torch.no_grad():
            found = logits(whose, hidden, candidates).masked_fill(~banked, -torch.inf)
            right = 100 * (of[found.argmax(1)] == whose).float().mean()
            chosen = costs.gather(1, found.gather(1, candidates).argmax(1, keepdim=True))
            selected, best = chosen.mean(), costs.min(1).values.mean()
            value = float(loss(whose, hidden, candidates, costs))
        said = f"loss {value:.3f}, right category {right:.1f}%, selected {selected:.2f}"
        return value, f"{said}, best {best:.2f}"

    given = joined(train)
    optimizer = torch.optim.AdamW(layers.parameters(), _RATE)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, _EPOCHS)
    least, said = quality()
    print(f"as it was: {said}", flush=True)
    best = copy.deepcopy(layers.state_dict())
    for epoch in range(_EPOCHS):
        for part in torch.randperm(len(given[0])).split(_BATCH):
            optimizer.zero_grad()
            loss(*(each[part] for each in given)).backward()
            optimizer.step()
        schedule.step()
        value, said = quality()
        print(f"epoch {epoch + 1}: {said}", flush=True)
        if value < least:
            least, best = value, copy.deepcopy(layers.state_dict())
    return best


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), Path(sys.argv[2]), [Path(folder) for folder in sys.argv[3:]])
