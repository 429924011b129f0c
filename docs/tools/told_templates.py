"""Score a network that is told its templates by how many there are.

    python docs/tools/told_templates.py CHECKPOINT VIEWS PREPARED_SET...

CHECKPOINT is `package` for the network that comes with it; VIEWS are of the images, 1,2 say. Each
shape of a set is reconstructed from 5, 10, 20, 40 and all of its other shapes, drawn at random. Box
Chamfer distances, x 1000, 2,048 points: `selected`, of the selected template, deformed; `best`, of
the best deformed one; `as it is`, of the nearest one undeformed. `step` is the mean difference in
`selected` from the number before, `error` its standard error over the shapes.
"""

from __future__ import annotations

import random
import sys
from pathlib import Path

import pandas as pd
import torch

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import TemplateSample, deform
from ffd_lightning.inference.own_templates import of_prepared
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.nn import consensus
from ffd_lightning.progress import CountProgress

_COUNTS, _POINTS = (5, 10, 20, 40), 2048


def measure(base: Predictor, prepared: PreparedSet, views: list[int]) -> pd.DataFrame:
    """Return a row per shape, view and number of templates."""
    told = base.told(of_prepared(base.model, prepared, prepared.ids))
    bank, network = told.model.bank.lighter(_POINTS), told.model.network
    codes = network.template_codes
    matrix, control_points, degrees = told.model.bank.sample(consensus.POINTS)
    rows = []
    with CountProgress(prepared.category(0), len(prepared), 0, True) as progress:
        for row, shape in enumerate(prepared.ids):
            progress.advance()
            target = torch.from_numpy(prepared.cloud(row, _POINTS))
            others = [k for k in range(len(bank)) if k != row]
            random.Random(row).shuffle(others)
            for count in [c for c in _COUNTS if c < len(others)] + [len(others)]:
                some = others[:count]
                sample = TemplateSample(matrix[some], control_points[some], degrees)
                network.use_templates(codes[some], sample, strangers=True)
                as_it_is = 1000 * chamfer_distance(bank.points[some], target, "mean").min()
                for view in views:
                    image = torch.from_numpy(told.frame(prepared.image(row, view)).image[None])
                    image = image.permute(0, 3, 1, 2)
                    found = network(image[:, :3], mask=image[:, 3])
                    basis, rest = bank.deformation_matrix[some], bank.control_points[some]
                    clouds = deform(basis, rest, found.offsets[0])
                    errors = 1000 * chamfer_distance(clouds, target, "mean")
                    selected = errors[int(found.template_index[0])]
                    scores = map(float, (selected, errors.min(), as_it_is))
                    rows.append((shape, view, count, *scores))
    return pd.DataFrame(rows, columns=["shape", "view", "count", "selected", "best", "as it is"])


def main(checkpoint: str, views: str, folders: list[str]) -> None:
    """See the top of this file."""
    torch.set_grad_enabled(False)
    base = Predictor.load(None if checkpoint == "package" else checkpoint)
    for folder in folders:
        prepared = PreparedSet.open(Path(folder))
        found = measure(base, prepared, [int(view) for view in views.split(",")])
        table = found.groupby("count")[["selected", "best", "as it is"]].mean()
        steps = found.groupby(["shape", "count"])["selected"].mean().unstack().diff(axis=1)
        table["step"], table["error"] = steps.mean(), steps.sem()
        print(f"{prepared.category(0)}, {len(prepared)} shapes\n{table.round(2).to_string()}")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
