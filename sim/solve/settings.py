"""What a time step may cost and how far it is solved, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass

from muslin.sim.air import AirSettings


@dataclass(frozen=True)
class SolverSettings:
    """`damping` s of stiffness-proportional viscosity; `drag` 1/s of mass-proportional; `tolerance` m:
    largest Newton step at which a time step counts as solved; `min_iterations` and `max_iterations` of Newton
    once the collider has arrived, `max_advances` before, with `relaxations` in between where the way was
    short; `guards`: how often a direction that runs into contact is turned aside; `max_move` m an iteration;
    `linear_tolerance` of `muslin.sim.solve.conjugate_gradients`, a tenth of it while the collider advances;
    `air`, or None for a vacuum."""

    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0)
    damping: float = 2.0e-3
    drag: float = 0.5
    tolerance: float = 5.0e-4
    min_iterations: int = 2
    max_iterations: int = 4
    max_advances: int = 30
    relaxations: int = 2
    guards: int = 2
    max_move: float = 0.03
    max_backtracks: int = 12
    linear_tolerance: float = 0.1
    max_linear_iterations: int = 400
    max_splits: int = 4
    air: AirSettings | None = None


@dataclass
class StepReport:
    """Work of one time step: Newton and linear iterations, the last move (m), whether it met `tolerance`."""

    newton: int = 0
    linear: int = 0
    splits: int = 0
    last_move: float = 0.0
    converged: bool = False
