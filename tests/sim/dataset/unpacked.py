"""A sample's file as a folder, for tests that look at single entries or tamper with them."""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from zarr.core.buffer import default_buffer_prototype
from zarr.storage import MemoryStore

from muslin.sim.dataset.packed import pack


@contextmanager
def unpacked(file: Path) -> Iterator[Path]:
    """A folder with the entries of a sample's file; what the block leaves there is packed as the sample was.

    Bytes and time of the file stay where nothing was changed.
    """
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(file) as archive:
            archive.extractall(folder)
        before = entries(Path(folder))
        yield Path(folder)
        after = entries(Path(folder))
        if after != before:
            make = default_buffer_prototype().buffer.from_bytes
            replace_file(file, pack(MemoryStore({name: make(data) for name, data in after.items()})))


def entries(folder: Path) -> dict[str, bytes]:
    """{name: bytes} of all files in a folder, sorted."""
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in files}


def entries_of(file: Path) -> dict[str, bytes]:
    """{name: bytes} of a sample's file."""
    with zipfile.ZipFile(file) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def chunk_of(folder: Path, array: str) -> Path:
    """The one chunk, or shard, of an array in an unpacked sample."""
    (chunk,) = (file for file in (folder / array / "c").rglob("*") if file.is_file())
    return chunk


def replace_file(file: Path, data: bytes) -> None:
    """Put another file in the place of one: readers go by its time, which writing at once may leave alone."""
    other = file.with_name(f".{file.name}.other")
    other.write_bytes(data)
    os.replace(other, file)
