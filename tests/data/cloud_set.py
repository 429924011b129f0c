"""Sets of clouds alone, in no file and under any ids."""

from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.data.preparation.packing import pack_points
from ffd_lightning.data.preparation.prepared import PreparedSet
from ffd_lightning.geometry.mesh import normalize


@dataclass(frozen=True)
class CloudSet(PreparedSet):
    clouds: tuple = ()

    def packed_cloud(self, row):
        return self.clouds[row if self.taken is None else self.taken[row]]


def set_of(clouds, ids, category="plane", source="procedural"):
    manifest = {
        "sha256": f"{category} {source} {' '.join(ids)}",
        "settings": {"category": category, "source": {"source": source}},
        "ids": list(ids),
        "families": [""] * len(ids),
    }
    packed = tuple(pack_points(normalize(points)) for points in clouds)
    return CloudSet((Path(category),), (manifest,), clouds=packed)
