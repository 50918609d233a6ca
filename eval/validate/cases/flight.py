"""A sheet that flies: momentum, and how fast it loses its spin.

Nothing acts on it but gravity, and no drag. Implicit Euler keeps linear momentum to round-off, falls by

    y_n = -g dt^2 n (n + 1) / 2,

and takes energy out of rotation. A rigid sheet that turns by D in one step turns in the next by

    D' = atan(sin D / (2 - cos D)) = D - D^3 + ...,   first D = atan(omega dt),

since the step looks for the rotation nearest to 2 x_n - x_(n-1); its speed is that of the chords,
2 r sin(D / 2) / dt. The drift is the integrator's, and it is the row's expected value.
"""

from __future__ import annotations

import numpy as np

from muslin.eval.validate.case import CaseTable, Count, Outcome, Plot, Row, Series
from muslin.eval.validate.meshes import rectangle
from muslin.eval.validate.world import DOWN, GRAVITY, alone, exact
from muslin.sim.cloth import build_cloth
from muslin.sim.material import isotropic_fabric, load_fabric
from muslin.sim.tables import Positive


class Flight(CaseTable):
    """`spin` rad/s about the sheet's normal; `young` Pa of the stiff sheet that spins; `fabric` of the one
    that flutters at `speed` m/s; `dt` and `seconds`, s."""

    fabric: str
    young: Positive
    thickness: Positive
    density: Positive
    side: Positive
    elements: Count
    spin: Positive
    speed: Positive
    dt: Positive
    seconds: Positive
    bar_momentum: Positive
    bar_energy: Positive


def run(p: Flight) -> Outcome:
    """Rows: linear momentum, height of the fall, energy that is left of a spin."""
    outcome = Outcome()
    momentum, fall = flutter(p)
    outcome.rows += [
        Row("free flight: change of momentum over sum of m |v|", momentum, 0.0, p.bar_momentum, "absolute"),
        Row("free flight: error of the centre's height over its fall", fall, 0.0, p.bar_momentum, "absolute"),
    ]
    found, known = spin(p), turning(p.spin, p.dt, round(p.seconds / p.dt))
    name = f"free flight: share of the spin's energy left after {p.seconds:g} s at dt = {p.dt:.4g} s"
    outcome.rows.append(Row(name, float(found[-1]), float(known[-1]), p.bar_energy))
    t = p.dt * np.arange(1, len(found) + 1)
    series = [
        Series("implicit Euler, rigid", t.tolist(), known.tolist()),
        Series("simulated", t[::4].tolist(), found[::4].tolist(), "points"),
    ]
    outcome.plots = [Plot("Free flight: energy of a spin, shares of the first", "s", "share", series)]
    return outcome


def turning(spin: float, dt: float, steps: int) -> np.ndarray:
    """(steps,) kinetic energy after each step over that at the start, of a rigid body turned by the
    recursion."""
    turn = np.zeros(steps)
    turn[0] = np.arctan(spin * dt)
    for k in range(1, steps):
        turn[k] = np.arctan2(np.sin(turn[k - 1]), 2.0 - np.cos(turn[k - 1]))
    return (2.0 * np.sin(0.5 * turn) / (spin * dt)) ** 2


def flutter(p: Flight) -> tuple[float, float]:
    """A limp sheet thrown with a random velocity at every vertex: change of momentum over sum m |v|, error of
    the centre's height over its fall, each at its largest."""
    mesh = rectangle(p.side, p.side, p.elements, p.elements, "irregular", p.seed)
    cloth = build_cloth(mesh, load_fabric(p.fabric))
    # Linear systems solved roughly leave momentum behind: their residual need not add up to zero.
    solver = exact(DOWN, linear_tolerance=1.0e-10)
    sim = alone(cloth, np.pad(mesh.panel_vertices, ((0, 0), (0, 1))), solver)
    sim.velocity = np.random.default_rng(p.seed).normal(0.0, p.speed, (cloth.num_vertices, 3))
    mass, total = cloth.mass, cloth.mass.sum()
    start, height = mass @ sim.velocity, mass @ sim.positions[:, 1] / total
    scale = float(mass @ np.linalg.norm(sim.velocity, axis=1))
    changes, errors = [], []
    for n in range(1, round(p.seconds / p.dt) + 1):
        sim.advance(None, p.dt)
        gained = np.array([0.0, -GRAVITY * n * p.dt * total, 0.0])
        changes.append(float(np.linalg.norm(mass @ sim.velocity - gained - start)) / scale)
        fall = 0.5 * GRAVITY * p.dt**2 * n * (n + 1)
        known = height + n * p.dt * start[1] / total - fall
        errors.append(float(abs(mass @ sim.positions[:, 1] / total - known)) / fall)
    return max(changes), max(errors)


def spin(p: Flight) -> np.ndarray:
    """Kinetic energy after each step over that at the start, of a stiff sheet that spins in its plane."""
    mesh = rectangle(p.side, p.side, p.elements, p.elements, "irregular", p.seed)
    cloth = build_cloth(mesh, isotropic_fabric(p.young, 0.3, p.thickness, p.density))
    panel = mesh.panel_vertices - cloth.mass @ mesh.panel_vertices / cloth.mass.sum()
    sim = alone(cloth, np.pad(panel, ((0, 0), (0, 1))), exact((0.0, 0.0, 0.0)))
    sim.velocity = p.spin * np.stack([-panel[:, 1], panel[:, 0], np.zeros(len(panel))], axis=1)
    start = float(cloth.mass @ (sim.velocity**2).sum(axis=1))
    energy = []
    for _ in range(round(p.seconds / p.dt)):
        sim.advance(None, p.dt)
        energy.append(float(cloth.mass @ (sim.velocity**2).sum(axis=1)) / start)
    return np.array(energy)
