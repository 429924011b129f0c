"""Files that a reader, or a kill, never sees half of; folders that one process has at a time."""

import csv
import io
import json
import os
import secrets
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import IO, Any

from filelock import FileLock, Timeout

from ffd_lightning.errors import ConfigError, DataError

_GLANCE = 1.0  # seconds; whoever only looks (`RunFolder.at_work`) has a lock for less


@contextmanager
def atomic_file(path: Path, durable: bool = True) -> Iterator[IO[bytes]]:
    """Open a file for writing that appears when all of it is written, and not before.

    What was there stays until then; an error leaves nothing behind. No other process, on whichever
    machine, writes the same temporary file.

    Args:
        path: in a folder that exists.
        durable: wait until all of it is on the disk. Without, a power cut may leave a broken file.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.tmp")
    try:
        with temporary.open("wb") as file:
            yield file
            if durable:
                file.flush()
                os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        error.filename = str(path)  # of a full disk it names none, else the temporary one
        raise
    finally:
        temporary.unlink(missing_ok=True)


def write_bytes_atomic(path: Path, content: bytes) -> None:
    """Write a small file as `atomic_file` does, and the folders that it is in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic_file(path) as file:
        file.write(content)


def write_atomic(path: Path, text: str) -> None:
    """Write a small text file, in UTF-8, as `write_bytes_atomic` does."""
    write_bytes_atomic(path, text.encode())


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Write what JSON can hold as `write_atomic` does."""
    write_atomic(path, json.dumps(content, indent=2) + "\n")


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows, at least one and all of the same columns, as `write_atomic` does."""
    buffer = io.StringIO()
    writer = csv.DictWriter(buffer, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_atomic(path, buffer.getvalue())


def read_json(path: Path) -> dict[str, Any]:
    """Return what a file of JSON holds, {} where there is none or it is damaged."""
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError, TypeError):
        return {}


def lock_folder(folder: Path, taken: str) -> AbstractContextManager[object]:
    """Take a folder for this process until the context ends; freed however the process ends.

    Args:
        folder: made where it is missing.
        taken: what to say when another process has it.

    Raises:
        ConfigError: another process has it.
        DataError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return FileLock(folder / ".lock").acquire(timeout=_GLANCE)
    except Timeout:
        raise ConfigError(taken) from None
    except OSError as error:
        raise DataError(f"cannot write the folder {folder}: {error}") from None
