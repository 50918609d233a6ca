"""A stiff sheet that swings from its upper edge: order of accuracy in dt, and loss of energy.

With vertices of mass m_i at distance r_i below the edge it is a compound pendulum,

    theta'' = -omega^2 sin theta,   omega^2 = g sum_i m_i r_i / sum_i m_i r_i^2,

solved by Runge-Kutta far beyond the simulator's accuracy. Implicit Euler is of first order: halving dt halves
the error. A small swing keeps 1 / (1 + omega^2 dt^2) of its energy a step.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from muslin.eval.validate.case import CaseTable, Count, Outcome, Plot, Row, Series
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import DOWN, GRAVITY, alone, exact
from muslin.sim.cloth import ClothModel, build_cloth
from muslin.sim.material import isotropic_fabric
from muslin.sim.tables import Positive


class Pendulum(CaseTable):
    """`amplitude` rad of the swing whose order is measured, and of the `small` one that loses energy; `dts`
    s, each half of the one before, the first for the small one; `seconds` and `small_seconds` of them;
    `bar_order` absolute."""

    young: Positive
    thickness: Positive
    density: Positive
    length: Positive
    elements: Count
    amplitude: Positive
    small_amplitude: Positive
    dts: list[Positive]
    seconds: Positive
    small_seconds: Positive
    bar_order: Positive
    bar_energy: Positive


def run(p: Pendulum) -> Outcome:
    """Rows: order of accuracy between the two smallest steps, energy left of a small swing."""
    outcome = Outcome()
    times = np.linspace(0.0, p.seconds, 200)
    cloth, below, _ = sheet(p)
    omega2 = GRAVITY * (cloth.mass @ below) / (cloth.mass @ below**2)
    known = exact_swing(p.amplitude, omega2, times)
    series = [Series("exact", times.tolist(), known.tolist())]
    errors = []
    for dt in p.dts:
        t, angle, _ = swing(p, p.amplitude, dt, p.seconds)
        errors.append(float(np.abs(angle - exact_swing(p.amplitude, omega2, t)).max()))
        every = max(1, len(t) // 40)
        series.append(
            Series(f"dt = {1e3 * dt:.3g} ms", t[::every].tolist(), angle[::every].tolist(), "points")
        )
    order = float(np.log2(errors[-2] / errors[-1]))
    outcome.rows.append(Row("pendulum: order of accuracy in dt", order, 1.0, p.bar_order, "absolute"))
    dt = p.dts[0]
    left = swing(p, p.small_amplitude, dt, p.small_seconds)[2]
    expected = float((1.0 + omega2 * dt**2) ** -round(p.small_seconds / dt))
    name = f"pendulum: share of the energy left after {p.small_seconds:g} s at dt = {dt:.4g} s"
    outcome.rows.append(Row(name, left, expected, p.bar_energy))
    slope = [errors[-1] * dt / p.dts[-1] for dt in p.dts]
    outcome.plots = [
        Plot("Pendulum: angle", "s", "rad", series),
        Plot(
            "Pendulum: largest error of the angle",
            "dt, s",
            "rad",
            [Series("first order", p.dts, slope), Series("simulated", p.dts, errors, "points")],
            log_x=True,
            log_y=True,
        ),
    ]
    return outcome


def exact_swing(amplitude: float, omega2: float, times: np.ndarray) -> np.ndarray:
    """Angle at `times` of a pendulum let go at `amplitude`."""
    path = solve_ivp(
        lambda t, u: [u[1], -omega2 * np.sin(u[0])],
        (0.0, float(times[-1])),
        [amplitude, 0.0],
        method="DOP853",
        t_eval=times,
        rtol=1e-11,
        atol=1e-12,
    )
    return path.y[0]


def sheet(p: Pendulum) -> tuple[ClothModel, np.ndarray, np.ndarray]:
    """The cloth, and the distances (V,) of its vertices from the upper edge and from the left one."""
    mesh = rectangle(0.5 * p.length, p.length, p.elements, 2 * p.elements, "structured", p.seed)
    fabric = isotropic_fabric(p.young, 0.3, p.thickness, p.density)
    across, up = mesh.panel_vertices.T
    return build_cloth(mesh, fabric), p.length - up, across


def swing(p: Pendulum, amplitude: float, dt: float, seconds: float) -> tuple[np.ndarray, np.ndarray, float]:
    """Times, angle at each, and the share of its energy that is left at the end."""
    cloth, below, across = sheet(p)
    x = below * np.sin(amplitude)
    start = np.stack([x, -below * np.cos(amplitude), -across], axis=1)
    sim = alone(cloth, start, exact(DOWN))
    sim.pins[:] = below == 0.0
    lever = cloth.mass * below
    angles = []
    steps = round(seconds / dt)
    for _ in range(steps):
        sim.advance(None, dt)
        angles.append(float(np.arctan2(lever @ sim.positions[:, 0], -lever @ sim.positions[:, 1])))
    rise = (cloth.mass @ (sim.positions[:, 1] + below)) * GRAVITY
    energy = rise + 0.5 * cloth.mass @ (sim.velocity**2).sum(axis=1)
    first = GRAVITY * lever.sum() * (1.0 - np.cos(amplitude))
    return dt * np.arange(1, steps + 1), np.array(angles), float(energy / first)
