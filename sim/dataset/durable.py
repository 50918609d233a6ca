"""Writes that are whole or not there, whenever the process is killed or the power fails."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from muslin.garments.errors import InputError

NO_SYNC = "MUSLIN_NO_SYNC"
"""Environment variable: where it is 1, nothing waits for the disk. What is killed still leaves whole files; a
power failure may not. For tests and scratch data on slow disks."""


def make_folder(path: Path) -> None:
    """Make a folder and those above it. Raises InputError if that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be made ({error.strerror}); choose another place") from error


def write_file(path: Path, data: bytes) -> None:
    """Replace a file in one step: readers see the old bytes or the new ones, never a part."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    write_through(partial, data)
    os.replace(partial, path)
    sync(path.parent)


def write_through(path: Path, data: bytes) -> None:
    """Write a file and wait until the disk has it."""
    with path.open("wb") as stream:
        stream.write(data)
        stream.flush()
        _wait_for_disk(stream.fileno())


def move(path: Path, place: Path) -> None:
    """Move a file or folder to a place of the same file system where nothing lies."""
    os.rename(path, place)
    sync(path.parent)
    sync(place.parent)


@contextmanager
def exclusive(lock: Path) -> Iterator[None]:
    """Hold a lock file for as long as the block runs; the system frees it when the process dies.

    Raises InputError if another process holds it.
    """
    with lock.open("w") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise InputError(
                f"{lock.parent}: another process is writing here; wait for its end, or write elsewhere"
            ) from error
        yield


def sync(path: Path) -> None:
    """Wait until the disk has a file, or the names in a folder."""
    handle = os.open(path, os.O_RDONLY)
    try:
        _wait_for_disk(handle)
    finally:
        os.close(handle)


def _wait_for_disk(handle: int) -> None:
    if os.environ.get(NO_SYNC) != "1":
        os.fsync(handle)
