"""Coming to rest: kinetic damping until the swing is over, then ever longer steps without inertia.

Velocities are set to zero whenever the kinetic energy has passed a peak (Barnes 1999, "Form finding and
analysis of tension structures by dynamic relaxation"). That alone ends anywhere: after each such moment the
cloth starts again from nothing, and its moves in a step, some dt^2 times the acceleration, are small however
far it has to go. So steps are then without inertia and twice as long each, up to `LONGEST`, where a step is
all but the equilibrium itself (pseudo-transient continuation; Kelley, Keyes 1998). Cloth is at rest when such
steps no longer move it. A force residual alone misleads as well: cloth that slides along a soft curved valley
shows little force a centimetre from where it ends. The report holds both.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from muslin.sim.solve.rest_forces import force_residual
from muslin.sim.solve.simulator import ClothSimulator

SWING_STEP = 1.0 / 30.0
SWING = 5.0
"""Multiple of the tolerance below which the moves of three steps end the swinging."""
STILL_SWINGS = 3
SLOW = 10.0
"""Multiple of that below which the mesh is left as it is, once remeshing finds next to nothing to change: the
cloth would wait for the last of it."""

LONGEST = 1.0
"""Seconds: the longest step without inertia."""
STILL_STEPS = 2
"""Steps of that length that must not move the cloth."""

LINEAR_TOLERANCE = 0.01
"""Of the linear systems here: looser ones leave a drape creeping for twice the steps."""


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
    tick: Callable[[], None] | None = None,
    remesh: Callable[[], bool] | None = None,
) -> RestReport:
    """Step until `STILL_STEPS` steps of `LONGEST` seconds moved no vertex by more than `tolerance` metres.

    At most `max_steps` steps, half of them swinging; `tick` is called after every step, `remesh` after the
    swinging ones, until it says that the mesh is as it should be and little moves: in that mesh the cloth
    comes to rest.
    """
    usual = sim.settings
    sim.settings = replace(usual, linear_tolerance=min(usual.linear_tolerance, LINEAR_TOLERANCE))
    try:
        steps = _swing(sim, SWING * tolerance, max_steps // 2, tick, remesh)
        dt, still, moved = SWING_STEP, 0, np.inf
        while steps < max_steps and still < STILL_STEPS:
            moved = measured_step(sim, dt, inertia=False)
            still = still + 1 if dt == LONGEST and moved < tolerance else 0
            dt = min(2.0 * dt, LONGEST)
            steps += 1
            if tick is not None:
                tick()
    finally:
        sim.settings = usual
    return RestReport(steps, moved, force_residual(sim, LONGEST), still >= STILL_STEPS)


def _swing(
    sim: ClothSimulator,
    tolerance: float,
    max_steps: int,
    tick: Callable[[], None] | None,
    remesh: Callable[[], bool] | None,
) -> int:
    """Kinetic damping until `STILL_SWINGS` steps moved no vertex by over `tolerance`; the steps taken."""
    energy = 0.0
    still = steps = 0
    while steps < max_steps and still < STILL_SWINGS:
        moved = measured_step(sim, SWING_STEP, inertia=True)
        still = still + 1 if moved < tolerance else 0
        steps += 1
        now = float(0.5 * (sim.cloth.mass[:, None] * sim.velocity**2).sum())
        if now < energy:
            sim.velocity[:] = 0.0
            now = 0.0
        energy = now
        if remesh is not None and remesh() and moved < SLOW * tolerance:
            remesh = None
        if tick is not None:
            tick()
    sim.velocity[:] = 0.0
    return steps


def measured_step(sim: ClothSimulator, dt: float, inertia: bool, friction: bool = True) -> float:
    """One step of `dt` seconds beside a collider that stands still; the largest move of a vertex, metres."""
    before = sim.positions
    sim.advance(None, dt, inertia=inertia, friction=friction)
    return float(np.linalg.norm(sim.positions - before, axis=1).max())
