"""Writes that are whole or not there, whenever the process is killed or the power fails."""

from __future__ import annotations

import errno
import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from muslin.garments.errors import InputError


def make_folder(path: Path) -> None:
    """Make a folder and those above it. Raises InputError if that cannot be."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be made ({error.strerror}); choose another place") from error


def write_file(path: Path, data: bytes) -> None:
    """Replace a file in one step: readers see the old bytes or the new ones, never a part."""
    partial = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    with partial.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(partial, path)
    _sync(path.parent)


def commit_directory(partial: Path, final: Path) -> bool:
    """Move a finished folder to its place. False, and `partial` removed, if something is there already."""
    for folder, _, files in os.walk(partial):
        for name in files:
            _sync(Path(folder, name))
        _sync(Path(folder))
    try:
        os.replace(partial, final)
    except OSError as error:
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
            raise
        shutil.rmtree(partial)
        return False
    _sync(final.parent)
    return True


def move(path: Path, place: Path) -> None:
    """Move a file or folder to a place of the same file system where nothing lies."""
    os.rename(path, place)
    _sync(path.parent)
    _sync(place.parent)


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


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
