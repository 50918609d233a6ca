"""One frame of a sample, without the others: what is read is checked by the crc32c of its chunks.

The sha256 of an array needs all of it. So one frame is checked by less than a whole sample is: by the digest
of the attributes, by shape and type, and by the checksum of every chunk that is touched.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import zarr
from numpy.typing import NDArray

from muslin.garments.errors import InputError
from muslin.sim.dataset import store
from muslin.sim.dataset.cloth_arrays import VERTICES
from muslin.sim.dataset.codecs import numcodecs_unremarked
from muslin.sim.dataset.root import Root

OPEN_SAMPLES = 2048
"""How many samples are kept open for the next frame."""


def read_frame(root: Root, sample_id: str, frame: int) -> NDArray[np.float32]:
    """(V_t, 3) float32 positions of the cloth in one frame, metres.

    Raises InputError if the sample is missing or has no such frame, or if what had to be read is damaged.
    """
    opened = _open(root, sample_id, root.stamp(store.sample_name(sample_id)))
    if not -opened.frames <= frame < opened.frames:
        raise InputError(
            f"{root}: sample {sample_id!r} has no frame {frame}; give 0 to {opened.frames - 1}, or count "
            "from the end with negative numbers"
        )
    rows = opened.rows(frame % opened.frames)
    path = f"{store.sample_place(root, sample_id)}/positions"
    with store.damage_told(path, f"frame {frame} is not readable"):
        positions = np.asarray(opened.array[rows])
    if not np.isfinite(positions).all():
        raise InputError(f"{path}: part of frame {frame} is missing; {store.REMEDY}")
    return positions


@dataclass(frozen=True)
class _Opened:
    """starts: (T + 1,) first row of each frame where frames are stacked, as of changing topology."""

    frames: int
    array: zarr.Array
    starts: np.ndarray | None

    def rows(self, frame: int) -> int | slice:
        return frame if self.starts is None else slice(self.starts[frame], self.starts[frame + 1])


@lru_cache(maxsize=OPEN_SAMPLES)
def _open(root: Root, sample_id: str, stamp: Hashable) -> _Opened:
    group, place = store.open_sample(root, sample_id), store.sample_place(root, sample_id)
    meta, checksums = store.meta_of(group, place)
    with store.damage_told(f"{place}/zarr.json", "not the attributes of a sample"):
        frames, starts = int(meta["frames"]), None
        shape: tuple[int, ...] = (frames, int(meta["vertices"]), 3)
    if "frame_topology" in checksums:
        sizes = store.read_array(root, sample_id, "topology_sizes")[:, VERTICES]
        counts = sizes[store.read_array(root, sample_id, "frame_topology")]
        starts = np.concatenate([[0], np.cumsum(counts)])
        shape = (int(starts[-1]), 3)
    with store.damage_told(f"{place}/positions/zarr.json"), numcodecs_unremarked():
        array = group["positions"]
    if not isinstance(array, zarr.Array) or (array.shape, array.dtype) != (shape, np.float32):
        raise InputError(
            f"{place}/positions/zarr.json: {array.metadata.to_dict().get('data_type', 'no array')} of shape "
            f"{getattr(array, 'shape', None)}, where the sample has float32 of shape {shape}; {store.REMEDY}"
        )
    return _Opened(frames, array, starts)
