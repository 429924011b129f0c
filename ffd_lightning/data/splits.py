"""Which models are trained on and which are tested on."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Iterable
from typing import NamedTuple

from ffd_lightning.errors import DataError


class Split(NamedTuple):
    """Sorted ids of the two parts."""

    train: tuple[str, ...]
    test: tuple[str, ...]


def split_ids(ids: Iterable[str], train_fraction: float, exclude: Collection[str] = ()) -> Split:
    """Assign each id to a part by its hash alone, so that added models never move others.

    Args:
        ids: model ids.
        train_fraction: share of the training part, met in expectation.
        exclude: ids in neither part (the templates).

    Raises:
        DataError: one of the parts is empty.
    """
    left = sorted(set(ids) - set(exclude))
    train = tuple(i for i in left if _position(i) < train_fraction)
    test = tuple(i for i in left if _position(i) >= train_fraction)
    if not train or not test:
        raise DataError(
            f"{len(left)} models besides {len(exclude)} templates leave {len(train)} to train on "
            f"and {len(test)} to test on: add models, take fewer templates (templates=t1 ... t30) "
            f"or change data.train_fraction={train_fraction}"
        )
    return Split(train, test)


def _position(model_id: str) -> float:
    """Return a fixed number in [0, 1) for an id."""
    return int(hashlib.sha256(model_id.encode()).hexdigest()[:13], 16) / 16**13
