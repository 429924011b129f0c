"""Which shapes are trained on, validated on and tested on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from omegaconf import MISSING

from ffd_lightning.app.parts.lazy import class_part
from ffd_lightning.data.splits import HashSplit
from ffd_lightning.errors import ConfigError


@dataclass
class Hash:
    """By the hash of the id: shapes never change sides when others are added.

    Attributes:
        train_fraction: share that is trained on.
    """

    train_fraction: float = 0.8

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        HashSplit(self.train_fraction)


class_part("split", "hash", Hash, "ffd_lightning.data.splits:HashSplit")


@dataclass
class Auto:
    """The data set's own where it has one, else by the hash of the id.

    Attributes:
        train_fraction: share that is trained on, where the hash decides.
    """

    train_fraction: float = 0.8

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        Hash(self.train_fraction).check()


class_part("split", "auto", Auto, "ffd_lightning.data.splits:AutoSplit")


@dataclass
class R2n2:
    """3D-R2N2's: the first 80% of the sorted ids are trained on."""


class_part("split", "r2n2", R2n2, "ffd_lightning.data.splits:R2n2Split")


@dataclass
class Listed:
    """Read from a file.

    Attributes:
        file: ids to test on, `<id> <subset>` lines, a CSV such as ShapeNet's all.csv, or a folder
            of train.lst, val.lst, test.lst.
    """

    file: str = MISSING

    def check(self) -> None:
        """Raise ConfigError where it cannot work."""
        if not Path(self.file).expanduser().exists():
            raise ConfigError(f"split.file={self.file} does not exist")


class_part("split", "listed", Listed, "ffd_lightning.data.splits:ListedSplit")
