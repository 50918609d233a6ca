"""The exception of a simulation that cannot go on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class LastState:
    """The last state without intersections: `positions` (V, 3) m, `velocity` (V, 3) m/s of the cloth with
    `faces` (F, 3), and the collider's `collider_vertices` (N, 3) m and `collider_faces` (M, 3)."""

    positions: NDArray[np.float64]
    velocity: NDArray[np.float64]
    faces: NDArray[np.int32]
    collider_vertices: NDArray[np.float64]
    collider_faces: NDArray[np.int32]

    def save(self, path: Path) -> None:
        """Write the arrays as one .npz file, under the names that they have here."""
        with path.open("wb") as stream:
            np.savez_compressed(stream, **vars(self))


class SimulationError(Exception):
    """The solver cannot continue: says at which frame and element, why, and what to try; `state` is the last
    good one, where there was any."""

    def __init__(self, message: str, state: LastState | None = None) -> None:
        super().__init__(message)
        self.state = state
