"""Coming to rest: implicit steps with kinetic damping, until neither force nor motion is left.

Velocities are set to zero whenever the kinetic energy has passed a peak (Barnes 1999, "Form finding and
analysis of tension structures by dynamic relaxation"). A force residual alone misleads: cloth that slides
along a soft curved valley shows little force a centimetre from where it ends. So the rule asks for a small
residual and for small moves over several steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from muslin.sim.solve.simulator import ClothSimulator

STILL_STEPS = 3

POLISH_STEPS = 2
POLISH_ITERATIONS = 20
POLISH_TOLERANCE = 1.0e-6
"""The last steps are solved this far, metres, so that the residual is not the solver's."""


@dataclass(frozen=True)
class RestReport:
    """`steps` taken, `moved` m by the fastest vertex in the last of them, `residual` as a share of the
    weight, and whether the rule was met."""

    steps: int
    moved: float
    residual: float
    at_rest: bool


def settle(
    sim: ClothSimulator,
    tolerance: float,
    max_steps: int,
    dt: float = 1.0 / 30.0,
    tick: Callable[[], None] | None = None,
) -> RestReport:
    """Step until no vertex moved more than `tolerance` metres in each of `STILL_STEPS` steps."""
    energy = 0.0
    still = 0
    moved = np.inf
    steps = 0
    while steps < max_steps and still < STILL_STEPS:
        before = sim.positions
        sim.advance(None, dt)
        steps += 1
        moved = float(np.linalg.norm(sim.positions - before, axis=1).max())
        still = still + 1 if moved < tolerance else 0
        now = float(0.5 * (sim.cloth.mass[:, None] * sim.velocity**2).sum())
        if now < energy:
            sim.velocity[:] = 0.0
            now = 0.0
        energy = now
        if tick is not None:
            tick()
    accurate = replace(sim.settings, max_iterations=POLISH_ITERATIONS, tolerance=POLISH_TOLERANCE)
    usual, sim.settings = sim.settings, accurate
    try:
        for _ in range(POLISH_STEPS):
            before = sim.positions
            sim.velocity[:] = 0.0
            sim.advance(None, dt)
            moved = float(np.linalg.norm(sim.positions - before, axis=1).max())
    finally:
        sim.settings = usual
    sim.velocity[:] = 0.0
    return RestReport(steps + POLISH_STEPS, moved, sim.force_residual(dt), still >= STILL_STEPS)
