"""Train an encoder that no regime has favoured, as a Keras file for encoder.weights=FILE.

    python docs/tools/neutral_encoder.py OUT.weights.h5 PREPARED_SET...

No template takes part. A linear layer on the mean feature learns an image's category and in which
cells of a grid over the bounding box its shape has points. Images are those of training shapes,
under the default split; what serves the validation shapes best is kept.
"""

import copy
import os
import sys
from pathlib import Path

os.environ.setdefault("KERAS_BACKEND", "torch")  # it would ask for TensorFlow

import keras
import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.data.splits import HashSplit, SplitInput, make_split
from ffd_lightning.data.twins import twins
from ffd_lightning.nn.encoders.mobilenet import MobileNetV1
from ffd_lightning.nn.network import standardize

_GRID, _POINTS, _SHRINK, _VAL_FRACTION = 8, 2048, 2, 0.1
_EPOCHS, _BATCH, _RATE = 40, 32, 3e-3


def main(out: Path, folders: list[Path]) -> None:
    """See the top of this file."""
    torch.manual_seed(0)
    sets = [gather(PreparedSet.open(folder).originals, k) for k, folder in enumerate(folders)]
    parts = zip(*sets, strict=True)
    train, val = (tuple(map(torch.cat, zip(*part, strict=True))) for part in parts)
    encoder = MobileNetV1()
    head = nn.Linear(encoder.out_channels, len(folders) + _GRID**3)
    layers = nn.ModuleList([encoder, head])

    def loss(images: Tensor, categories: Tensor, cells: Tensor) -> tuple[Tensor, Tensor]:
        found = head(encoder(standardize(images)).mean((2, 3)))
        kind, filled = found[:, : len(folders)], found[:, len(folders) :]
        of_cells = functional.binary_cross_entropy_with_logits(filled, cells)
        return functional.cross_entropy(kind, categories), of_cells

    optimizer = torch.optim.AdamW(layers.parameters(), _RATE)
    steps = _EPOCHS * (len(train[0]) // _BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, _RATE, steps)
    least, best = np.inf, {}
    for epoch in range(_EPOCHS):
        layers.train()
        for part in torch.randperm(len(train[0])).split(_BATCH)[: len(train[0]) // _BATCH]:
            optimizer.zero_grad()
            kind, filled = loss(*(each[part] for each in train))
            (kind + 10 * filled).backward()
            optimizer.step()
            schedule.step()
        layers.eval()
        with torch.no_grad():
            kind, filled = map(float, loss(*val))
        print(f"epoch {epoch + 1}: validation: category {kind:.3f}, cells {filled:.4f}", flush=True)
        if kind + 10 * filled < least:
            least, best = kind + 10 * filled, copy.deepcopy(encoder.state_dict())
    encoder.load_state_dict(best)
    write_keras(encoder, out)


def gather(prepared: PreparedSet, label: int) -> tuple[tuple[Tensor, ...], tuple[Tensor, ...]]:
    """Return images, categories and filled cells of a set's training and validation shapes."""
    alike = twins(prepared)
    rule = HashSplit()(SplitInput(prepared.category(0), prepared.ids, (), {}, alike))
    split = make_split(prepared.ids, rule, _VAL_FRACTION, alike)

    def of(ids: tuple[str, ...]) -> tuple[Tensor, ...]:
        rows = [prepared.index(i) for i in ids]
        images = torch.from_numpy(np.stack([prepared.image(row, 0) for row in rows]))
        small = functional.avg_pool2d(images.permute(0, 3, 1, 2)[:, :3].float(), _SHRINK)
        cells = torch.zeros(len(rows), _GRID**3)
        for row, filled in zip(rows, cells, strict=True):
            cloud = prepared.cloud(row, _POINTS)
            where = (cloud - cloud.min(0)) / np.ptp(cloud, 0).clip(1e-6)
            index = np.minimum((_GRID * where).astype(int), _GRID - 1)
            filled[np.ravel_multi_index(tuple(index.T), (_GRID,) * 3)] = 1
        return small.byte(), torch.full((len(rows),), label), cells

    return of(split.train), of(split.val)


def write_keras(encoder: MobileNetV1, out: Path) -> None:
    """Write an encoder's weights as Keras writes those of its MobileNet without a top."""
    model = keras.applications.MobileNet(
        input_shape=(64, 64, 3), alpha=encoder.width, include_top=False, weights=None
    )
    for name, module in encoder.layers.named_children():
        if isinstance(module, nn.Conv2d):
            order = (2, 3, 0, 1) if module.groups > 1 else (2, 3, 1, 0)
            model.get_layer(name).set_weights([module.weight.detach().permute(order).numpy()])
        elif isinstance(module, nn.BatchNorm2d):
            kept = (module.weight, module.bias, module.running_mean, module.running_var)
            model.get_layer(name).set_weights([each.detach().numpy() for each in kept])
    model.save_weights(out)


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), [Path(folder) for folder in sys.argv[2:]])
