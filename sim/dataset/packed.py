"""A zarr group as one file: a zip archive without compression, of which single chunks are read.

One file a sample keeps datasets within the numbers of files that shared file systems allow, makes a commit
one step, and one request of a store. zarr reads it as it is, by `zarr.storage.ZipStore`. Here it is
read through a `Root`, a chunk by one access at its place, of a folder and of a store alike.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass

from zarr.abc.store import ByteRequest, OffsetByteRequest, RangeByteRequest, Store, SuffixByteRequest
from zarr.core.buffer import Buffer, BufferPrototype
from zarr.storage import MemoryStore

from muslin.sim.dataset.root import Root

_LOCAL_HEADER_BYTES = 30
"""Before the name of an entry (PKWARE, APPNOTE.TXT, 4.3.7)."""
_LEAST_BYTES = 22
"""Of an archive: the record at its end (4.3.16)."""
_MOST_ENTRIES = 0xFFFF
"""That this record can tell of; it tells of as many where there are more (4.4.1.4)."""
_TAIL_BYTES = 1 << 15
"""Read first: it holds the list of entries, unless they are many hundreds."""


def pack(store: MemoryStore) -> bytes:
    """The archive of what is in memory: the same bytes for the same content, at whatever time."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_STORED) as archive:
        # Metadata last, so that opening a sample takes one access.
        for name in sorted(store._store_dict, key=lambda name: (name.endswith("zarr.json"), name)):
            archive.writestr(zipfile.ZipInfo(name), store._store_dict[name].to_bytes())
    return stream.getvalue()


@dataclass(frozen=True)
class _Entry:
    """Where the bytes of an entry begin, how many they are, and their crc32."""

    start: int
    size: int
    crc: int


class PackedStore(Store):
    """Read-only zarr store of an archive. ValueError: it is no such archive; FileNotFoundError: not there."""

    supports_writes = False
    supports_deletes = False
    supports_listing = True
    supports_partial_writes = False

    def __init__(self, root: Root, name: str) -> None:
        super().__init__(read_only=True)
        self._root, self._name = root, name
        self._file = _File(root, name)
        self._entries = _entries(self._file)

    def read(self, key: str, request: ByteRequest | None = None) -> bytes | None:
        """Bytes of an entry, or the part asked for; None without such an entry.

        ValueError: the whole is not what its crc32 says. Parts are for their reader to check.
        """
        entry = self._entries.get(key)
        if entry is None:
            return None
        start, stop = 0, entry.size
        if isinstance(request, RangeByteRequest):
            start, stop = request.start, min(request.end, entry.size)
        elif isinstance(request, OffsetByteRequest):
            start = min(request.offset, entry.size)
        elif isinstance(request, SuffixByteRequest):
            start = max(0, entry.size - request.suffix)
        data = self._file.part(entry.start + start, entry.start + stop)
        if request is None and zlib.crc32(data) != entry.crc:
            raise ValueError(f"{key} does not match its crc32")
        return data

    async def get(
        self, key: str, prototype: BufferPrototype, byte_range: ByteRequest | None = None
    ) -> Buffer | None:
        data = self.read(key, byte_range)
        return None if data is None else prototype.buffer.from_bytes(data)

    async def get_partial_values(
        self, prototype: BufferPrototype, key_ranges: Iterable[tuple[str, ByteRequest | None]]
    ) -> list[Buffer | None]:
        return [await self.get(key, prototype, byte_range) for key, byte_range in key_ranges]

    async def exists(self, key: str) -> bool:
        return key in self._entries

    async def list(self) -> AsyncIterator[str]:
        for key in self._entries:
            yield key

    async def list_prefix(self, prefix: str) -> AsyncIterator[str]:
        for key in self._entries:
            if key.startswith(prefix):
                yield key

    async def list_dir(self, prefix: str) -> AsyncIterator[str]:
        inside = prefix.rstrip("/") + "/" if prefix else ""
        found = {key[len(inside) :].split("/", 1)[0] for key in self._entries if key.startswith(inside)}
        for name in sorted(found):
            yield name

    async def set(self, key: str, value: Buffer) -> None:
        raise NotImplementedError("a packed sample is written whole")

    async def delete(self, key: str) -> None:
        raise NotImplementedError("a packed sample is written whole")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PackedStore) and (other._root, other._name) == (self._root, self._name)


def _entries(file: _File) -> dict[str, _Entry]:
    """{name: entry} of the list at the end of an archive. ValueError if it does not fit what is there."""
    try:
        with zipfile.ZipFile(file) as archive:  # type: ignore[call-overload]
            listed = sorted(archive.infolist(), key=lambda entry: entry.header_offset)
            end = archive.start_dir
        told = file.entries
    except (zipfile.BadZipFile, NotImplementedError, struct.error) as error:
        raise ValueError(str(error)) from error
    if told != min(len(listed), _MOST_ENTRIES):
        raise ValueError(f"{len(listed)} entries are listed, where it says to have {told}")
    found: dict[str, _Entry] = {}
    # From the last to the first: an entry ends where the next begins, whatever its header is followed by.
    for entry in reversed(listed):
        name, size = entry.filename, entry.file_size
        stored = entry.compress_type == zipfile.ZIP_STORED and entry.compress_size == size
        if not stored or entry.flag_bits & 1:
            raise ValueError(f"{name} is compressed or encrypted; entries must be stored as they are")
        start = end - size
        if name in found or start < entry.header_offset + _LOCAL_HEADER_BYTES + len(name.encode()):
            raise ValueError(f"the list of its entries does not fit them at {name}")
        found[name] = _Entry(start, size, entry.CRC)
        end = entry.header_offset
    if end != 0:
        raise ValueError("the list of its entries does not begin at its start")
    return found


class _File(io.RawIOBase):
    """A file of a root, of which the end is read at once and the rest where it is asked for."""

    def __init__(self, root: Root, name: str) -> None:
        self._root, self._file_name = root, name
        self._size = root.size(name)
        if self._size < _LEAST_BYTES:
            raise ValueError(f"{self._size} bytes are no archive")
        self._tail_start = max(0, self._size - _TAIL_BYTES)
        self._tail = root.read(name, self._tail_start, self._size)
        self._place = 0

    def part(self, start: int, stop: int) -> bytes:
        if start >= self._tail_start:
            return self._tail[start - self._tail_start : stop - self._tail_start]
        return self._root.read(self._file_name, start, stop)

    @property
    def entries(self) -> int:
        """How many entries the record at the end tells of."""
        return int.from_bytes(self._tail[-_LEAST_BYTES:][10:12], "little")

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._place

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._place = offset + {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self._size}[whence]
        if self._place < 0:
            raise OSError(f"place {self._place} is before the start of the file")
        return self._place

    def read(self, count: int | None = -1) -> bytes:
        stop = self._size if count is None or count < 0 else min(self._size, self._place + count)
        data = self.part(self._place, stop)
        self._place = stop
        return data
