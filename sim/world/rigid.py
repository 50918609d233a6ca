"""Rigid motion at constant velocity and spin, for a span of time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from muslin.sim.world.tables import MovingTable


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """Points at rest until `start`, then x(t) = c + R(s w) (x_0 - c) + s v, s = min(t, stop) - start.

    `velocity` v m/s; `spin` w rad/s along the axis; `centre` c, metres, travels along; times in seconds.
    """

    velocity: NDArray[np.float64]
    spin: NDArray[np.float64]
    centre: NDArray[np.float64]
    start: float
    stop: float

    @staticmethod
    def of(table: MovingTable, centre: NDArray[np.float64]) -> RigidMotion:
        stop = np.inf if table.stop is None else table.stop
        return RigidMotion(np.array(table.velocity), np.array(table.spin), centre, table.start, stop)

    def at(self, points: NDArray[np.float64], time: float) -> NDArray[np.float64]:
        """Where the points (N, 3) of time 0 are at `time`, metres."""
        passed = max(0.0, min(time, self.stop) - self.start)
        if passed == 0.0:
            return points.copy()
        turn = Rotation.from_rotvec(passed * self.spin)
        return self.centre + turn.apply(points - self.centre) + passed * self.velocity
