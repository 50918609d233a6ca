"""How much work a step may cost before the run is given up."""

from __future__ import annotations

from collections.abc import Callable

from muslin.sim.solve.simulator import ClothSimulator


def with_budget(sim: ClothSimulator, work: int, tick: Callable[[], None]) -> Callable[[], None]:
    """Allow `sim` to spend `work` Newton iterations on its next step.

    Returns what to call after every step: it allows them anew, then calls `tick`.
    """
    sim.work_left = work

    def next_step() -> None:
        sim.work_left = work
        tick()

    return next_step
