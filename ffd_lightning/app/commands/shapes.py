"""Draw contact sheets of the embedded dataset: a row for each structural family of a category.

ffd shapes categories=[table,chair] out=docs/categories
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from ffd_lightning.components import check_ranges
from ffd_lightning.errors import ConfigError

if TYPE_CHECKING:
    from PIL import Image

MAIN = "out"
_SIZE = (144, 192)  # pixels of a shape


@dataclass
class Settings:
    """What is drawn, and where to.

    Attributes:
        out: the folder; a picture is named after its category.
        categories: all of them, by default.
        per_family: shapes in a row.
        seed: draws another set.
    """

    out: str = "docs/categories"
    categories: list[str] = field(default_factory=list)
    per_family: int = 6
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what is out of range."""
        check_ranges(vars(self), per_family="(0, inf)", seed="[0, inf)")


def main(settings: Settings) -> int:
    """Write one picture for each category.

    Raises:
        ConfigError: a category that there is not.
    """
    from ffd_lightning.shapes import categories

    unknown = sorted(set(settings.categories) - set(categories()))
    if unknown:
        raise ConfigError(f"no category {unknown[0]!r}: {', '.join(categories())}")
    folder = Path(settings.out)
    folder.mkdir(parents=True, exist_ok=True)
    for category in settings.categories or categories():
        file = folder / f"{category}.jpg"
        draw_sheet(category, settings.per_family, settings.seed).save(file, quality=80)
        print(file)
    return 0


def draw_sheet(category: str, per_family: int, seed: int) -> Image.Image:
    """Draw the first shapes of each structural family of a category, a row a family."""
    from PIL import Image

    from ffd_lightning.geometry.normalization import normalize
    from ffd_lightning.imaging.rendering import render
    from ffd_lightning.imaging.sheet import contact_sheet
    from ffd_lightning.shapes import build, families

    rows: dict[str, list] = {family: [] for family in families(category)}
    for index in count():
        mesh, family = build(category, index, seed)
        if len(rows[family]) < per_family:
            vertices = normalize(mesh.vertices, mesh.faces)
            image = render(mesh.with_vertices(vertices), height=_SIZE[0], width=_SIZE[1])
            rows[family].append((image, f"{family} {category}-{index:06d}"))
        if all(len(row) == per_family for row in rows.values()):
            break
    cells = [cell for row in rows.values() for cell in row]
    images, labels = zip(*cells, strict=True)
    return Image.fromarray(contact_sheet(images, per_family, labels))
