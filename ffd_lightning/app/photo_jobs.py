"""Which photographs to reconstruct, with which masks, and where to."""

from __future__ import annotations

import glob
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ffd_lightning.errors import ConfigError

_SUFFIXES = frozenset(
    (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".gif", ".tif", ".tiff", ".ppm", ".heic", ".avif")
)
"""What is taken for an image in a folder; what of it cannot be read is named."""


@dataclass(frozen=True)
class Job:
    """One photograph, the mask of its object if there is one, and where its files go."""

    image: Path
    mask: Path | None
    folder: Path


def find_jobs(image: Any, mask: str | None, out: Path) -> list[Job]:
    """Return the photographs that `image` names, sorted within a folder or pattern.

    Raises:
        ConfigError: it names none, or `mask` does not fit them.
    """
    entries = [image] if isinstance(image, str) else image
    if not isinstance(entries, list) or not all(isinstance(e, str) for e in entries):
        raise ConfigError("image= takes a file, a folder, a pattern, or a list [a.png,b.png]")
    masks: list[Path | None]
    try:
        images = list(dict.fromkeys(path for entry in entries for path in _expand(entry)))
        if not images:
            raise ConfigError(f"image={image}: no images there")
        masks = [None] * len(images) if mask is None else _masks(images, Path(mask).expanduser())
    except OSError as error:
        name = str(error.filename)
        shown = name if len(name) < 200 else f"{name[:100]}..."
        raise ConfigError(f"{shown} cannot be looked at: {error.strerror}") from None
    folders = [out / name for name in _names(images)]
    return [Job(*job) for job in zip(images, masks, folders, strict=True)]


def _expand(entry: str) -> list[Path]:
    path = Path(entry).expanduser()
    if path.is_dir():
        return sorted(file for file in path.iterdir() if file.suffix.lower() in _SUFFIXES)
    if path.exists() or not glob.has_magic(entry):
        return [path]
    return sorted(p for p in map(Path, glob.glob(str(path), recursive=True)) if p.is_file())


def _names(images: Sequence[Path]) -> list[str]:
    """Return a folder's name for each image: its stem, with its suffix or a number if need be."""
    stems = Counter(image.stem for image in images)
    names: dict[str, None] = {}
    for image in images:
        plain = stems[image.stem] == 1 and image.stem.strip(".")  # "..png" is no place to write to
        name = image.stem if plain else image.name
        tries = (name if k == 1 else f"{name}-{k}" for k in range(1, len(images) + 2))
        names[next(t for t in tries if t not in names)] = None
    return list(names)


def _masks(images: Sequence[Path], mask: Path) -> list[Path | None]:
    if mask.is_dir():
        found: dict[str, list[Path]] = {}
        for file in sorted(mask.iterdir()):
            found.setdefault(file.stem, []).append(file)
        for image in images:
            count = len(found.get(image.stem, ()))
            if count != 1:
                raise ConfigError(
                    f"mask={mask}: {count or 'no'} masks named {image.stem}.* are in that folder"
                )
        masks = [found[image.stem][0] for image in images]
    elif len(images) > 1:
        raise ConfigError(f"mask={mask}: for several images give a folder of masks of their names")
    else:
        masks = [mask]
    for image, own in zip(images, masks, strict=True):
        if image.exists() and own.exists() and image.samefile(own):
            raise ConfigError(f"mask={own} is the photograph itself")
    return list(masks)
