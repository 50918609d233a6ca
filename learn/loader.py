"""Frames of a dataset for torch's `DataLoader`: by index, or as a stream that reads each sample once.

Both give a dictionary a frame, of any topology, with the keys of `muslin.sim.dataset.arrays`; floats are
float32 and indices int64 tensors. `muslin.learn.collate` makes batches of them.

    loader = DataLoader(FrameDataset("out/data", split="train"), batch_size=8, shuffle=True, num_workers=2,
                        collate_fn=collate)

Which of them: `FrameDataset` shuffles perfectly, and opens at each frame the sample that it is of; from more
samples than its cache holds, frames of long sequences are faster as a `FrameStream`, which shuffles samples,
and frames within a buffer.
"""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
import torch
import torch.distributed
import torch.utils.data

from muslin.garments.errors import InputError
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.arrays import frame_arrays
from muslin.sim.dataset.reader import Dataset
from muslin.sim.dataset.remeshed import RemeshedSequence
from muslin.sim.dataset.sample import Sample
from muslin.sim.dataset.schema import GARMENT_ARRAYS
from muslin.sim.dataset.selection import select

Frame = dict[str, Any]


class FrameDataset(torch.utils.data.Dataset[Frame]):
    """Random access to the frames of a dataset, in the order of its samples.

    An index is a place from 0 to `len` - 1, or (sample id, frame). The list of samples is kept as it was when
    this was made: samples that come later do not shift its places, here or in workers.
    """

    def __init__(
        self,
        dataset: Dataset | str | Path,
        split: str | None = None,
        where: Mapping[str, Any] | None = None,
        *,
        body: bool = False,
        cache: int = 1024,
    ) -> None:
        """Choose frames; `split`, `where` and errors as in `muslin.sim.dataset.selection.select`.

        body    with the vertices and faces of what the cloth lies on
        cache   samples of which all but the positions stays in memory (of each worker)
        """
        self._samples = select(dataset, split, where)
        self._ends = np.cumsum([row["frames"] for row in self._samples.rows])
        self._body, self._most = body, cache
        self._forget()

    def __len__(self) -> int:
        return int(self._ends[-1])

    def __getitem__(self, index: int | tuple[str, int]) -> Frame:
        """One frame. Raises IndexError beyond the last, InputError for an unknown id and for damage."""
        sample_id, frame = self.locate(index) if not isinstance(index, tuple) else index
        known = self._known.get(sample_id)
        if known is None:
            sample = self._samples[sample_id]
            self._remember(sample)
            frame = _checked(sample, frame)
            positions = sample.frame_positions(frame)
        else:
            sample, frame = known, _checked(known, frame)
            self._known.move_to_end(sample_id)
            positions = self._samples.frame(sample_id, frame)
        return to_tensors(frame_arrays(sample, frame, body=self._body, positions=positions))

    def locate(self, place: int) -> tuple[str, int]:
        """(sample id, frame) of a place."""
        if not -len(self) <= place < len(self):
            raise IndexError(f"frame {place} of {len(self)}; give 0 to {len(self) - 1}")
        place %= len(self)
        sample = int(np.searchsorted(self._ends, place, side="right"))
        return self._samples.ids[sample], place - int(self._ends[sample - 1] if sample else 0)

    def __getstate__(self) -> dict[str, Any]:
        return {key: value for key, value in self.__dict__.items() if key not in ("_known", "_meshes")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._forget()

    def _forget(self) -> None:
        self._known: OrderedDict[str, Sample] = OrderedDict()
        self._meshes: WeakValueDictionary[bytes, GarmentMesh] = WeakValueDictionary()

    def _remember(self, sample: Sample) -> None:
        self._known[sample.id] = self._without_positions(sample)
        while len(self._known) > self._most:
            self._known.popitem(last=False)

    def _without_positions(self, sample: Sample) -> Sample:
        """Equal meshes of different samples are kept once, and positions as zeros that take no memory."""
        if isinstance(sample, RemeshedSequence):
            frames = tuple(_zeros(frame.shape) for frame in sample.frames)
            return replace(sample, topologies=tuple(map(self._shared, sample.topologies)), frames=frames)
        garment = self._shared(sample.garment)
        return replace(sample, garment=garment, positions=_zeros(sample.positions.shape))

    def _shared(self, mesh: GarmentMesh) -> GarmentMesh:
        digest = hashlib.sha256()
        for name in GARMENT_ARRAYS:
            digest.update(np.ascontiguousarray(getattr(mesh, name)).data)
        return self._meshes.setdefault(digest.digest(), mesh)


class FrameStream(torch.utils.data.IterableDataset[Frame]):
    """All frames of a dataset, each once an epoch over all ranks and workers; every sample is read once.

    Samples are dealt out to ranks and workers, so that none of them reads what another one does. Their shares
    differ by up to a sample: where ranks must take equally many steps, use torch's `Join`, or `FrameDataset`
    with a `DistributedSampler`. All ranks need the same seed, epoch and number of workers.
    """

    def __init__(
        self,
        dataset: Dataset | str | Path,
        split: str | None = None,
        where: Mapping[str, Any] | None = None,
        *,
        body: bool = False,
        shuffle: bool = True,
        buffer: int = 256,
        seed: int = 0,
        rank: int | None = None,
        world_size: int | None = None,
    ) -> None:
        """Choose frames; `split`, `where` and errors as in `muslin.sim.dataset.selection.select`.

        body               with the vertices and faces of what the cloth lies on
        shuffle            samples in an order that seed and epoch determine, frames by way of a buffer
        buffer             frames that a worker holds, of which the next is drawn
        rank, world_size   by default those of `torch.distributed`, if it has been started
        """
        if (rank is None) != (world_size is None):
            raise InputError(f"rank = {rank} with world_size = {world_size}; give both, or neither")
        if rank is None or world_size is None:
            started = torch.distributed.is_available() and torch.distributed.is_initialized()
            rank = torch.distributed.get_rank() if started else 0
            world_size = torch.distributed.get_world_size() if started else 1
        if not 0 <= rank < world_size:
            raise InputError(f"rank = {rank} of world_size = {world_size}; it must be 0 to {world_size - 1}")
        if buffer < 1:
            raise InputError(f"buffer = {buffer}; it must be at least 1")
        self._samples = select(dataset, split, where)
        self._body, self._shuffle, self._buffer, self._seed = body, shuffle, buffer, seed
        self._rank, self._world_size = rank, world_size
        # Shared, so that workers that outlive an epoch see the next one.
        self._epoch = torch.zeros((), dtype=torch.int64).share_memory_()

    @property
    def num_frames(self) -> int:
        """Frames of an epoch, over all ranks."""
        return sum(row["frames"] for row in self._samples.rows)

    def set_epoch(self, epoch: int) -> None:
        """Shuffle differently from now on: call it before each epoch, as of a `DistributedSampler`."""
        self._epoch.fill_(epoch)

    def __iter__(self) -> Iterator[Frame]:
        worker = torch.utils.data.get_worker_info()
        workers, number = (1, 0) if worker is None else (worker.num_workers, worker.id)
        share, shares = self._rank * workers + number, self._world_size * workers
        ids, epoch = np.array(self._samples.ids), int(self._epoch)
        if not self._shuffle:
            return self._frames(ids[share::shares])
        order = np.random.default_rng([self._seed, epoch]).permutation(len(ids))
        generator = np.random.default_rng([self._seed, epoch, share])
        return _shuffled(self._frames(ids[order[share::shares]]), self._buffer, generator)

    def _frames(self, ids: Iterable[str]) -> Iterator[Frame]:
        for sample_id in ids:
            sample = self._samples[str(sample_id)]
            for frame in range(sample.num_frames):
                yield to_tensors(frame_arrays(sample, frame, body=self._body))


def to_tensors(arrays: Mapping[str, Any]) -> Frame:
    """Arrays as tensors of their own memory: float32, int64; everything else as it is."""
    types = {"f": torch.float32, "i": torch.int64}
    return {
        key: torch.tensor(value, dtype=types[value.dtype.kind]) if isinstance(value, np.ndarray) else value
        for key, value in arrays.items()
    }


def _shuffled(frames: Iterator[Frame], size: int, generator: np.random.Generator) -> Iterator[Frame]:
    held: list[Frame] = []
    for frame in frames:
        if len(held) < size:
            held.append(frame)
            continue
        place = int(generator.integers(size))
        held[place], drawn = frame, held[place]
        yield drawn
    for place in generator.permutation(len(held)):
        yield held[place]


def _checked(sample: Sample, frame: int) -> int:
    if not -sample.num_frames <= frame < sample.num_frames:
        raise InputError(
            f"sample {sample.id!r} has no frame {frame}; give 0 to {sample.num_frames - 1}, or count "
            "from the end with negative numbers"
        )
    return frame % sample.num_frames


def _zeros(shape: tuple[int, ...]) -> np.ndarray:
    return np.broadcast_to(np.float32(0), shape)
