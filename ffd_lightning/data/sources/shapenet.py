"""ShapeNetCore, version 1 or 2, in folders or in one zip archive per category."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, Protocol

from ffd_lightning.data.categories import SYNSETS
from ffd_lightning.data.reading.files import File, ZipMember, ZipTree, files_below, is_hidden
from ffd_lightning.data.reading.frame import into_frame
from ffd_lightning.data.reading.mesh_file import read_with_notes
from ffd_lightning.data.sources.base import SourceShape, Survey
from ffd_lightning.data.sources.parts import PartAnnotations
from ffd_lightning.data.sources.r2n2 import R2n2Images
from ffd_lightning.errors import DataError, RejectedShapeError

_LOADER_VERSION = 3  # part of the fingerprint: raise it when the same files give another mesh
MESHES = {1: ("model.obj",), 2: ("models", "model_normalized.obj")}
"""Where a model's mesh is, by version, below the model's folder."""
_YAW = {1: 90.0, 2: 0.0}  # degrees, see `frame.turn`: v1 faces +x

_TELLING = 20  # so many shapes more of one version than of the other decide
_BELOW = ("", "ShapeNetCore.v1", "ShapeNetCore.v2")
_SYNSET = re.compile(r"\d{8}")


class Category(Protocol):
    """One category's shapes, wherever they are."""

    def ids(self) -> list[str]:
        """Return the ids of all shapes, sorted."""
        ...

    def size(self, shape_id: str, path: Sequence[str]) -> int | None:
        """Return the size of a shape's file in bytes, None where it has no such file."""
        ...

    def files(self, shape_id: str) -> dict[tuple[str, ...], File]:
        """Return a shape's files by their path below its folder."""
        ...

    def sizes(self, shape_id: str) -> dict[tuple[str, ...], int]:
        """Return the sizes of a shape's files in bytes, sorted by path."""
        ...


@dataclass
class CategoryFolder:
    """`<synset>/<model>/...`."""

    path: Path

    def ids(self) -> list[str]:
        """Return the names of the folders in it, sorted."""
        with os.scandir(self.path) as entries:
            return sorted(e.name for e in entries if e.is_dir() and not e.name.startswith("."))

    def size(self, shape_id: str, path: Sequence[str]) -> int | None:
        """Return the size of a shape's file in bytes, None where it has no such file."""
        try:
            return self.path.joinpath(shape_id, *path).stat().st_size
        except (FileNotFoundError, NotADirectoryError):
            return None

    def files(self, shape_id: str) -> dict[tuple[str, ...], File]:
        """Return a shape's files; links to folders within it are not followed."""
        top = self.path / shape_id
        return {path: top.joinpath(*path) for path in files_below(top)}

    def sizes(self, shape_id: str) -> dict[tuple[str, ...], int]:
        """Return the sizes of a shape's files in bytes, sorted by path."""
        return {path: stat.st_size for path, stat in files_below(self.path / shape_id).items()}


