"""The files of shapes: in folders, or in zip archives that are read without unpacking."""

from __future__ import annotations

import functools
import os
import zipfile
import zlib
from pathlib import Path, PurePath, PurePosixPath

from ffd_lightning.data.reading.mesh_file import MAX_BYTES, read_file
from ffd_lightning.errors import DataError


def is_hidden(name: str) -> bool:
    """Return whether files of this name are the system's, not the user's: ".DS_Store", say.

    `__MACOSX` is what archives hold that were packed on a Mac.
    """
    return name.startswith(".") or name == "__MACOSX"


def files_below(top: Path) -> dict[PurePath, os.stat_result]:
    """Return size, time and so on of all files in a folder, by their paths below it, sorted.

    Links to folders are not followed, and the system's own files passed over. Of a file it is that
    file, by the path `.`.

    Raises:
        OSError: a folder cannot be read.
    """
    if not top.is_dir():
        return {PurePath(): top.stat()} if top.is_file() else {}
    found = {}

    def look(folder: str, path: PurePath) -> None:
        with os.scandir(folder) as entries:
            for entry in entries:
                if is_hidden(entry.name):
                    continue
                if entry.is_dir(follow_symlinks=False):
                    look(entry.path, path / entry.name)
                elif entry.is_file():
                    found[path / entry.name] = entry.stat()

    look(os.fspath(top), PurePath())
    return dict(sorted(found.items()))


class Tree:
    """The files of a folder or of a zip archive, by their paths in it.

    Args:
        place: the folder, or an archive `*.zip`.
    """

    def __init__(self, place: Path) -> None:
        self.place, self.packed = place, place.suffix == ".zip" and not place.is_dir()

    def sizes(self) -> dict[PurePath, int]:
        """Return the size of each file in bytes, sorted, without paths that lead elsewhere.

        Raises:
            DataError: the archive cannot be opened.
        """
        if not self.packed:
            return {path: stat.st_size for path, stat in files_below(self.place).items()}
        found = {}
        for info in _opened(self.place).infolist():
            path = PurePosixPath(info.filename)
            safe = not path.is_absolute() and ".." not in path.parts and "\\" not in info.filename
            if safe and not info.is_dir() and not any(map(is_hidden, path.parts)):
                found[PurePath(path)] = info.file_size
        return dict(sorted(found.items()))

    def read(self, path: PurePath) -> bytes:
        """Return a file's content.

        Raises:
            RejectedShapeError: it is larger than 2 GB.
            OSError: it is damaged or encrypted; with a number, as all of the system's, where the
                disk failed.
        """
        if not self.packed:
            return read_file(self.place / path)
        archive = _opened(self.place)
        try:
            info = archive.getinfo(path.as_posix())
            if info.file_size > MAX_BYTES:
                raise OSError(f"it unpacks to {info.file_size / 1e9:.1f} GB")
            return archive.read(info)
        except (
            *(zipfile.BadZipFile, zlib.error, EOFError),
            *(RuntimeError, NotImplementedError, KeyError),
        ) as error:
            raise OSError(f"{path.name} in {self.place.name}: {error}") from error


@functools.lru_cache(maxsize=16)
def _opened(place: Path) -> zipfile.ZipFile:
    """Return an archive, opened once in each process that reads from it."""
    try:
        return zipfile.ZipFile(place)
    except OSError as error:
        raise DataError(f"the archive {place} cannot be read ({error})") from None
    except zipfile.BadZipFile as error:
        raise DataError(
            f"the archive {place} is damaged or incomplete ({error}): get it again"
        ) from None
