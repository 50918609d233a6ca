"""The exception of a simulation that cannot go on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import BinaryIO

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

    def save(self, stream: BinaryIO) -> None:
        """Write the arrays as one .npz file, under the names that they have here."""
        np.savez_compressed(stream, **vars(self))


class SimulationError(Exception):
    """The solver cannot continue: says at which frame and element, why, and what to try; `state` is the last
    good one, where there was any."""

    def __init__(self, message: str, state: LastState | None = None) -> None:
        super().__init__(message)
        self.state = state


def blocked(share: float, halvings: int, tightest: str) -> SimulationError:
    """The error of a step in which collider and pins still have this `share` of their way to go."""
    return SimulationError(
        f"collider and pins cannot go on without touching the cloth: {share:.0%} of the way is left "
        f"after {halvings} halvings of the step; closest are {tightest}; "
        "use a smaller time step, a looser garment or a slower motion"
    )


def out_of_budget(tightest: str) -> SimulationError:
    """The error of a step that needs more Newton iterations than it may spend."""
    return SimulationError(
        f"the budget of Newton iterations is spent; closest are {tightest}; use a larger budget "
        "(solver.max_work), a smaller time step or a slower motion"
    )
