"""Files that a reader, or a kill, never sees half of; folders that one process has at a time."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from ffd_lightning.errors import ConfigError, DataError

_GLANCE = 1.0  # seconds; whoever only looks (`RunFolder.at_work`) has a lock for less


def write_bytes_atomic(path: Path, content: bytes) -> None:
    """Write a small file so that a reader, or a kill, never sees half of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    with temporary.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    temporary.replace(path)


def write_atomic(path: Path, text: str) -> None:
    """Write a small text file as `write_bytes_atomic` does, in UTF-8."""
    write_bytes_atomic(path, text.encode("utf-8"))


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows, at least one and all of the same columns, as `write_atomic` does."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_atomic(path, buffer.getvalue())


def lock_folder(folder: Path, taken: str) -> FileLock:
    """Take a folder for this process (a context manager); freed however the process ends.

    Args:
        folder: made where it is missing.
        taken: what to say when another process has it.

    Raises:
        ConfigError: another process has it.
        DataError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = FileLock(folder / ".lock")
        lock.acquire(timeout=_GLANCE)
    except Timeout:
        raise ConfigError(taken) from None
    except OSError as error:
        raise DataError(f"cannot write the folder {folder}: {error}") from None
    return lock
