"""Measure what a network makes of prepared shapes, by category: the tables of its model card.

    python docs/tools/model_card.py CHECKPOINT VIEWS PREPARED_SET...

Of each shape the last VIEWS images, those of random cameras, are cut out and framed as photographs
are. `right` is the share of images whose selected template is of the right category, in %. Box
Chamfer distances, x 1000, are of the right category's templates and 2,048 points: `selected`,
deformed; `best`, that of the best deformed template; `as it is`, that of the nearest template
undeformed. `azimuth` is the median error of the viewpoint in degrees, `turned` the share of errors
over 90 degrees, in %.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd
import torch

from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.geometry.chamfer import chamfer_distance
from ffd_lightning.geometry.ffd import deform
from ffd_lightning.inference.predictor import Predictor
from ffd_lightning.progress import CountProgress

_POINTS = 2048


def measure(predictor: Predictor, prepared: PreparedSet, views: int) -> pd.DataFrame:
    """Return a row per image."""
    bank, model = predictor.model.bank.lighter(_POINTS), predictor.model
    category = prepared.category(0)
    names = [name.removeprefix(f"{category}/") for name in bank.ids]
    own, rows = model.templates_of(category), []
    with CountProgress(category, len(prepared), 0, True) as progress:
        for row in range(len(prepared)):
            progress.advance()
            target = torch.from_numpy(prepared.cloud(row, _POINTS))
            other = [k for k in own if names[k] != prepared.ids[row]]
            as_it_is = 1000 * chamfer_distance(bank.points[other], target, "mean").min()
            for view in range(prepared.image_shape[0])[-views:]:
                photo = predictor.frame(prepared.image(row, view))
                (found,) = predictor.predict_framed([photo])
                right = found.category == category
                found = found.of_category(category)
                offsets = torch.from_numpy(found.offsets[other])
                clouds = deform(bank.deformation_matrix[other], bank.control_points[other], offsets)
                errors = 1000 * chamfer_distance(clouds, target, "mean")
                selected = next(k for k in found.ranking if k in other)
                turned = np.nan
                if found.viewpoint is not None:
                    turned = found.viewpoint.azimuth - prepared.camera(row, view).azimuth
                rows.append(
                    {
                        "category": category,
                        "shape": prepared.ids[row],
                        "view": view,
                        "right": 100.0 * right,
                        "selected": float(errors[other.index(selected)]),
                        "best": float(errors.min()),
                        "as it is": float(as_it_is),
                        "azimuth": abs((turned + 180) % 360 - 180),
                    }
                )
    return pd.DataFrame(rows)


def summary(images: pd.DataFrame) -> pd.DataFrame:
    """Return a row per category, and their mean."""
    groups = images.groupby("category")
    table = groups[["right", "selected", "best", "as it is"]].mean()
    table["regret"] = 100 * (table["selected"] / table["best"] - 1)
    table["azimuth"] = groups["azimuth"].median()
    table["turned"] = groups["azimuth"].apply(lambda errors: 100 * (errors.dropna() > 90).mean())
    table.insert(0, "images", groups.size())
    table.loc["mean"] = table.mean()
    table.loc["mean", "images"] = table["images"][:-1].sum()
    return table


def main(checkpoint: Path, views: int, folders: list[Path]) -> None:
    """See the top of this file."""
    torch.set_grad_enabled(False)
    predictor = Predictor.load(None if str(checkpoint) == "package" else checkpoint)
    known = predictor.model.categories
    sets = [PreparedSet.open(folder) for folder in folders]
    found = [measure(predictor, one, views) for one in sets if one.category(0) in known]
    print(summary(pd.concat(found)).round(2).to_string())


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), int(sys.argv[2]), [Path(folder) for folder in sys.argv[3:]])
