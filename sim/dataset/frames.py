"""One frame of a sample, without the others: what is read is checked by the crc32c of its chunks.

The sha256 of an array needs all of it. So one frame is checked by less than a whole sample is: by the digest
of the attributes, by shape and type, and by the checksum of every chunk that is touched.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import zarr
from numpy.typing import NDArray
from zarr.core.array import Array

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.cloth_arrays import VERTICES
from muslin.sim.dataset.codecs import checks_chunks, numcodecs_unremarked

OPEN_SAMPLES, WHOLE_SAMPLES = 4096, 4
"""How many samples are kept open for the next frame; and how many in memory, of those without checksums of
chunks, which only can be read whole."""

_UNREADABLE = (OSError, ValueError, KeyError, TypeError, RuntimeError)


def read_frame(root: Path, sample_id: str, frame: int) -> NDArray[np.float32]:
    """(V_t, 3) float32 positions of the cloth in one frame, metres.

    Raises InputError if the sample is missing or has no such frame, or if what had to be read is damaged.
    Samples written before chunks had checksums are read whole and checked by sha256.
    """
    opened = _open(root, sample_id, _stamp(store.sample_path(root, sample_id)))
    if not -opened.frames <= frame < opened.frames:
        raise InputError(
            f"{root}: sample {sample_id!r} has no frame {frame}; give 0 to {opened.frames - 1}, or count "
            "from the end with negative numbers"
        )
    rows = opened.rows(frame % opened.frames)
    if opened.checked is None:
        return _whole(root, sample_id, opened.stamp)[rows].copy()
    path = store.sample_path(root, sample_id) / "positions"
    try:
        positions = np.asarray(opened.checked[rows])
    except _UNREADABLE as error:
        raise InputError(f"{path}: frame {frame} is not readable ({error}); {store.REMEDY}") from error
    if not np.isfinite(positions).all():
        raise InputError(f"{path}: part of frame {frame} is missing; {store.REMEDY}")
    return positions


Stamp = tuple[int, int]


@dataclass(frozen=True)
class _Opened:
    """checked: the array of positions; None if its chunks have no checksums. starts: (T + 1,) first row of
    each frame where frames are stacked, as of changing topology."""

    stamp: Stamp
    frames: int
    checked: Array | None
    starts: np.ndarray | None

    def rows(self, frame: int) -> int | slice:
        return frame if self.starts is None else slice(self.starts[frame], self.starts[frame + 1])


@lru_cache(maxsize=OPEN_SAMPLES)
def _open(root: Path, sample_id: str, stamp: Stamp) -> _Opened:
    meta, checksums = store.read_meta(root, sample_id)
    path = store.sample_path(root, sample_id) / "positions"
    frames, starts = int(meta["frames"]), None
    shape: tuple[int, ...] = (frames, meta["vertices"], 3)
    if "frame_topology" in checksums:
        sizes = store.read_array(root, sample_id, "topology_sizes")[:, VERTICES]
        counts = sizes[store.read_array(root, sample_id, "frame_topology")]
        starts = np.concatenate([[0], np.cumsum(counts)])
        shape = (int(starts[-1]), 3)
    try:
        with numcodecs_unremarked():
            array = zarr.open_array(zarr.storage.LocalStore(path, read_only=True), mode="r", zarr_format=3)
    except _UNREADABLE as error:
        raise InputError(f"{path}/zarr.json: not readable ({error}); {store.REMEDY}") from error
    if array.shape != shape or array.dtype != np.float32:
        raise InputError(
            f"{path}/zarr.json: {array.dtype} of shape {array.shape}, where the sample has float32 of shape "
            f"{shape}; {store.REMEDY}"
        )
    return _Opened(stamp, frames, array if checks_chunks(array) else None, starts)


@lru_cache(maxsize=WHOLE_SAMPLES)
def _whole(root: Path, sample_id: str, stamp: Stamp) -> NDArray[np.float32]:
    return store.read_array(root, sample_id, "positions")


def _stamp(path: Path) -> Stamp:
    """Changes when a sample is replaced by another of the same id; (0, 0) where there is none."""
    try:
        status = (path / "zarr.json").stat()
    except OSError:
        return 0, 0
    return status.st_ino, status.st_mtime_ns
