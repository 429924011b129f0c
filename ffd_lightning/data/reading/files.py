"""The files of shapes: in folders, or in zip archives that are read without unpacking."""

import functools
import hashlib
import os
import zipfile
import zlib
from collections.abc import Iterable
from os.path import isfile
from pathlib import Path, PurePath, PurePosixPath

from ffd_lightning.errors import DataError, RejectedShapeError


def is_hidden(name: str) -> bool:
    """Return whether files of this name are the system's: `.DS_Store`, or a Mac's `__MACOSX`."""
    return name.startswith(".") or name == "__MACOSX"


def printable(name: str) -> str:
    r"""Return a file's name as text that can be written anywhere: a name may be any bytes.

    >>> print(printable("st\udcfchl\n"))
    st\udcfchl\n
    """
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in name)


def files_below(top: Path) -> dict[PurePath, os.stat_result]:
    """Return size, time and so on of all files in a folder, by their paths below it, sorted.

    Links to folders are not followed, and the system's own files passed over. Of a file it is that
    file, by the path `.`.
    """
    if not top.is_dir():
        return {PurePath(): top.stat()} if top.is_file() else {}
    found, folders = {}, [PurePath()]
    for folder in folders:  # which grow meanwhile
        with os.scandir(top / folder) as entries:
            for entry in entries:
                if is_hidden(entry.name):
                    continue
                if entry.is_dir(follow_symlinks=False):
                    folders.append(folder / entry.name)
                elif entry.is_file(follow_symlinks=False) or isfile(entry.path):  # no circular link
                    found[folder / entry.name] = entry.stat()
    return dict(sorted(found.items()))


def digest_of_files(facts: Iterable[tuple[str, object]]) -> str:
    """Return a sha256, in hexadecimal, of files' names and what is known of each."""
    digest = hashlib.sha256()
    for name, fact in facts:
        digest.update(os.fsencode(f"{name}\0{fact}\n"))
    return digest.hexdigest()


class Tree:
    """The files of a folder or of an archive `*.zip`, by their paths in it.

    Where an archive holds a folder of its own name, paths are below that.
    """

    def __init__(self, place: Path) -> None:
        self.place, self.packed = place, place.suffix == ".zip" and not place.is_dir()

    def sizes(self) -> dict[PurePath, int]:
        """Return the size of each file in bytes, sorted, without paths that lead elsewhere."""
        if not self.packed:
            return {path: stat.st_size for path, stat in files_below(self.place).items()}
        found = {}
        for info in _opened(self.place).infolist():
            path = PurePosixPath(info.filename)
            safe = not path.is_absolute() and ".." not in path.parts and "\\" not in info.filename
            if safe and not info.is_dir() and not any(map(is_hidden, path.parts)):
                below = path.parts[path.parts[0] == self.place.stem :]
                found[PurePath(*below)] = info.file_size
        return dict(sorted(found.items()))

    def read(self, path: PurePath) -> bytes:
        """Return a file's content.

        Raises:
            RejectedShapeError: it is damaged or encrypted.
            OSError: the disk failed.
        """
        if not self.packed:
            return (self.place / path).read_bytes()
        archive, name = _opened(self.place), path.as_posix()
        try:
            return archive.read(name if name in archive.NameToInfo else f"{self.place.stem}/{name}")
        except (zipfile.BadZipFile, zlib.error, EOFError, KeyError, RuntimeError) as error:
            reason = f"{path.name} cannot be read from {self.place.name} ({error})"
            raise RejectedShapeError(reason) from error


@functools.lru_cache(maxsize=16)
def _opened(place: Path) -> zipfile.ZipFile:
    """Return an archive, opened once in each process that reads from it."""
    try:
        return zipfile.ZipFile(place)
    except OSError as error:
        raise DataError(f"the archive {place} cannot be read ({error})") from None
    except zipfile.BadZipFile as error:
        message = f"the archive {place} is damaged or incomplete ({error}): get it again"
        raise DataError(message) from None
