"""A photograph that a visitor opened, and the mask of its object."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ffd_lightning.errors import DataError


@dataclass(frozen=True)
class File:
    """A file as a browser sends it.

    Attributes:
        name: without its folder.
        content: its bytes.
    """

    name: str
    content: bytes

    @classmethod
    def read(cls, path: Path) -> File:
        """Read a file of this machine.

        Raises:
            DataError: there is none, or it cannot be read.
        """
        try:
            if path.exists() and not path.is_file():
                raise DataError(f"{path} is not a file")  # reading a pipe would wait for ever
            return cls(path.name, path.read_bytes())
        except OSError as error:
            raise DataError(f"{path} cannot be read: {error.strerror}") from None


@dataclass(frozen=True)
class Photo:
    """A photograph as it was opened.

    Attributes:
        file: the photograph.
        mask: of its object, None where the background is to be told from the photograph.
    """

    file: File
    mask: File | None = None

    @property
    def name(self) -> str:
        """The photograph's file name, without a folder: it may come from anywhere."""
        return Path(self.file.name).name or "photo"

    def write(self, folder: Path) -> tuple[Path, Path | None]:
        """Write photograph and mask into an empty folder, and return where they are.

        Raises:
            DataError: the mask is the photograph itself.
        """
        photo = folder / self.name
        photo.write_bytes(self.file.content)
        if self.mask is None:
            return photo, None
        if self.mask.content == self.file.content:
            raise DataError(f"the mask is the photograph itself, {self.name}")
        mask = folder / "mask" / (Path(self.mask.name).name or "mask")  # both may have one name
        mask.parent.mkdir()
        mask.write_bytes(self.mask.content)
        return photo, mask
