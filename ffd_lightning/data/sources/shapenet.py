"""ShapeNetCore, version 1 or 2, in folders or in one zip archive per category."""

import re
from dataclasses import replace
from pathlib import Path, PurePath
from typing import Literal, NamedTuple

from ffd_lightning.data.categories import SYNSETS, listed, name_of
from ffd_lightning.data.reading.files import Tree, digest_of_files, is_hidden, printable
from ffd_lightning.data.reading.mesh_file import read_mesh
from ffd_lightning.data.reading.orientation import orient
from ffd_lightning.data.source import Source, SourceShape
from ffd_lightning.data.sources.r2n2 import R2n2Images, mismatch
from ffd_lightning.data.sources.shapenet_parts import PartAnnotations
from ffd_lightning.errors import DataError, RejectedShapeError

_LOADER_VERSION = 4  # part of the fingerprint: raise it when the same files give another mesh
MESHES = {1: PurePath("model.obj"), 2: PurePath("models/model_normalized.obj")}
"""Where a shape's mesh is, by version, below the shape's folder."""
_YAW = {1: 90.0, 2: 0.0}  # degrees, see `orientation.turn`: v1 faces +x

_BELOW = ("", "ShapeNetCore.v1", "ShapeNetCore.v2")
_SYNSET = re.compile(r"\d{8}")


class _Category(NamedTuple):
    """One category's shapes: the sizes of their files, by id and path below the shape's folder."""

    tree: Tree
    files: dict[str, dict[PurePath, int]]
    version: int


