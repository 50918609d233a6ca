"""How far a time step of few iterations is from the step solved, and what it costs."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.garment import walk
from benchmarks.setting import DT, Setting
from muslin.sim.contact.clearance import SelfClearance
from muslin.sim.run import compile_kernels
from muslin.sim.solve.settings import SolverSettings
from muslin.sim.solve.simulator import ClothSimulator
from muslin.sim.wear import advance_on_body


@dataclass(frozen=True)
class StepFigures:
    """Vertex distances to the solved step, mm, mean and 99th percentile, and CPU ms, means over the steps."""

    max_iterations: int
    linear_tolerance: float
    mean: float
    p99: float
    cpu_ms: float


def step_figures(
    setting: Setting, choices: list[tuple[int, float]], warm_up: int, steps: int
) -> list[StepFigures]:
    """Each of `steps` steps after `warm_up` from the same state: solved, and by every choice.

    `choices`: `max_iterations` and `linear_tolerance`. The walk goes on by the settings of the scene.
    """
    compile_kernels("cpu")
    sim, clearance = walk(setting)
    solver = sim.settings
    found: dict[tuple[int, float], list[tuple[float, float, float]]] = {choice: [] for choice in choices}
    for frame in range(1, warm_up + steps + 1):
        body = setting.body[frame]
        if frame > warm_up:
            exact = replace(solver, max_iterations=80, tolerance=1.0e-7, linear_tolerance=1.0e-3)
            solved, _ = _try(sim, clearance, body, exact)
            for choice in choices:
                few = replace(solver, max_iterations=choice[0], linear_tolerance=choice[1])
                positions, seconds = _try(sim, clearance, body, few)
                distance = 1e3 * np.linalg.norm(positions - solved, axis=1)
                found[choice].append((distance.mean(), np.percentile(distance, 99.0), 1e3 * seconds))
        advance_on_body(sim, clearance, body, DT)
    means = {choice: np.mean(rows, axis=0) for choice, rows in found.items()}
    return [StepFigures(*choice, *(float(value) for value in row)) for choice, row in means.items()]


def _try(
    sim: ClothSimulator, clearance: SelfClearance, body: NDArray[np.float64], settings: SolverSettings
) -> tuple[NDArray[np.float64], float]:
    """Positions after a step and its CPU seconds; the simulator is left as it was."""
    x, velocity, usual = sim.x.numpy().copy(), sim.velocity, sim.settings
    bristle = sim.contact.friction.bristle.numpy().copy()
    sim.settings = settings
    begin = time.process_time()
    advance_on_body(sim, clearance, body, DT)
    seconds = time.process_time() - begin
    positions = sim.positions
    sim.settings = usual
    sim.restore(x, velocity)
    sim.contact.friction.bristle.assign(bristle)
    return positions, seconds
