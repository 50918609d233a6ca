"""The heavy elastica: an inextensible strip, clamped level at one end, that bends under its own weight."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_bvp

TOLERANCE = 1.0e-8
RAMP = 4.0
"""Factor between the numbers on the way to a large one: each solution starts from the one before."""


@dataclass(frozen=True)
class Elastica:
    """Shape at arc lengths s in [0, 1]: reach x and drop y below the clamp, lengths of the strip."""

    s: NDArray[np.float64]
    x: NDArray[np.float64]
    y: NDArray[np.float64]

    @property
    def ratio(self) -> float:
        """Drop of the tip over its reach."""
        return float(self.y[-1] / self.x[-1])


@cache
def heavy_elastica(number: float) -> Elastica:
    """The elastica of gravito-bending number Gamma = sigma g L^3 / B.

        theta'' = -Gamma (1 - s) cos theta,   x' = cos theta,   y' = sin theta,
        theta(0) = 0,  theta'(1) = 0,  x(0) = y(0) = 0,

    theta the slope below the horizontal: B theta' is the moment of all that hangs beyond s.
    Source: Wang 1986, "A critical review of the heavy elastica", Int. J. Mech. Sci. 28(8).
    """
    s = np.linspace(0.0, 1.0, 401)
    start = np.stack([np.zeros_like(s), np.zeros_like(s), s, np.zeros_like(s)])
    steps = max(1, int(np.ceil(np.log(max(number, 1.0)) / np.log(RAMP))))
    for step in range(1, steps + 1):
        gamma = number * RAMP ** (step - steps)
        solution = solve_bvp(
            lambda s, u, gamma=gamma: np.stack(
                [u[1], -gamma * (1.0 - s) * np.cos(u[0]), np.cos(u[0]), np.sin(u[0])]
            ),
            lambda a, b: np.array([a[0], b[1], a[2], a[3]]),
            s,
            start,
            tol=TOLERANCE,
            max_nodes=100_000,
        )
        if not solution.success:
            raise ArithmeticError(f"the elastica of Gamma = {gamma:g} is not found: {solution.message}")
        start = solution.sol(s)
    return Elastica(s, start[2], start[3])
