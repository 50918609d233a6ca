"""Cloth solved far enough that what is left of an error is not the solver's, and the forces in it."""

from __future__ import annotations

import numpy as np
import warp as wp
from numpy.typing import NDArray

from muslin.sim.cloth import ClothModel
from muslin.sim.contact.system import ContactSettings
from muslin.sim.relax import measured_step
from muslin.sim.solve.errors import SimulationError
from muslin.sim.solve.rest_forces import force_residual
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator

Points = NDArray[np.float64]

GRAVITY = 9.81
"""m/s^2"""
DOWN = (0.0, -GRAVITY, 0.0)

NO_FACES: NDArray[np.int32] = np.zeros((0, 3), dtype=np.int32)
APART = ContactSettings(range=1.0e-5, margin=1.0e-3)
"""For cloth that touches nothing: a barrier so short that no mesh is within its own."""


def exact(
    gravity: tuple[float, float, float], tolerance: float = 1.0e-10, linear_tolerance: float = 1.0e-5
) -> SolverSettings:
    """Settings without drag and damping, each step solved until Newton moves no vertex by `tolerance`
    metres."""
    return SolverSettings(
        gravity=gravity,
        damping=0.0,
        drag=0.0,
        tolerance=tolerance,
        max_iterations=400,
        linear_tolerance=linear_tolerance,
        max_linear_iterations=4000,
    )


def alone(cloth: ClothModel, positions: Points, solver: SolverSettings) -> ClothSimulator:
    """A cloth with nothing around it."""
    return ClothSimulator(cloth, positions, np.zeros((0, 3)), NO_FACES, APART, solver)


def equilibrium(
    sim: ClothSimulator, tolerance: float, dt: float = 1.0, max_steps: int = 200, friction: bool = False
) -> int:
    """Take steps without inertia until one moves no vertex by more than `tolerance` metres; their number.

    Raises SimulationError where `max_steps` do not suffice.
    """
    for step in range(1, max_steps + 1):
        moved = measured_step(sim, dt, inertia=False, friction=friction)
        if moved <= tolerance:
            return step
    raise SimulationError(
        f"no equilibrium: the last of {max_steps} steps moved a vertex by {moved:.2g} m, {tolerance:.2g} m "
        "is asked; allow more steps or a larger tolerance"
    )


def balance(sim: ClothSimulator, residual: float, dt: float, max_steps: int = 200) -> int:
    """Take steps without inertia and friction until the net forces left are `residual` of the weight; their
    number. For cloth that may float along without a force, so that its motion tells nothing.

    Raises SimulationError where `max_steps` do not suffice.
    """
    left = np.inf
    for step in range(1, max_steps + 1):
        sim.advance(None, dt, inertia=False, friction=False)
        left = force_residual(sim, dt)
        if left <= residual:
            return step
    raise SimulationError(
        f"no equilibrium: after {max_steps} steps forces of {left:.2g} of the weight are left, "
        f"{residual:.2g} is asked; allow more steps or a larger residual"
    )


def elastic_forces(sim: ClothSimulator) -> Points:
    """(V, 3) forces of stretch and bending on the vertices, N, without damping."""
    sim.elastic.begin_step(sim.x)
    sim.gradient.zero_()
    sim.linear.clear()
    sim.elastic.add_derivatives(sim.x, 0.0, sim.gradient, sim.linear.matrix)
    return -sim.gradient.numpy()


def elastic_energy(sim: ClothSimulator) -> float:
    """Energy of stretch and bending, J."""
    sim.elastic.begin_step(sim.x)
    energy = wp.zeros(1, dtype=wp.float64, device=sim.device)
    sim.elastic.add_value(sim.x, 0.0, energy)
    return float(energy.numpy()[0])


def level(panel: Points, height: float = 0.0) -> Points:
    """(V, 3) places of a level sheet with panel coordinates (V, 2): weft along x, warp along -z."""
    return np.stack([panel[:, 0], np.full(len(panel), height), -panel[:, 1]], axis=1)


def contact_forces(sim: ClothSimulator) -> Points:
    """(V, 3) forces of all contacts, with cloth and collider, on the cloth's vertices, N; no friction."""
    sim.contact.begin_step(sim.x, friction=False)
    sim.start.assign(sim.x)
    sim.remaining.zero_()
    sim.gradient.zero_()
    sim.linear.clear()
    sim.contact.add_derivatives(sim.x, sim.start, sim.remaining, sim.gradient, sim.linear.matrix)
    return -sim.gradient.numpy()
