"""What forces are left on a cloth, taken as standing still."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from muslin.sim.solve.simulator import ClothSimulator


def force_residual(sim: ClothSimulator, dt: float) -> float:
    """Norm of the net force left on the cloth that is not pinned, as a share of its weight; see
    `ClothSimulator.forces_at_rest`."""
    force = np.linalg.norm(sim.forces_at_rest(dt)[~sim.pins])
    return float(force / (sim.cloth.mass.sum() * np.linalg.norm(sim.settings.gravity) + 1e-300))


def pin_forces(sim: ClothSimulator, dt: float) -> NDArray[np.float64]:
    """Force (P, 3), N, with which each pinned vertex, in their order, holds the cloth at rest."""
    return -sim.forces_at_rest(dt)[sim.pins]
