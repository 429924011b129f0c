"""Files of shapes: in folders, or in zip archives that are read without unpacking."""

from __future__ import annotations

import os
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Protocol

from ffd_lightning.errors import DataError

MAX_BYTES = 1 << 31
"""Of one file; reading a mesh takes several times its size in memory."""


def is_hidden(name: str) -> bool:
    """Return whether files of this name are the system's, not the user's: ".DS_Store", say.

    `__MACOSX` is what archives hold that were packed on a Mac.
    """
    return name.startswith(".") or name == "__MACOSX"


def files_below(top: Path) -> dict[tuple[str, ...], os.stat_result]:
    """Return size, time and so on of all files in a folder, by their paths below it, sorted.

    Links to folders are not followed, and the system's own files passed over. Of a file it is that
    file, by the path ().

    Raises:
        OSError: a folder cannot be read.
    """
    if not top.is_dir():
        return {(): top.stat()} if top.is_file() else {}
    found = {}

    def look(folder: str, path: tuple[str, ...]) -> None:
        with os.scandir(folder) as entries:
            for entry in entries:
                if is_hidden(entry.name):
                    continue
                if entry.is_dir(follow_symlinks=False):
                    look(entry.path, (*path, entry.name))
                elif entry.is_file():
                    found[*path, entry.name] = entry.stat()

    look(os.fspath(top), ())
    return dict(sorted(found.items()))


class File(Protocol):
    """What the readers of meshes need of a file; `pathlib.Path` offers it too."""

    @property
    def name(self) -> str:
        """Its last component."""
        ...

    @property
    def stem(self) -> str:
        """The name without its extension."""
        ...

    @property
    def suffix(self) -> str:
        """The extension, with its dot."""
        ...

    @property
    def parts(self) -> tuple[str, ...]:
        """Its path, component by component."""
        ...

    def read_bytes(self) -> bytes:
        """Return its content."""
        ...


@dataclass(frozen=True)
class ZipMember:
    """A file in an archive."""

    archive: ZipTree
    info: zipfile.ZipInfo

    @property
    def parts(self) -> tuple[str, ...]:
        """Its path in the archive, component by component."""
        return PurePosixPath(self.info.filename).parts

    @property
    def name(self) -> str:
        """Its last component."""
        return PurePosixPath(self.info.filename).name

    @property
    def stem(self) -> str:
        """The name without its extension."""
        return PurePosixPath(self.info.filename).stem

    @property
    def suffix(self) -> str:
        """The extension, with its dot."""
        return PurePosixPath(self.info.filename).suffix

    def __str__(self) -> str:
        return self.info.filename

    def read_bytes(self) -> bytes:
        """Return its content.

        Raises:
            OSError: it is damaged, encrypted, or larger than 2 GB; with a number, as all of the
                system's, where the archive itself cannot be read.
        """
        if self.info.file_size > MAX_BYTES:
            raise OSError(f"{self.name} unpacks to {self.info.file_size / 1e9:.1f} GB")
        try:
            return self.archive.zip.read(self.info)
        except (
            zipfile.BadZipFile,
            zlib.error,
            EOFError,
            RuntimeError,
            NotImplementedError,
        ) as error:
            raise OSError(f"{self.name} in {self.archive.path.name}: {error}") from error


@dataclass
class ZipTree:
    """An archive, opened once in each process that reads from it."""

    path: Path
    _zip: zipfile.ZipFile | None = field(default=None, init=False, repr=False, compare=False)
    _process: int = field(default=0, init=False, repr=False, compare=False)

    def __getstate__(self) -> dict[str, object]:
        return {"path": self.path, "_zip": None, "_process": 0}

    @property
    def zip(self) -> zipfile.ZipFile:
        """The open archive.

        Raises:
            DataError: it cannot be opened.
        """
        if self._zip is None or self._process != os.getpid():
            try:
                self._zip, self._process = zipfile.ZipFile(self.path), os.getpid()
            except OSError as error:
                raise DataError(f"the archive {self.path} cannot be read ({error})") from None
            except zipfile.BadZipFile as error:
                raise DataError(
                    f"the archive {self.path} is damaged or incomplete ({error}): get it again"
                ) from None
        return self._zip

    def members(self) -> Iterator[ZipMember]:
        """Yield the files in it whose paths lead nowhere else."""
        for info in self.zip.infolist():
            path = PurePosixPath(info.filename)
            safe = not path.is_absolute() and ".." not in path.parts and "\\" not in info.filename
            if safe and not info.is_dir():
                yield ZipMember(self, info)
