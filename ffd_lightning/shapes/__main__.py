"""Contact sheets: `python -m ffd_lightning.shapes table chair --out DIR`."""

from __future__ import annotations

import argparse
from itertools import count
from pathlib import Path

from PIL import Image

from ffd_lightning.geometry.normalization import normalize
from ffd_lightning.shapes import build, categories, families


def draw_sheet(category: str, per_family: int, seed: int) -> Image.Image:
    """Draw the first models of each structural family of a category, a row a family."""
    from ffd_lightning.imaging.rendering import contact_sheet, render  # nothing else here needs it

    rows: dict[str, list] = {family: [] for family in families(category)}
    for index in count():
        mesh, family = build(category, index, seed)
        if len(rows[family]) < per_family:
            vertices = normalize(mesh.vertices, mesh.faces)
            image = render(mesh.with_vertices(vertices), height=144, width=192)
            rows[family].append((image, f"{family} {category}-{index:06d}"))
        if all(len(row) == per_family for row in rows.values()):
            break
    cells = [cell for row in rows.values() for cell in row]
    images, labels = zip(*cells, strict=True)
    return Image.fromarray(contact_sheet(images, per_family, labels))


def main() -> None:
    """Write one picture per category."""
    known = categories()
    parser = argparse.ArgumentParser(prog="python -m ffd_lightning.shapes")
    parser.add_argument("categories", nargs="*", default=list(known), metavar="CATEGORY")
    parser.add_argument("--out", type=Path, default=Path("docs/categories"), metavar="DIR")
    parser.add_argument("--per-family", type=int, default=6, metavar="N")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.categories) - set(known))
    if unknown:
        parser.error(f"no category {', '.join(unknown)}; choose from {', '.join(known)}")
    arguments.out.mkdir(parents=True, exist_ok=True)
    for category in arguments.categories:
        file = arguments.out / f"{category}.jpg"
        draw_sheet(category, arguments.per_family, arguments.seed).save(file, quality=80)
        print(file)


if __name__ == "__main__":
    main()