@dataclass
class CategoryZip:
    """`<synset>.zip` with `<synset>/<model>/...` or `<model>/...` in it."""

    tree: ZipTree
    _models: dict[str, dict[tuple[str, ...], ZipMember]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __getstate__(self) -> dict[str, object]:
        return {"tree": self.tree, "_models": {}}  # read again where it is needed

    def _read(self) -> dict[str, dict[tuple[str, ...], ZipMember]]:
        if not self._models:
            for member in self.tree.members():
                parts = member.parts
                if _SYNSET.fullmatch(parts[0]):
                    parts = parts[1:]
                if len(parts) > 1 and not any(map(is_hidden, parts)):
                    self._models.setdefault(parts[0], {})[parts[1:]] = member
        return self._models

    def ids(self) -> list[str]:
        """Return the names of the folders in it, sorted."""
        return sorted(self._read())

    def size(self, shape_id: str, path: Sequence[str]) -> int | None:
        """Return the size of a shape's file in bytes, None where it has no such file."""
        member = self._read().get(shape_id, {}).get(tuple(path))
        return None if member is None else member.info.file_size

    def files(self, shape_id: str) -> dict[tuple[str, ...], File]:
        """Return a shape's files by their path below its folder."""
        return dict(self._read().get(shape_id, {}))

    def sizes(self, shape_id: str) -> dict[tuple[str, ...], int]:
        """Return the sizes of a shape's files in bytes, sorted by path."""
        members = self._read().get(shape_id, {})
        return {path: members[path].info.file_size for path in sorted(members)}


@dataclass
class ShapeNetSource:
    """ShapeNetCore as downloaded: nothing is unpacked, and which version it is, is seen.

    `root` holds `<synset>` folders or `<synset>.zip` archives, or a folder `ShapeNetCore.v1` or
    `.v2` that does. A folder is taken before an archive of the same name. Shapes without their mesh
    and empty ones are rejected with the reason.

    Convention:
        Shapes of both versions come out y up and facing -z, the project's frame. Those of v2 are
        so; those of v1 face +x (its README) and are turned by 90 degrees. Azimuth 45 then is view
        5 of the authors' renderings of v1, which they trained on.

    Attributes:
        root: what `data.root` names.
        images: published renderings to use instead of our own; of version 1.
        mix_versions: use them with version 2 all the same.
        parts: published part annotations.
    """

    root: Path
    images: R2n2Images | None = None
    mix_versions: bool = False
    parts: PartAnnotations | None = None
    _categories: dict[str, tuple[Category, int]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        self.root = Path(self.root)

    def categories(self) -> list[str]:
        """Return the categories that are there: by name where they have one, else by synset.

        Raises:
            DataError: renderings are asked for, and there are none of any category.
        """
        names = {synset: name for name, synset in SYNSETS.items()}
        found = set(self.synsets())
        if self.images is not None and found:
            rendered = found & self.images.synsets()
            if not rendered:
                self.images.ids(min(found))  # raises: the folder is not what the user meant
            found = rendered
        return sorted(names.get(synset, synset) for synset in found)

    def survey(self, category: str) -> Survey:
        """Tell version and form, and which shapes lack their mesh, image or annotation.

        Raises:
            DataError: as `shape_ids`.
        """
        models, version = self.category(category)
        form = "zip archive" if isinstance(models, CategoryZip) else "folders"
        ids = models.ids()
        sizes = {i: models.size(i, MESHES[version]) for i in ids}
        mesh = "/".join(MESHES[version])
        faults = {i: f"it has no {mesh}" for i in ids if sizes[i] is None}
        faults |= {i: f"its {mesh} is empty" for i in ids if sizes[i] == 0}
        notes = []
        if self.images is not None:
            rendered = self.images.ids(category)
            faults |= {i: "it has no rendering" for i in ids if i not in rendered}
        if self.parts is not None:
            annotations = self._annotations(category)
            annotated = set() if annotations is None else set(annotations.ids(category)) & set(ids)
            notes.append(f"parts of {len(annotated)} shapes are annotated")
        return Survey(f"v{version}, {form}", faults, tuple(notes))

    def split(self, category: str) -> dict[str, str]:
        """Return {}: ShapeNetCore has no split that all use."""
        return {}

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of `category`, sorted.

        Raises:
            DataError: no such category; the message lists those that are there.
        """
        return self.category(category)[0].ids()

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return one shape.

        Raises:
            RejectedShapeError: the model cannot be used; the message is the reason.
            DataError: no such category.
        """
        models, version = self.category(category)
        files = models.files(shape_id)
        mesh = files.get(MESHES[version])
        if mesh is None:
            raise RejectedShapeError(f"it has no {'/'.join(MESHES[version])}")
        read, notes = read_with_notes(mesh, list(files.values()))
        turned = into_frame(read, "y", _YAW[version])
        model = SourceShape(turned).warned(*notes)
        if self.images is not None:
            images = self.images.read(category, shape_id)
            cameras, warning = self.images.cameras(category, shape_id)
            if cameras is not None:
                warning = self.images.mismatch(images[0], cameras[0], turned)
            model = replace(model, images=images, cameras=cameras).warned(warning)
        annotations = self._annotations(category)
        if annotations is None:
            return model
        parts, warning = annotations.read(category, shape_id, model.mesh)
        if warning:
            warning = f"part annotation absent or doubtful: {warning}"
        return replace(model, parts=parts).warned(warning)

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return version and a hash over names and sizes of all files: meshes, materials, textures.

        The same whether in folders or archives and wherever they are: the data set is published,
        so that its files are added or replaced, but not edited, and their times say nothing.
        """
        models, version = self.category(category)
        annotations = self._annotations(category)
        digest = hashlib.sha256()
        for shape_id in models.ids():
            digest.update(f"{shape_id}\0{list(models.sizes(shape_id).items())}\n".encode())
        return {
            "source": "shapenet",
            "loader": _LOADER_VERSION,
            "version": version,
            "sha256": digest.hexdigest(),
            "images": "own" if self.images is None else self.images.fingerprint(category),
            "parts": "none" if annotations is None else annotations.fingerprint(category),
        }

    def category(self, name: str) -> tuple[Category, int]:
        """Return a category's shapes and the version of ShapeNetCore that they are of.

        Raises:
            DataError: no such category, or its shapes are of neither version.
        """
        if name not in self._categories:
            synset = SYNSETS.get(name, name)
            places = self.synsets()
            if synset not in places:
                raise DataError(self._missing(name, synset, sorted(places)))
            place = places[synset]
            models: Category
            models = CategoryZip(ZipTree(place)) if place.suffix else CategoryFolder(place)
            version = self._version(place, models)
            if version != 1 and self.images is not None and not self.mix_versions:
                raise DataError(
                    f"{place} is of ShapeNetCore v2, 3D-R2N2's renderings are of v1, some of whose "
                    "meshes are others: images and shapes would not match. Use v1, or "
                    "data.images=render, or data.mix_versions=true to use them all the same"
                )
            self._categories[name] = models, version
        return self._categories[name]

    def _annotations(self, category: str) -> PartAnnotations | None:
        """Return the part annotations if they have the category: 16 of ShapeNet's 57 have."""
        if self.parts is None:
            return None
        annotated = self.parts.categories()
        if not annotated:
            self.parts.ids(category)  # raises: the folder is not what the user meant
        return self.parts if SYNSETS.get(category, category) in annotated else None

    def synsets(self) -> dict[str, Path]:
        """Return the folder or archive of every category that is there, by synset."""
        for below in _BELOW:
            folder = self.root / below
            if folder.is_dir():
                found: dict[str, Path] = {}
                for entry in sorted(folder.iterdir(), reverse=True):  # folders after archives
                    if _SYNSET.fullmatch(entry.name) and entry.is_dir():
                        found[entry.name] = entry
                    elif entry.suffix == ".zip" and _SYNSET.fullmatch(entry.stem):
                        found[entry.stem] = entry
                if found:
                    return found
        return {}

    def _version(self, place: Path, models: Category) -> int:
        ids = models.ids()
        counts = dict.fromkeys(MESHES, 0)
        for shape_id in ids:  # looking at all 8,000 of them takes long on a disk of the network
            for version, path in MESHES.items():
                counts[version] += models.size(shape_id, path) is not None
            if max(counts.values()) - min(counts.values()) >= _TELLING:
                break
        version = max(counts, key=lambda v: counts[v])
        if not counts[version]:
            wanted = " or ".join("<model>/" + "/".join(path) for path in MESHES.values())
            raise DataError(f"{place} holds {len(ids)} folders, but no {wanted}")
        return version

    def _missing(self, name: str, synset: str, there: list[str]) -> str:
        if not there:
            return (
                f"{self.root} is not ShapeNetCore: neither it nor ShapeNetCore.v1 or .v2 in it has "
                "folders <synset> or archives <synset>.zip; set data.root to the folder that does"
            )
        names = {s: n for n, s in SYNSETS.items()}
        known = ", ".join(f"{names.get(s, 'other')} ({s})" for s in there)
        return f"{self.root} has no {name} ({synset}); it has: {known}"


def shapenet(
    root: Path,
    image_size: tuple[int, int],
    images: Literal["render", "r2n2"] = "render",
    images_root: Path | None = None,
    mix_versions: bool = False,
    parts_root: Path | None = None,
) -> ShapeNetSource:
    """ShapeNetCore v1 or v2 as downloaded, folders or archives.

    Args:
        root: with <synset>/<model>/... or <synset>.zip.
        image_size: (height, width) of the images in pixels.
        images: `r2n2` takes 3D-R2N2's published renderings (of v1).
        images_root: where those are, if not in `root`.
        mix_versions: takes them with v2 all the same.
        parts_root: adds part annotations.

    Raises:
        ValueError: a setting that would do nothing.
    """
    if images == "render":
        for name, value in (("images_root", images_root), ("mix_versions", mix_versions)):
            if value:
                raise ValueError(f"{name}={value} means nothing without data.images=r2n2")
    published = R2n2Images(images_root or root, *image_size) if images == "r2n2" else None
    parts = None if parts_root is None else PartAnnotations(parts_root)
    return ShapeNetSource(root, published, mix_versions, parts)
