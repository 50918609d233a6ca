"""NumPy files: .npy with the vertices, .npz with vertices and faces by name."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.lib import format as npy

from muslin.eval.read.content import Content, parsing
from muslin.eval.read.named_arrays import content_of, frames_of, triangles_of
from muslin.garments.errors import InputError

# Beyond this size an archive that shrank its arrays more than so many times is taken for a trap.
LARGE_BYTES, MOST_SHRUNK = 1 << 28, 200


def read_npy(path: Path) -> Content:
    """Vertices (T, V, 3) or (V, 3), mapped into memory, not read.

    Faces are those in STEM_faces.npy or faces.npy beside it; without one there are none.
    """
    frames = frames_of(_mapped(path), "array", path)
    beside = (path.with_name(f"{path.stem}_faces.npy"), path.with_name("faces.npy"))
    file = next((file for file in beside if file.is_file() and file != path), None)
    faces = [] if file is None else [triangles_of(_mapped(file), "array", file)] * len(frames)
    return Content(len(frames), lambda t: frames[t], faces)


def _mapped(path: Path) -> np.ndarray:
    with parsing(path, "a NumPy array"):
        with path.open("rb") as stream:
            shape, dtype = _header(stream, path)
            size = stream.tell() + int(np.prod(shape, dtype=object)) * dtype.itemsize
        if size != path.stat().st_size:
            raise InputError(
                f"{path}: {path.stat().st_size} bytes where its header asks for {size}; give an intact file"
            )
        return np.asanyarray(np.load(path, mmap_mode="r", allow_pickle=False))


def read_npz(path: Path) -> Content:
    """Vertices and faces by name (`named_arrays`); each array is kept once, in the file's precision."""
    with parsing(path, "a NumPy archive"):
        archive = _Archive(path)
    return content_of(archive, path)


class _Archive(Mapping[str, np.ndarray]):
    """Arrays of an npz by name, in lower case, each read when asked for, if its header fits its size."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._read: dict[str, np.ndarray] = {}
        with zipfile.ZipFile(path) as archive:
            entries = archive.infolist()
        self._members = {entry.filename.removesuffix(".npy").lower(): entry for entry in entries}

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._read:
            entry = self._members[name]
            with parsing(self._path, "a NumPy archive"):
                self._read[name] = self._load(entry)
        return self._read[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._members)

    def __len__(self) -> int:
        return len(self._members)

    def _load(self, entry: zipfile.ZipInfo) -> np.ndarray:
        where = f"{self._path}: '{entry.filename}'"
        if entry.file_size > max(LARGE_BYTES, MOST_SHRUNK * entry.compress_size):
            raise InputError(
                f"{where} would unpack {entry.compress_size} bytes to {entry.file_size}; refused, write it "
                "again with numpy.savez"
            )
        with zipfile.ZipFile(self._path) as archive:
            with archive.open(entry) as stream:
                shape, dtype = _header(stream, self._path)
                size = stream.tell() + int(np.prod(shape, dtype=object)) * dtype.itemsize
            if size != entry.file_size:
                raise InputError(f"{where}: {entry.file_size} bytes where its header asks for {size}")
            with archive.open(entry) as stream:
                return np.asarray(npy.read_array(stream, allow_pickle=False))


def _header(stream: object, path: Path) -> tuple[tuple[int, ...], np.dtype]:
    version = npy.read_magic(stream)  # type: ignore[arg-type]
    if version not in ((1, 0), (2, 0), (3, 0)):
        raise InputError(f"{path}: a NumPy array of version {version}; 1.0, 2.0 and 3.0 are read")
    # the header of version 3 is that of 2 in another text encoding, which only names of fields need
    reader = npy.read_array_header_1_0 if version == (1, 0) else npy.read_array_header_2_0
    shape, _, dtype = reader(stream)  # type: ignore[arg-type]
    if dtype.kind not in "fiub" and dtype.kind not in "SU":
        raise InputError(f"{path}: holds {dtype}, not plain numbers; only numbers are read")
    return shape, dtype
