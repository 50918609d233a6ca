"""Moving surfaces whose frames are read when they are asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import overload

import numpy as np

from muslin.eval.metrics.penetration import is_closed
from muslin.garments.mesh import GarmentMesh
from muslin.sim.dataset.sample import Sample


class Frames(Sequence[np.ndarray]):
    """(V_t, 3) float64 positions of each frame t, metres, read at every access and not kept.

    What is kept is the source behind `read`: a memory map, or one array in the precision of its file.
    """

    def __init__(
        self, count: int, read: Callable[[int], np.ndarray], transform: np.ndarray | None = None
    ) -> None:
        """transform   (3, 3), applied to each point; None changes nothing"""
        self._count, self._read, self._transform = count, read, transform

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, frame: int) -> np.ndarray: ...
    @overload
    def __getitem__(self, frame: slice) -> Sequence[np.ndarray]: ...
    def __getitem__(self, frame: int | slice) -> np.ndarray | Sequence[np.ndarray]:
        if isinstance(frame, slice):
            return [self[t] for t in range(self._count)[frame]]
        x = np.ascontiguousarray(self._read(range(self._count)[frame]), dtype=np.float64)
        return x if self._transform is None else x @ self._transform.T


@dataclass(frozen=True, eq=False)
class MovingSurface:
    """What the cloth lies on: a body or an obstacle of constant topology.

    positions   a frame: (N, 3), metres; one frame alone if it stands still
    faces       (M, 3) int
    """

    name: str
    positions: Sequence[np.ndarray]
    faces: np.ndarray

    @property
    def num_frames(self) -> int:
        return len(self.positions)

    def vertices(self, frame: int) -> np.ndarray:
        """(N, 3) float64 positions in a frame, metres."""
        return self.positions[0 if self.num_frames == 1 else frame]

    @cached_property
    def closed(self) -> bool:
        """Whether it has an inside: every edge has two triangles, in opposite directions."""
        return is_closed(self.faces)


@dataclass(frozen=True, eq=False)
class Track:
    """One moving garment, whose topology may change over time.

    positions     a frame: (V_t, 3) float64, metres
    faces         a frame: (F_t, 3); frames of one topology share one object; empty where a file has none, and
                  then `paired` takes the other side's
    garments      a frame: its mesh with panels; empty where panels are not known
    fps           frames per second, if known
    sample        what it came from, if it was one
    body          what it lies on, if known
    units_known   whether metres are certain: a dataset's, or said by the file or by who opened it
    notes         what a reader of the scores has to know about how it was read
    """

    name: str
    positions: Sequence[np.ndarray]
    faces: Sequence[np.ndarray]
    garments: Sequence[GarmentMesh] = ()
    fps: float | None = None
    sample: Sample | None = None
    body: MovingSurface | None = None
    units_known: bool = False
    notes: tuple[str, ...] = ()

    @property
    def num_frames(self) -> int:
        return len(self.positions)