class ShapeNetSource(Source):
    """ShapeNetCore v1 or v2 as downloaded, folders or archives; which version it is, is seen.

    `root` holds `<synset>` folders or `<synset>.zip` archives, or a folder `ShapeNetCore.v1` or
    `.v2` that does. A folder is taken before an archive of the same name. Shapes without their mesh
    and empty ones are rejected with the reason.

    Convention:
        Shapes of both versions come out y up and facing -z, the project's frame. Those of v2 are
        so; those of v1 face +x (its README) and are turned by 90 degrees. Azimuth 45 then is view
        5 of the authors' renderings of v1, which they trained on.

    Args:
        root: with <synset>/<shape>/... or <synset>.zip.
        images: `r2n2` takes 3D-R2N2's published renderings (of v1).
        images_root: where those are, if not in `root`.
        mix_versions: takes them with v2 all the same.
        parts_root: adds part annotations.
    """

    def __init__(
        self,
        root: Path,
        images: Literal["render", "r2n2"] = "render",
        images_root: Path | None = None,
        mix_versions: bool = False,
        parts_root: Path | None = None,
    ) -> None:
        if images not in ("render", "r2n2"):
            raise ValueError(f"images={images} must be one of render, r2n2")
        if images == "render":
            for name, value in (("images_root", images_root), ("mix_versions", mix_versions)):
                if value:
                    raise ValueError(f"{name}={value} must be left out without images=r2n2")
        self.root = Path(root)
        self.images = R2n2Images(Path(images_root or root)) if images == "r2n2" else None
        self.mix_versions = mix_versions
        self.parts = None if parts_root is None else PartAnnotations(Path(parts_root))
        self.own_images = self.images is not None
        self._categories: dict[str, _Category] = {}

    def categories(self) -> list[str]:
        """Return the categories that are there: by name where they have one, else by synset."""
        found = set(self._places())
        if self.images is not None and found:
            rendered = found & self.images.synsets()
            if not rendered:
                self.images.ids(min(found))  # raises: the folder is not what the user meant
            found = rendered
        return sorted(map(name_of, found))

    def shape_ids(self, category: str) -> list[str]:
        """Return the ids of all shapes of `category`, sorted; see `Source.shape_ids`."""
        self._categories.pop(category, None)
        return sorted(self._category(category).files)

    def rejected(self, category: str) -> dict[str, str]:
        """Return which shapes lack their mesh or image, or whose mesh is empty."""
        _, files, version = self._category(category)
        mesh = MESHES[version]
        found = {i: f"it has no {mesh}" for i in files if mesh not in files[i]}
        found |= {i: f"its {mesh} is empty" for i in files if files[i].get(mesh) == 0}
        if self.images is not None:
            rendered = self.images.ids(category)
            found |= {i: "it has no rendering" for i in files if i not in rendered}
        return found

    def load(self, category: str, shape_id: str) -> SourceShape:
        """Return one shape; see `Source.load`."""
        tree, files, version = self._category(category)
        folder, own = PurePath(shape_id), files.get(shape_id, {})
        if MESHES[version] not in own:
            raise RejectedShapeError(f"it has no {MESHES[version]}")
        side_files = [folder / path for path in own]
        mesh, warnings = read_mesh(folder / MESHES[version], side_files, tree.read)
        shape = SourceShape(orient(mesh, "y", _YAW[version])).warned(*warnings)
        if self.images is not None:
            images = self.images.read(category, shape_id)
            cameras, warning = self.images.cameras(category, shape_id)
            if cameras is not None:
                warning = mismatch(images[0], cameras[0], shape.mesh)
            shape = replace(shape, images=images, cameras=cameras).warned(warning)
        if annotations := self._annotations(category):
            parts, warning = annotations.read(category, shape_id, shape.mesh)
            if warning:
                warning = f"part annotation absent or doubtful: {warning}"
            shape = replace(shape, parts=parts).warned(warning)
        return shape

    def fingerprint(self, category: str) -> dict[str, object]:
        """Return version and a hash over names and sizes of all files: meshes, materials, textures.

        The same whether in folders or archives and wherever they are: the data set is published,
        so that its files are added or replaced, but not edited, and their times say nothing.
        """
        self._categories.pop(category, None)
        _, files, version = self._category(category)
        annotations = self._annotations(category)
        facts = [
            (shape_id, [(path.as_posix(), size) for path, size in sorted(own.items())])
            for shape_id, own in sorted(files.items())
        ]
        return {
            "source": "shapenet",
            "loader": _LOADER_VERSION,
            "version": version,
            "sha256": digest_of_files(facts),
            "images": "own" if self.images is None else self.images.fingerprint(category),
            "parts": "none" if annotations is None else annotations.fingerprint(category),
        }

    def _category(self, name: str) -> _Category:
        """Return a category's shapes, as found when first asked for."""
        if name not in self._categories:
            synset, places = SYNSETS.get(name, name), self._places()
            if not places:
                raise DataError(
                    f"{self.root} is not ShapeNetCore: neither it nor ShapeNetCore.v1 or .v2 in it "
                    "has folders <synset> or archives <synset>.zip; set data.root to the folder "
                    "that does"
                )
            if synset not in places:
                there = listed(sorted(places))
                raise DataError(f"{self.root} has no {name} ({synset}); it has: {there}")
            found = _listed(places[synset])
            if found.version != 1 and self.images is not None and not self.mix_versions:
                raise DataError(
                    f"{places[synset]} is of ShapeNetCore v2, 3D-R2N2's renderings are of v1, some "
                    "of whose meshes are others: images and shapes would not match. Use v1, or "
                    "data.images=render, or data.mix_versions=true to use them all the same"
                )
            self._categories[name] = found
        return self._categories[name]

    def _annotations(self, category: str) -> PartAnnotations | None:
        """Return the part annotations if they have the category: 16 of ShapeNet's 57 have."""
        if self.parts is None:
            return None
        annotated = self.parts.synsets()
        if not annotated:
            self.parts.fingerprint(category)  # raises: the folder is not what the user meant
        return self.parts if SYNSETS.get(category, category) in annotated else None

    def _places(self) -> dict[str, Path]:
        """Return the folder or archive of every category that is there, by synset."""
        for below in _BELOW:
            archives = {path.stem: path for path in (self.root / below).glob("*.zip")}
            folders = {path.name: path for path in (self.root / below).glob("*") if path.is_dir()}
            found = archives | folders
            if places := {name: found[name] for name in found if _SYNSET.fullmatch(name)}:
                return places
        return {}


def _listed(place: Path) -> _Category:
    tree = Tree(place)
    files: dict[str, dict[PurePath, int]] = {}
    if tree.packed:
        for path, size in tree.sizes().items():
            if len(path.parts) > 1:
                files.setdefault(path.parts[0], {})[PurePath(*path.parts[1:])] = size
    else:  # a shape's folder may be a link
        folders = [path for path in place.iterdir() if path.is_dir() and not is_hidden(path.name)]
        files = {folder.name: Tree(folder).sizes() for folder in folders}
    if odd := [name for name in files if printable(name) != name]:
        name = printable(odd[0])
        raise DataError(f"{place} holds a folder whose name is no text: {name}; rename it")
    counts = {v: sum(mesh in own for own in files.values()) for v, mesh in MESHES.items()}
    version = max(counts, key=lambda v: counts[v])
    if not counts[version]:
        wanted = " or ".join(f"<shape>/{mesh}" for mesh in MESHES.values())
        raise DataError(f"{place} holds {len(files)} folders, but no {wanted}")
    return _Category(tree, files, version)
