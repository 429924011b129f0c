"""Contact sheets of the embedded dataset: a row for each structural family of a category."""

from __future__ import annotations

from itertools import count

from PIL import Image

from ffd_lightning.geometry.mesh import normalize
from ffd_lightning.imaging.rendering import render
from ffd_lightning.imaging.sheet import contact_sheet
from ffd_lightning.shapes import build, families

_SIZE = (144, 192)  # pixels of a shape


def draw_sheet(category: str, per_family: int = 6, seed: int = 0) -> Image.Image:
    """Draw the first shapes of each structural family of a category, a row a family."""
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
