"""Score a network that is told its templates by how many there are.

    python docs/tools/told_templates.py CHECKPOINT VIEWS PREPARED_SET...

CHECKPOINT is `package` for the network that comes with it; VIEWS are of the images, 1,2 say. Each
shape of a set is reconstructed from 5, 10, 20, 40 and all of its other shapes, drawn at random, in
place of the network's own templates and beside them (its category being named), and from the
network's own alone (0). Box Chamfer distances, x 1000, 2,048 points: `selected`, of the selected
template, deformed; `best`, of the best deformed one; `as it is`, of the nearest one undeformed.
`step` is the mean difference in `selected` from the number before, `gain` that of `beside` from
the same number in place, each with its standard error over the shapes.
"""

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
_COLUMNS = ["shape", "view", "beside", "count", "selected", "best", "as it is"]


def measure(base: Predictor, prepared: PreparedSet, views: list[int]) -> pd.DataFrame:
    """Return a row per shape, view and set of templates."""
    told = base.told(of_prepared(base.model, prepared, prepared.ids), beside=True)
    bank, network = told.model.bank.lighter(_POINTS), told.model.network
    codes, own = network.template_codes, list(range(len(bank) - len(prepared)))
    of_category = set(base.model.templates_of(prepared.category(0)))
    matrix, control_points, degrees = told.model.bank.sample(consensus.POINTS)
    rows = []
    with CountProgress(prepared.category(0), len(prepared), 0, True) as progress:
        for row, shape in enumerate(prepared.ids):
            progress.advance()
            target = torch.from_numpy(prepared.cloud(row, _POINTS))
            others = [len(own) + k for k in range(len(prepared)) if k != row]
            random.Random(row).shuffle(others)
            counts = [c for c in _COUNTS if c < len(others)] + [len(others)]
            for beside, count in [(False, c) for c in counts] + [(True, c) for c in (0, *counts)]:
                some = (own if beside else []) + others[:count]
                asked = [k for k, t in enumerate(some) if t >= len(own) or t in of_category]
                sample = TemplateSample(matrix[some], control_points[some], degrees)
                network.use_templates(codes[some], sample, strangers=not beside)
                some = [some[k] for k in asked]
                as_it_is = 1000 * chamfer_distance(bank.points[some], target, "mean").min()
                for view in views:
                    image = torch.from_numpy(told.frame(prepared.image(row, view)).image[None])
                    image = image.permute(0, 3, 1, 2)
                    found = network(image[:, :3], mask=image[:, 3])
                    basis, rest = bank.deformation_matrix[some], bank.control_points[some]
                    clouds = deform(basis, rest, found.offsets[0, asked])
                    errors = 1000 * chamfer_distance(clouds, target, "mean")
                    selected = errors[int(found.template_weights[0, asked].argmax())]
                    scores = map(float, (selected, errors.min(), as_it_is))
                    rows.append((shape, view, beside, count, *scores))
    return pd.DataFrame(rows, columns=_COLUMNS)


def main(checkpoint: str, views: str, folders: list[str]) -> None:
    """See the top of this file."""
    torch.set_grad_enabled(False)
    base = Predictor.load(None if checkpoint == "package" else checkpoint)
    for folder in folders:
        prepared = PreparedSet.open(Path(folder))
        found = measure(base, prepared, [int(view) for view in views.split(",")])
        table = found.groupby(["beside", "count"])[_COLUMNS[4:]].mean()
        means = found.groupby(["shape", "beside", "count"])["selected"].mean().unstack([1, 2])
        for column, values in (
            ("step", pd.concat({b: means[b].diff(axis=1) for b in (False, True)}, axis=1)),
            ("gain", pd.concat({True: means[True] - means[False]}, axis=1)),
        ):
            table[column], table[f"error of {column}"] = values.mean(), values.sem()
        print(f"{prepared.category(0)}, {len(prepared)} shapes\n{table.round(2).to_string()}")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(sys.argv[1], sys.argv[2], sys.argv[3:])
